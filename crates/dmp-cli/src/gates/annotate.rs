//! Lines that CI servers show.

use clap::ValueEnum;

use super::check::GateReport;
use crate::host::Hosted;
use crate::say::say;

/// Who reads the lines on standard error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Annotate {
    /// GitHub Actions
    Github,
}

/// A line for each gate that failed.
pub(super) fn tell_failed(host: &Hosted, annotate: Option<Annotate>, gates: &[GateReport]) {
    for failed in gates.iter().filter(|gate| !gate.passed) {
        match annotate {
            Some(Annotate::Github) => host.command(&github(failed)),
            None => say!(host, "gate failed: {failed}"),
        }
    }
}

/// A workflow command of GitHub Actions, in which `%` and line ends of the message are written as `%25` and the like
/// (docs.github.com, "Workflow commands for GitHub Actions").
fn github(failed: &GateReport) -> String {
    let message = failed.to_string().replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A");
    format!("::error title=dmp gate failed::{message}")
}
