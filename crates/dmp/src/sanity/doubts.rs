//! The log, the plan and the settings by which runs are doubted.

use dmp_log::ScanLog;

use crate::plan::Plan;
use crate::progress::Progress;
use crate::settings::Settings;

/// Looks for what is wrong with runs on a log.
#[derive(Clone, Copy)]
pub(crate) struct Doubts<'a> {
    pub(crate) log: &'a dyn ScanLog,
    pub(crate) plan: &'a Plan,
    pub(crate) settings: &'a Settings,
    pub(crate) progress: &'a dyn Progress,
}
