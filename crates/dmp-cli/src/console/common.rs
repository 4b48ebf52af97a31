//! What every command knows: whether it is quiet, who runs it and who reads it.

use super::host::Hosted;
use super::terminal::Terminal;

/// What every command knows.
#[derive(Debug, Default)]
pub(crate) struct Common {
    pub(crate) quiet: bool,
    pub(crate) host: Hosted,
    pub(crate) terminal: Terminal,
}
