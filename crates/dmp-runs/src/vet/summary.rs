//! The vetting part of a report.

use serde::{Deserialize, Serialize};

use dmp_report::{ConventionsReport, LeftOutReport, Report};

/// The vetting part of a report on its runs; empty without vetting.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VetSummary {
    pub(super) left_out: Vec<LeftOutReport>,
    /// For runs by name.
    pub(super) conventions: Vec<(String, ConventionsReport)>,
    pub(super) messages: Vec<String>,
}

impl VetSummary {
    /// Whether a run was excluded.
    pub fn leaves_out(&self) -> bool {
        !self.left_out.is_empty()
    }

    /// The names of the excluded runs.
    pub fn names_left_out(&self) -> impl Iterator<Item = &str> {
        self.left_out.iter().map(|run| run.name.as_str())
    }

    /// All findings, a sentence each.
    pub fn messages(&self) -> &[String] {
        &self.messages
    }

    /// Whether a run was excluded for what a finding says.
    pub fn leaves_out_by(&self, message: &str) -> bool {
        self.left_out.iter().any(|run| run.reason == message)
    }

    /// Excludes more runs: those of which there is no trajectory.
    pub fn leave_out(&mut self, runs: &[LeftOutReport]) {
        self.messages.splice(0..0, runs.iter().map(|run| run.reason.clone()));
        self.left_out.extend_from_slice(runs);
    }

    /// Adds it to a report.
    pub fn put_into(&self, report: &mut Report) {
        report.left_out.extend(self.left_out.iter().cloned());
        for run in &mut report.inputs.runs {
            let of_run = self.conventions.iter().find(|(name, _)| *name == run.name);
            if let Some((_, conventions)) = of_run {
                run.conventions = Some(conventions.clone());
            }
        }
        let messages = self.messages.iter().cloned();
        report.warnings.splice(0..0, messages);
    }
}
