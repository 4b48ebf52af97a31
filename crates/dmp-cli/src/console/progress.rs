//! The progress of an evaluation, on standard error or to the program that runs it.

use std::fmt;
use std::io::IsTerminal as _;

use dmp::{Note, Stage};
use dmp_draw::text;
use dmp_suite::Follow;
use dmp_truth::surface::{SurfaceError, SurfaceWatch};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use super::common::Common;
use super::exit::option_of;
use super::host::Hosted;
use super::say::say;

/// The progress of an evaluation: a bar on standard error where that is a terminal, gone when dropped; or passed to the
/// program that runs the command.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
    quiet: bool,
    host: Hosted,
}

impl Progress {
    pub(crate) fn new(common: &Common) -> Self {
        let bar = ProgressBar::with_draw_target(None, target(common));
        Self { bar, quiet: common.quiet, host: common.host.clone() }
    }

    /// A stage begins, of so many steps of a unit; `total` is 0 where its end is not known.
    pub(crate) fn start(&self, what: &'static str, unit: &'static str, total: u64) {
        if let Some(program) = self.host.program() {
            return program.begin(what, unit, (total > 0).then_some(total));
        }
        // How it is drawn first: every later call may draw.
        self.bar.set_style(style(unit, total > 0));
        self.bar.set_prefix(what);
        match total {
            0 => self.bar.unset_length(),
            _ => self.bar.set_length(total),
        }
        self.bar.reset();
    }

    /// So many more steps are done.
    pub(crate) fn done(&self, steps: u64) {
        match self.host.program() {
            Some(program) => program.advance(steps),
            None => self.bar.inc(steps),
        }
    }

    /// So many scans are worked on, one by one.
    pub(crate) fn scans(&self, what: &'static str, total: u64) {
        self.start(what, "scans", total);
    }

    /// One of them is done.
    pub(crate) fn one_scan(&self) {
        self.done(1);
    }

    /// Prints without tearing the bar.
    pub(crate) fn suspend(&self, print: impl FnOnce()) {
        self.bar.suspend(print);
    }

    /// So much more of a cloud or mesh is read; fails where somebody asked to stop.
    pub(crate) fn read(&self, amount: usize) -> Result<(), SurfaceError> {
        self.done(amount as u64);
        if self.host.is_cancelled() { Err(SurfaceError::Cancelled) } else { Ok(()) }
    }
}

impl SurfaceWatch for Progress {
    fn begin(&self, points: u64) {
        self.start("measuring", "points", points);
    }

    fn advance(&self, points: u64) {
        self.done(points);
    }

    fn cancelled(&self) -> bool {
        self.host.is_cancelled()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl dmp::Progress for Progress {
    fn begin(&self, stage: Stage, total: u64) {
        let (what, unit) = match stage {
            Stage::Vet => ("looking at conventions", "scans"),
            Stage::Survey => ("looking at scans", "scans"),
            Stage::ReadMap => ("reading the map", "points"),
            Stage::Fuse => ("fusing maps", "points"),
            Stage::Surfels => ("making surfels", "tiles"),
            Stage::Trails => ("finding trails", "points"),
            Stage::Cast => ("casting rays", "points"),
            Stage::Drift => ("measuring drift", "pairs"),
            Stage::Candidates => ("trying loops", "loops"),
            _ => ("working", "steps"),
        };
        self.start(what, unit, total);
    }

    fn advance(&self, amount: u64) {
        self.done(amount);
    }

    fn note(&self, note: &Note) {
        // What is left on the disk of work that failed belongs to the error.
        if !self.quiet || matches!(note, Note::WorkKept { .. }) {
            self.bar.suspend(|| say!(self.host, "note: {}", note.message_with(&option_of)));
        }
    }

    fn cancelled(&self) -> bool {
        self.host.is_cancelled()
    }
}

impl Follow for Progress {
    fn begin(&self, returns: u64) {
        self.start("comparing runs", "points", returns);
    }

    fn advance(&self, returns: u64) {
        self.done(returns);
    }

    fn cancelled(&self) -> bool {
        self.host.is_cancelled()
    }
}

/// Where a bar is drawn: on a terminal, unless the command is quiet or another program draws its own.
pub(crate) fn target(common: &Common) -> ProgressDrawTarget {
    let is_own = common.host.program().is_none();
    if is_own && !common.quiet && std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    }
}

const WITH_END: &str = "{prefix:16} {bar:14} {percent:>3} %  {rate}, {eta} left{memory}";
const WITHOUT_END: &str = "{prefix:16} {spinner} {rate}{memory}";

fn style(unit: &'static str, has_end: bool) -> ProgressStyle {
    let rate = move |state: &ProgressState, out: &mut dyn fmt::Write| {
        // Where the text cannot be drawn, nobody reads it.
        let _ = write!(out, "{} {unit}/s", text::short(state.per_sec()));
    };
    let memory = |_: &ProgressState, out: &mut dyn fmt::Write| {
        let _ = match dmp::peak_bytes() {
            Some(peak) => write!(out, ", peak {}", text::bytes(peak)),
            None => Ok(()),
        };
    };
    ProgressStyle::with_template(if has_end { WITH_END } else { WITHOUT_END })
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("rate", rate)
        .with_key("memory", memory)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_templates_are_sound() {
        for template in [WITH_END, WITHOUT_END] {
            assert!(ProgressStyle::with_template(template).is_ok(), "{template}");
        }
    }
}
