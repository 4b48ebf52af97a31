//! Collects a command's messages: its threads store them until the waiting thread passes them on.
//!
//! Only the thread that called the command calls the Python listener. So the listener may draw, and raise an exception
//! that ends the command.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use dmp_cli::Host;
use pyo3::prelude::*;

/// Messages not yet passed on.
#[derive(Debug, Default)]
struct Kept {
    lines: Vec<String>,
    stage: Option<Stage>,
    is_over: bool,
}

/// The progress of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stage {
    name: &'static str,
    unit: &'static str,
    total: Option<u64>,
    done: u64,
}

/// The host of a command run from Python.
#[derive(Debug, Default)]
pub(crate) struct Listened {
    kept: Mutex<Kept>,
    ended: Condvar,
    is_cancelled: AtomicBool,
}

impl Host for Listened {
    fn say(&self, line: &str) {
        self.kept().lines.push(line.to_owned());
    }

    fn begin(&self, name: &'static str, unit: &'static str, total: Option<u64>) {
        self.kept().stage = Some(Stage { name, unit, total, done: 0 });
    }

    fn advance(&self, steps: u64) {
        if let Some(stage) = &mut self.kept().stage {
            stage.done += steps;
        }
    }

    fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }
}

impl Listened {
    fn kept(&self) -> MutexGuard<'_, Kept> {
        // After a panic the content is still valid: it is only appended to.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Requests the command to stop.
    pub(crate) fn cancel(&self) {
        self.is_cancelled.store(true, Ordering::Relaxed);
    }

    /// Marks the command as ended.
    pub(crate) fn end(&self) {
        self.kept().is_over = true;
        self.ended.notify_all();
    }

    /// Waits at most this long for the command's end; returns whether it has ended.
    pub(crate) fn wait(&self, most: Duration) -> bool {
        let waited = self.ended.wait_timeout_while(self.kept(), most, |kept| !kept.is_over);
        waited.map_or_else(|poisoned| poisoned.into_inner().0.is_over, |(kept, _)| kept.is_over)
    }

    /// Calls the listener with new messages. `shown` is the stage at the last call.
    pub(crate) fn hand_on(&self, listener: &Bound<'_, PyAny>, shown: &mut Shown) -> PyResult<()> {
        let (lines, stage) = {
            let mut kept = self.kept();
            (std::mem::take(&mut kept.lines), kept.stage)
        };
        for line in lines {
            listener.call_method1("say", (line,))?;
        }
        if let Some(Stage { name, unit, total, done }) = stage
            && shown.0 != stage
        {
            listener.call_method1("progress", (name, unit, done, total))?;
            shown.0 = stage;
        }
        if !self.is_cancelled() && listener.call_method0("is_cancelled")?.is_truthy()? {
            self.cancel();
        }
        Ok(())
    }
}

/// The progress that the listener has received.
#[derive(Debug, Default)]
pub(crate) struct Shown(Option<Stage>);
