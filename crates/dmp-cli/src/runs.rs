//! Trajectories on the command line: `FILE`, `topic:/NAME` or `BAG:/NAME`, perhaps behind `NAME=`.

use std::path::{Path, PathBuf};

use dmp::{MapSource, Run, RunSource};
use dmp_log::{
    LogOutline, LogSummary, PoseTopic, ScanLog, TrajectoryFormat, is_bag, read_topic_trajectory,
    read_trajectory_as,
};

use crate::common::Common;
use crate::exit::Usage;
use crate::extrinsic::{self, BodyFromSensor};
use crate::loaded_run::LoadedRun;
use crate::log_args::{LogArgs, LogHead};
use crate::named::{NamedFile, names_of};
use crate::score::announce;
use crate::settings::SettingsArgs;

/// Runs with names. Those in files are read first, so that a mistake in them is told before a long log is
/// read; those in messages when the log is open.
#[derive(Debug)]
pub(crate) struct Runs(Vec<(String, Source)>);

#[derive(Debug)]
enum Source {
    Read(Box<LoadedRun>),
    Topic { given: String, bag: Option<PathBuf>, topic: PoseTopic },
}

impl Runs {
    /// Names the runs and reads those in files, in this format where one is given.
    pub(crate) fn start(files: &[NamedFile], format: Option<TrajectoryFormat>) -> anyhow::Result<Self> {
        let names = names_of(files)?;
        let start = |(name, file): (String, &NamedFile)| -> anyhow::Result<(String, Source)> {
            let given = file.path.display().to_string();
            if let Some((bag, topic)) = topic_of(&file.path)? {
                return Ok((name, Source::Topic { given, bag, topic }));
            }
            let read = read_trajectory_as(&file.path, format)?;
            let run = LoadedRun::of_file(name.clone(), given, &file.path, read);
            Ok((name, Source::Read(Box::new(run))))
        };
        Ok(Self(names.into_iter().zip(files).map(start).collect::<Result<_, _>>()?))
    }

    /// The first run, if any, whose poses are messages of the log itself.
    pub(crate) fn in_log(&self) -> Option<String> {
        let in_log = |(_, source): &&(String, Source)| matches!(source, Source::Topic { bag: None, .. });
        self.0.iter().find(in_log).map(|(name, _)| name.clone())
    }

    pub(crate) fn names(&self) -> Vec<&str> {
        self.0.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// Reads those in messages: of the log itself or of other bags.
    pub(crate) fn finish(self, log: &LogSummary) -> anyhow::Result<Vec<LoadedRun>> {
        self.finish_in(&log.path, log.frame_id.as_deref())
    }

    /// The same for a log at this path, whose scans have this frame.
    pub(crate) fn finish_in(self, log: &Path, scan_frame: Option<&str>) -> anyhow::Result<Vec<LoadedRun>> {
        let finish = |(name, source): (String, Source)| match source {
            Source::Read(run) => Ok(*run),
            Source::Topic { given, bag, topic } => {
                let path = bag.as_deref().unwrap_or(log);
                let read = read_topic_trajectory(path, &topic, scan_frame)?;
                Ok(LoadedRun::of_topic(name, given, path, read, bag.is_some()))
            }
        };
        self.0.into_iter().map(finish).collect()
    }
}

/// The bag (`None`: the log) and the topic that `topic:/odom`, `BAG:/odom`, `BAG:/tf:WORLD:BODY` or `BAG`
/// stand for; `None` for a file with a trajectory.
fn topic_of(path: &Path) -> anyhow::Result<Option<(Option<PathBuf>, PoseTopic)>> {
    let text = path.to_str().unwrap_or_default();
    if let Some(topic) = text.strip_prefix("topic:") {
        return Ok(Some((None, parse_topic(topic)?)));
    }
    if path.exists() {
        // A folder must be a bag: no trajectory is a folder.
        let bag = path.is_dir() || is_bag(path)?;
        return Ok(bag.then(|| (Some(path.to_owned()), PoseTopic::default())));
    }
    for (at, _) in text.match_indices(":/") {
        let bag = Path::new(&text[..at]);
        let named_so = bag.extension().is_some_and(|extension| extension == "mcap" || extension == "db3");
        if named_so || bag.exists() {
            return Ok(Some((Some(bag.to_owned()), parse_topic(&text[at + 1..])?)));
        }
    }
    Ok(None)
}

fn parse_topic(text: &str) -> Result<PoseTopic, Usage> {
    let mut parts = text.split(':').map(str::to_owned);
    let topic = PoseTopic { topic: parts.next(), world: parts.next(), body: parts.next() };
    let named = [&topic.topic, &topic.world, &topic.body].into_iter().flatten().all(|name| !name.is_empty());
    if named && parts.next().is_none() {
        Ok(topic)
    } else {
        Err(Usage(format!("`{text}` is no topic: try topic:/odom or topic:/tf:WORLD:BODY")))
    }
}

/// A log and the runs on it, as they are scored.
pub(crate) struct OpenedRuns<L = Box<dyn ScanLog>> {
    pub(crate) log: L,
    pub(crate) runs: Vec<Run>,
    /// Whether part of the log or of a run is lost; warnings say what.
    pub(crate) damaged: bool,
}

impl OpenedRuns {
    /// Opens the log, finishes the runs and finds where their sensors sat. What was found is told.
    pub(crate) fn open(
        started: Runs,
        maps: impl IntoIterator<Item = MapSource>,
        log: &LogArgs,
        settings: &SettingsArgs,
        common: &Common,
    ) -> anyhow::Result<Self> {
        let log = log.open(&settings.scans.mapper()?)?;
        let (runs, damaged) = finish(started, maps, LogHead::of_log(log.as_ref()), settings, common)?;
        Ok(Self { log, runs, damaged })
    }
}

impl OpenedRuns<LogOutline> {
    /// The same with no more of the log than its index.
    pub(crate) fn outline(
        started: Runs,
        log: &LogArgs,
        settings: &SettingsArgs,
        common: &Common,
    ) -> anyhow::Result<Self> {
        let in_log = started.in_log();
        let log = log.outline(&settings.scans.mapper()?)?;
        if let (Some(run), false) = (in_log, common.quiet) {
            eprintln!(
                "note: the poses of `{run}` are in the log, so all of it is read for them; `dmp convert` writes them to a file"
            );
        }
        let maps = started.0.iter().map(|_| MapSource::Fused).collect::<Vec<_>>();
        let (runs, damaged) = finish(started, maps, LogHead::of_outline(&log), settings, common)?;
        Ok(Self { log, runs, damaged })
    }
}

/// Finishes the runs and finds where their sensors sat; tells too whether part of log or runs is lost.
fn finish(
    started: Runs,
    maps: impl IntoIterator<Item = MapSource>,
    log: LogHead<'_>,
    settings: &SettingsArgs,
    common: &Common,
) -> anyhow::Result<(Vec<Run>, bool)> {
    let loaded = started.finish(log.summary())?;
    if !common.quiet {
        announce::found(log, &loaded);
    }
    let extrinsics = extrinsic::of_runs(&settings.scans.extrinsic, &loaded, log)?;
    if !common.quiet {
        announce::extrinsics(&loaded, &extrinsics);
    }
    let damaged = loaded.iter().any(|run| run.damaged) || !log.summary().damage.is_empty();
    Ok((to_score(loaded, maps, extrinsics), damaged))
}

/// The runs as they are scored.
pub(crate) fn to_score(
    loaded: Vec<LoadedRun>,
    maps: impl IntoIterator<Item = MapSource>,
    extrinsics: Vec<BodyFromSensor>,
) -> Vec<Run> {
    let run = |((run, map), extrinsic): ((LoadedRun, MapSource), BodyFromSensor)| Run {
        name: run.name,
        source: RunSource {
            file: Some(run.given),
            format: Some(run.format.to_owned()),
            body_from_sensor: Some(extrinsic.source),
            notes: run.notes,
        },
        trajectory: run.trajectory,
        map,
        body_from_sensor: Some(extrinsic.transform),
    };
    loaded.into_iter().zip(maps).zip(extrinsics).map(run).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_are_told_from_files() {
        let topic = |topic: &str, world: Option<&str>, body: Option<&str>| PoseTopic {
            topic: Some(topic.into()),
            world: world.map(str::to_owned),
            body: body.map(str::to_owned),
        };
        let of = |text: &str| topic_of(Path::new(text)).unwrap();
        assert_eq!(of("topic:/odom"), Some((None, topic("/odom", None, None))));
        assert_eq!(of("topic:/tf:map:lidar"), Some((None, topic("/tf", Some("map"), Some("lidar")))));
        assert_eq!(of("none/a.mcap:/odom"), Some((Some("none/a.mcap".into()), topic("/odom", None, None))));
        let bag = env!("CARGO_MANIFEST_DIR");
        assert_eq!(of(&format!("{bag}:/tf:map")), Some((Some(bag.into()), topic("/tf", Some("map"), None))));
        assert_eq!(of(bag), Some((Some(bag.into()), PoseTopic::default())));
        for file in ["none.tum", "none/a:/b.tum", "Cargo.toml", "none.mcap"] {
            assert_eq!(of(file), None, "{file}");
        }
        for wrong in ["topic:", "topic:/tf:", "topic:/tf::lidar", "topic:/tf:a:b:c"] {
            let error = topic_of(Path::new(wrong)).unwrap_err().to_string();
            assert!(error.contains("is no topic: try topic:/odom"), "{error}");
        }
    }
}
