//! The context in which given maps are checked: log, plan and settings.

use dmp_log::ScanLog;
use dmp_runs::{Progress, Settings};

use crate::passes::plan::Plan;

/// Checks runs and given maps on a log.
#[derive(Clone, Copy)]
pub(crate) struct Doubts<'a> {
    pub(crate) log: &'a dyn ScanLog,
    pub(crate) plan: &'a Plan,
    pub(crate) settings: &'a Settings,
    pub(crate) progress: &'a dyn Progress,
}
