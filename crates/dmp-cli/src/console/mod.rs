//! The process and its terminal: messages, progress, exit codes.

mod common;
mod exit;
mod host;
pub(crate) mod process;
mod progress;
pub(crate) mod say;
mod terminal;

pub(crate) use common::Common;
pub use exit::{Exit, Failure, FailureKind};
pub(crate) use exit::{Unreadable, Usage, is_closed_pipe, is_interrupt, one_line, option_of, when_printed};
pub use host::Host;
pub(crate) use host::Hosted;
pub(crate) use progress::Progress;
pub(crate) use say::{Printed, commands_anywhere, say, tell};
pub(crate) use terminal::{Terminal, Tone};
