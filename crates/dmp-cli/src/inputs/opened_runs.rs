//! A log and the runs on it, opened: what is scored.

use dmp::{LeftOutReport, MapSource, Run, RunSource};
use dmp_log::{LogError, LogOutline, ScanLog};

use super::clock::RunClock;
use super::extrinsic::BodyFromSensor;
use super::loaded_run::LoadedRun;
use super::log_input::{LogHead, LogInput};
use super::runs::Runs;
use super::{announce, extrinsic};
use crate::console::{Common, Hosted, one_line, say};
use crate::options::Asked;

/// A log and the runs on it, as they are scored.
pub(crate) struct OpenedRuns<L = Box<dyn ScanLog>> {
    pub(crate) log: L,
    pub(crate) runs: Vec<Run>,
    /// Runs without a trajectory that can be read.
    pub(crate) unread: Vec<LeftOutReport>,
    /// Whether the messages of each started run hold its trajectory.
    pub(crate) is_read: Vec<bool>,
    /// Whether part of the log or of a run is lost; warnings say what.
    pub(crate) damaged: bool,
}

impl OpenedRuns {
    /// Opens the log, finishes the runs and finds where their sensors sat. Prints what was found.
    pub(crate) fn open(
        started: Runs,
        maps: impl IntoIterator<Item = MapSource>,
        log: &LogInput,
        asked: &Asked,
        threads: usize,
        common: &Common,
    ) -> anyhow::Result<Self> {
        let log = log.open(threads)?;
        let host = (!common.quiet).then_some(&common.host);
        let found = Found::of(started, LogHead::of_log(log.as_ref()), asked, host)?;
        let is_damaged = !log.summary().damage.is_empty();
        Ok(found.with_log(log, is_damaged, maps))
    }
}

impl<L> OpenedRuns<L> {
    /// A copy of the runs.
    pub(crate) fn runs_only(&self) -> OpenedRuns<()> {
        let (runs, unread, is_read) = (self.runs.clone(), self.unread.clone(), self.is_read.clone());
        OpenedRuns { log: (), runs, unread, is_read, damaged: self.damaged }
    }
}

impl OpenedRuns<()> {
    /// The runs on the log, opened again.
    pub(crate) fn on(self, log: Box<dyn ScanLog>) -> OpenedRuns {
        let Self { runs, unread, is_read, .. } = self;
        let damaged = self.damaged || !log.summary().damage.is_empty();
        OpenedRuns { log, runs, unread, is_read, damaged }
    }
}

impl OpenedRuns<LogOutline> {
    /// The same with no more of the log than its index, where `is_enough`; else nothing is printed, and the runs come back.
    pub(crate) fn outline_if(
        started: Runs,
        log: &LogInput,
        asked: &Asked,
        common: &Common,
        is_enough: impl FnOnce(&LogOutline) -> bool,
    ) -> anyhow::Result<Result<Self, Runs>> {
        let in_log = started.in_log();
        let log = log.outline()?;
        if !is_enough(&log) {
            return Ok(Err(started));
        }
        let found = Found::of(started, LogHead::of_outline(&log), asked, None)?;
        if !common.quiet {
            if let Some(run) = in_log {
                say!(
                    common.host,
                    "note: the poses of `{run}` are messages of the log, so all of it is read; a trajectory in a file avoids that"
                );
            }
            announce::found(&common.host, LogHead::of_outline(&log), &found.loaded);
            announce::extrinsics(&common.host, &found.loaded, &found.extrinsics);
        }
        let is_damaged = !log.summary().damage.is_empty();
        Ok(Ok(found.with_log(log, is_damaged, std::iter::repeat(MapSource::Fused))))
    }
}

/// Runs, and where their sensors sat.
#[derive(Debug, Clone)]
struct Found {
    loaded: Vec<LoadedRun>,
    extrinsics: Vec<BodyFromSensor>,
    clocks: Vec<RunClock>,
    unread: Vec<LeftOutReport>,
    /// Whether the messages of each started run hold its trajectory.
    is_read: Vec<bool>,
    /// Whether part of a run is lost.
    is_damaged: bool,
}

impl Found {
    /// Finishes the runs; prints what is found to the host, if there is one.
    fn of(mut started: Runs, log: LogHead<'_>, asked: &Asked, host: Option<&Hosted>) -> anyhow::Result<Self> {
        let clocks = RunClock::of_runs(asked, &started.names())?;
        let mut unread = std::mem::take(&mut started.unread);
        let finished = started.finish_some(log.summary)?;
        let is_read: Vec<bool> = finished.iter().map(Result::is_ok).collect();
        let mut loaded = Vec::new();
        for run in finished {
            match run {
                Ok(run) => loaded.push(run),
                Err(problem) => unread.push(problem),
            }
        }
        if loaded.is_empty() && !unread.is_empty() {
            return Err(unread.swap_remove(0).1.into());
        }
        let unread: Vec<LeftOutReport> = unread.into_iter().map(left_out).collect();
        let clocks = of_read(clocks, &is_read).collect();
        if let Some(host) = host {
            announce::found(host, log, &loaded);
        }
        let extrinsics = extrinsic::of_runs(asked, &loaded, &unread, log)?;
        if let Some(host) = host {
            announce::extrinsics(host, &loaded, &extrinsics);
        }
        let is_damaged = !unread.is_empty() || loaded.iter().any(|run| run.damaged);
        Ok(Self { loaded, extrinsics, clocks, unread, is_read, is_damaged })
    }

    fn with_log<L>(
        self,
        log: L,
        is_damaged: bool,
        maps: impl IntoIterator<Item = MapSource>,
    ) -> OpenedRuns<L> {
        let damaged = self.is_damaged || is_damaged;
        let maps = of_read(maps, &self.is_read);
        let runs = to_score(self.loaded, maps, self.extrinsics, self.clocks);
        OpenedRuns { log, runs, unread: self.unread, is_read: self.is_read, damaged }
    }
}

/// What belongs to runs whose trajectory was read.
fn of_read<T>(of_started: impl IntoIterator<Item = T>, is_read: &[bool]) -> impl Iterator<Item = T> {
    of_started.into_iter().zip(is_read).filter_map(|(one, is_read)| is_read.then_some(one))
}

fn left_out((name, problem): (String, LogError)) -> LeftOutReport {
    let reason = format!("run `{name}` is excluded: {}", one_line(&problem.as_shown().into()));
    LeftOutReport { name, reason }
}

/// The runs as they are scored.
pub(crate) fn to_score(
    loaded: Vec<LoadedRun>,
    maps: impl IntoIterator<Item = MapSource>,
    extrinsics: Vec<BodyFromSensor>,
    clocks: impl IntoIterator<Item = RunClock>,
) -> Vec<Run> {
    let run = |(((run, map), extrinsic), clock): (((LoadedRun, MapSource), BodyFromSensor), RunClock)| Run {
        source: RunSource {
            file: Some(run.shown()),
            format: Some(run.format.to_owned()),
            body_from_sensor: Some(extrinsic.source),
            notes: run.notes,
        },
        name: run.name,
        trajectory: run.trajectory,
        map,
        body_from_sensor: Some(extrinsic.transform),
        pose_at: clock.pose_at,
        time_offset_ns: clock.time_offset_ns,
        is_carried: run.is_carried,
    };
    loaded.into_iter().zip(maps).zip(extrinsics).zip(clocks).map(run).collect()
}
