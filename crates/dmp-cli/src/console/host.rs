//! Who runs a command: where its lines and its progress go, and who may stop it.

use std::fmt;
use std::sync::Arc;

use super::{process, say};

/// A program that runs commands by [`run_for`](crate::run_for). It is called from any thread of the command.
pub trait Host: fmt::Debug + Send + Sync {
    /// A line that the command prints to standard error: what was found, `note: …`, what it took.
    fn say(&self, line: &str);

    /// A stage of the work begins, and the one before is over. It has so many steps of a unit (`scans`, `points`), or
    /// `None` where its end is not known.
    fn begin(&self, stage: &'static str, unit: &'static str, total: Option<u64>);

    /// So many more steps of the stage are done.
    fn advance(&self, steps: u64);

    /// Whether the command is to stop. It is asked all the time; a command that stops leaves nothing unfinished behind.
    fn is_cancelled(&self) -> bool;
}

/// The host of a command; without one it is the process that was started as the command.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hosted(Option<Arc<dyn Host>>);

impl Hosted {
    pub(crate) fn by(host: Arc<dyn Host>) -> Self {
        Self(Some(host))
    }

    /// See [`say!`](crate::console::say::say).
    pub(crate) fn line(&self, text: fmt::Arguments<'_>) {
        match &self.0 {
            Some(host) => host.say(&say::as_line(text)),
            None => say::line(text),
        }
    }

    /// A line that is to command a CI server.
    pub(crate) fn command(&self, text: &str) {
        match &self.0 {
            Some(host) => host.say(&dmp_log::printable(text)),
            None => say::command(text),
        }
    }

    /// Who draws the progress, where it is not this process.
    pub(crate) fn program(&self) -> Option<&dyn Host> {
        self.0.as_deref()
    }

    /// Whether somebody asked to stop.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.0.as_ref().map_or_else(process::interrupted, |host| host.is_cancelled())
    }

    /// Fails where somebody asked to stop.
    pub(crate) fn go_on(&self) -> Result<(), dmp::EvaluateError> {
        if self.is_cancelled() { Err(dmp::EvaluateError::Cancelled) } else { Ok(()) }
    }
}
