//! Runs any command in its own thread, while the calling thread checks for interrupts.

use std::ffi::OsString;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use dmp_cli::{Exit, Failure, FailureKind, Host};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors::failed;
use crate::listened::{Listened, Shown};

/// Interval at which interrupts and progress are checked.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// The usual stack of a main thread, on which the command otherwise runs.
const STACK_BYTES: usize = 8 << 20;

/// The outcome of a command: a word for its end, its error line, its output.
type Ran<'py> = (&'static str, Option<String>, Bound<'py, PyBytes>);

/// Runs a command with these arguments, without the name of the program.
///
/// The listener has the methods `say(line)`, `progress(stage, unit, done, total)` and `is_cancelled()`. An exception
/// from these, or an interrupt, stops the command and is raised when it has ended.
#[pyfunction]
pub(crate) fn run<'py>(
    py: Python<'py>,
    arguments: Vec<OsString>,
    listener: &Bound<'py, PyAny>,
) -> PyResult<Ran<'py>> {
    let heard = Arc::new(Listened::default());
    let host = Arc::clone(&heard);
    let thread = thread::Builder::new().name("dmp".into()).stack_size(STACK_BYTES);
    let work = thread.spawn(move || {
        let end = EndsWhenDropped(&host);
        let mut out = Vec::new();
        let arguments = std::iter::once("dmp".into()).chain(arguments);
        let done = dmp_cli::run_for(arguments, &mut out, Arc::clone(&host) as Arc<dyn Host>);
        drop(end);
        (done, out)
    });
    let work = work.map_err(|error| failed(py, &format_args!("no thread for the command: {error}")))?;

    let (mut shown, mut raised) = (Shown::default(), None);
    while !py.detach(|| heard.wait(LOOK_EVERY)) {
        if raised.is_none()
            && let Err(error) = py.check_signals().and_then(|()| heard.hand_on(listener, &mut shown))
        {
            heard.cancel();
            raised = Some(error);
        }
    }
    let (done, out) = match py.detach(|| work.join()) {
        Ok(ended) => ended,
        Err(panic) => std::panic::resume_unwind(panic),
    };
    if let Some(error) = raised {
        return Err(error);
    }
    heard.hand_on(listener, &mut shown)?;
    let (end, line) = in_words(done);
    Ok((end, line, PyBytes::new(py, &out)))
}

/// Marks the command as ended, even on a panic.
struct EndsWhenDropped<'a>(&'a Listened);

impl Drop for EndsWhenDropped<'_> {
    fn drop(&mut self) {
        self.0.end();
    }
}

/// Parses these arguments before work is done for them: returns `None`, or a word for the kind of error and its line.
#[pyfunction]
pub(crate) fn check_arguments(arguments: Vec<OsString>) -> Option<(&'static str, String)> {
    let failure = dmp_cli::check(std::iter::once("dmp".into()).chain(arguments)).err()?;
    Some((word(failure.kind), failure.line))
}

fn in_words(done: Result<Exit, Failure>) -> (&'static str, Option<String>) {
    match done {
        Ok(Exit::InputDamaged) => ("damaged", None),
        Ok(Exit::GateFailed) => ("gate-failed", None),
        Ok(Exit::OutputFailed) => ("output-failed", None),
        Ok(_) => ("done", None),
        Err(Failure { kind, line }) => (word(kind), Some(line)),
    }
}

fn word(kind: FailureKind) -> &'static str {
    match kind {
        FailureKind::Usage => "usage",
        FailureKind::Input => "input",
        FailureKind::Interrupted => "interrupted",
        FailureKind::Failed => "failed",
    }
}

/// Runs the command as the whole process: it prints, draws, and ends on interrupts. Returns its exit code.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| dmp_cli::run_process(std::iter::once("dmp".into()).chain(arguments)) as u8)
}
