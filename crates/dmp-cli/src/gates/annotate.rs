//! Lines that CI servers show.

use super::check::GateReport;

/// A workflow command of GitHub Actions, in which `%` and line ends of the message are written as `%25` and the like
/// (docs.github.com, "Workflow commands for GitHub Actions").
pub(super) fn github(failed: &GateReport) -> String {
    let message = failed.to_string().replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A");
    format!("::error title=dmp gate failed::{message}")
}
