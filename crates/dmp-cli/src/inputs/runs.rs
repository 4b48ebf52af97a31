//! Trajectories on the command line: `FILE`, `topic:/NAME` or `BAG:/NAME`, perhaps behind `NAME=`.

use std::path::{Path, PathBuf};

use dmp::PosesAs;
use dmp_log::{
    LogError, LogSummary, PoseTopic, TimeUnit, TrajectoryFormat, has_bag_name, is_bag, poses_at_most,
    read_topic_trajectory, read_trajectory, read_trajectory_as,
};
use dmp_sensor::Trajectory;

use super::loaded_run::LoadedRun;
use crate::console::Usage;
use crate::files::is_missing;
use crate::named::{Named, NamedFile, assign, names_of};
use crate::options::values::Poses;
use crate::options::{Asked, input, output};

/// Runs with names. Those in files are read first, so that a mistake in them is reported before a long log is
/// read; those in messages when the log is open.
#[derive(Debug)]
pub(crate) struct Runs {
    named: Vec<(String, Source)>,
    /// What is known of the poses of each.
    meant: Vec<Meant>,
    /// What carries each between its poses.
    between: Vec<Option<Trajectory>>,
    /// Those whose files hold no trajectory.
    pub(super) unread: Vec<Unread>,
}

/// The name of a run that holds no trajectory, and why.
pub(super) type Unread = (String, LogError);

#[derive(Debug)]
enum Source {
    Read(Box<LoadedRun>),
    Topic { given: String, bag: Option<PathBuf>, topic: PoseTopic },
}

/// What `--poses-as` says of a run.
#[derive(Debug, Clone, Default)]
struct Meant {
    format: Option<TrajectoryFormat>,
    unit: Option<TimeUnit>,
    /// In the order given: each is applied to the result of the one before.
    poses: Vec<PosesAs>,
}

impl Meant {
    /// Whether the file shows its format and unit.
    fn is_open(&self) -> bool {
        self.format.is_none() && self.unit.is_none()
    }

    fn of_runs(given: &[Named<Poses>], names: &[&str]) -> Result<Vec<Self>, Usage> {
        let formats = of_kind(given, names, |poses| match poses {
            Poses::Format(format) => Some(format),
            _ => None,
        })?;
        let units = of_kind(given, names, |poses| match poses {
            Poses::Stamps(unit) => Some(unit),
            _ => None,
        })?;
        let both = formats.into_iter().zip(units);
        let mut all: Vec<Self> =
            both.map(|(format, unit)| Self { format, unit, poses: Vec::new() }).collect();
        for one in given {
            let of_runs = of_kind(std::slice::from_ref(one), names, |poses| match poses {
                Poses::As(poses) => Some(poses),
                _ => None,
            })?;
            all.iter_mut().zip(of_runs).for_each(|(meant, poses)| meant.poses.extend(poses));
        }
        Ok(all)
    }
}

/// The value of a kind that each run has.
fn of_kind<T: Copy>(
    given: &[Named<Poses>],
    names: &[&str],
    kind: impl Fn(Poses) -> Option<T>,
) -> Result<Vec<Option<T>>, Usage> {
    let of_kind =
        given.iter().map(Named::parts).filter_map(|(run, text, poses)| Some((run, text, kind(*poses)?)));
    assign("--poses-as", names, of_kind)
}

/// The trajectory that carries each run between its poses, where one is given.
fn between(asked: &Asked, names: &[&str]) -> anyhow::Result<Vec<Option<Trajectory>>> {
    let given = asked.all(&input::BETWEEN);
    let values = given.iter().map(|file| (file.name.as_deref(), file.path.display().to_string(), &file.path));
    let read = |path: Option<&PathBuf>| path.map(|path| Ok(read_trajectory(path)?.trajectory)).transpose();
    assign("--between", names, values)?.into_iter().map(read).collect()
}

/// Refuses runs in files whose poses need more memory than is given.
fn check_memory(asked: &Asked, files: &[NamedFile]) -> anyhow::Result<()> {
    let paths = files.iter().map(|file| file.path.clone());
    let paths = paths.chain(asked.all(&input::BETWEEN).into_iter().map(|file| file.path));
    let (mut poses, mut longest_bytes) = (0, 0);
    for path in paths.filter(|path| path.is_file()) {
        // A bag is read message by message.
        if !is_bag(&path)? {
            let (of_file, bytes) = poses_at_most(&path)?;
            (poses, longest_bytes) = (poses + of_file, longest_bytes.max(bytes));
        }
    }
    Ok(asked.config().check_poses(poses, longest_bytes)?)
}

impl Runs {
    /// The files or topics of the runs, as they were named.
    pub(crate) fn files(asked: &Asked) -> Vec<NamedFile> {
        [asked.all(&input::RUNS), asked.all(&input::MORE_RUNS)].concat()
    }

    /// Names the runs and reads those in files.
    pub(crate) fn start(asked: &Asked) -> anyhow::Result<Self> {
        let mut runs = Self::start_some(asked)?;
        if runs.unread.is_empty() { Ok(runs) } else { Err(runs.unread.swap_remove(0).1.into()) }
    }

    /// The same for runs that are compared: a file that holds no trajectory does not stop the others, unless it was said what
    /// it holds.
    pub(crate) fn start_some(asked: &Asked) -> anyhow::Result<Self> {
        let files = Self::files(asked);
        let is_json = |file: &&NamedFile| file.path.extension().is_some_and(|end| end == "json");
        if let Some(file) = files.iter().find(is_json).filter(|_| asked.has(&output::JSON)) {
            let path = file.path.display();
            return Err(
                Usage(format!("{path} is taken for a run: --json names no file, write > {path}")).into()
            );
        }
        let names = names_of(&files)?;
        let plain: Vec<&str> = names.iter().map(String::as_str).collect();
        let meant = Meant::of_runs(&asked.all(&input::POSES_AS), &plain)?;
        check_memory(asked, &files)?;
        let between = between(asked, &plain)?;
        let start = |(name, (file, meant)): (String, (&NamedFile, &Meant))| -> anyhow::Result<_> {
            let given = file.path.display().to_string();
            if let Some((bag, topic)) = topic_of(&file.path)? {
                if meant.unit.is_some() {
                    let problem =
                        format!("--poses-as {name}=stamps-…: {given} is a topic, whose unit is known");
                    return Err(Usage(problem).into());
                }
                return Ok((name, Source::Topic { given, bag, topic }));
            }
            let read = read_trajectory_as(&file.path, meant.format, meant.unit)?;
            let run = LoadedRun::of_file(name.clone(), given, &file.path, read);
            Ok((name, Source::Read(Box::new(run))))
        };
        let started: Vec<_> = names.iter().cloned().zip(files.iter().zip(&meant)).map(start).collect();
        let mut runs = Self { named: Vec::new(), meant: Vec::new(), between: Vec::new(), unread: Vec::new() };
        for (((name, started), meant), between) in names.into_iter().zip(started).zip(meant).zip(between) {
            match started {
                Ok(named) => {
                    runs.named.push(named);
                    runs.meant.push(meant);
                    runs.between.push(between);
                }
                Err(problem) if meant.is_open() => runs.unread.push((name, no_trajectory(problem)?)),
                Err(problem) => return Err(problem),
            }
        }
        if runs.named.is_empty() && !runs.unread.is_empty() {
            return Err(runs.unread.swap_remove(0).1.into());
        }
        Ok(runs)
    }

    /// The first run, if any, whose poses are messages of the log itself.
    pub(crate) fn in_log(&self) -> Option<String> {
        let in_log = |(_, source): &&(String, Source)| matches!(source, Source::Topic { bag: None, .. });
        self.named.iter().find(in_log).map(|(name, _)| name.clone())
    }

    /// Their names; last those of which there is no trajectory.
    pub(crate) fn names(&self) -> Vec<&str> {
        let unread = self.unread.iter().map(|(name, _)| name.as_str());
        self.named.iter().map(|(name, _)| name.as_str()).chain(unread).collect()
    }

    /// Reads those in messages: of the log itself or of other bags.
    pub(crate) fn finish(self, log: &LogSummary) -> anyhow::Result<Vec<LoadedRun>> {
        self.finish_in(&log.path, log.frame_id.as_deref())
    }

    /// The same for a log at this path, whose scans have this frame.
    pub(crate) fn finish_in(self, log: &Path, scan_frame: Option<&str>) -> anyhow::Result<Vec<LoadedRun>> {
        self.finish_each(log, scan_frame).map(|(_, run)| run).collect()
    }

    /// The same for runs that are compared: messages that hold no trajectory do not stop the others.
    pub(super) fn finish_some(self, log: &LogSummary) -> anyhow::Result<Vec<Result<LoadedRun, Unread>>> {
        let some = |(name, run): (String, anyhow::Result<LoadedRun>)| match run {
            Ok(run) => Ok(Ok(run)),
            Err(problem) => Ok(Err((name, no_trajectory(problem)?))),
        };
        self.finish_each(&log.path, log.frame_id.as_deref()).map(some).collect()
    }

    fn finish_each(
        self,
        log: &Path,
        scan_frame: Option<&str>,
    ) -> impl Iterator<Item = (String, anyhow::Result<LoadedRun>)> {
        let finish = move |name: String, source, meant: Meant, between: Option<Trajectory>| {
            let mut run = match source {
                Source::Read(run) => *run,
                Source::Topic { given, bag, topic } => {
                    let path = bag.as_deref().unwrap_or(log);
                    let read = read_topic_trajectory(path, &topic, scan_frame)?;
                    LoadedRun::of_topic(name, given, path, read, bag.is_some())
                }
            };
            for poses in meant.poses {
                run = run.read_as(poses)?;
            }
            match between {
                None => Ok(run),
                Some(odometry) => run.carried_by(&odometry),
            }
        };
        let each = self.named.into_iter().zip(self.meant).zip(self.between);
        each.map(move |(((name, source), meant), between)| {
            (name.clone(), finish(name, source, meant, between))
        })
    }
}

/// The problem, if it is that there is no trajectory.
fn no_trajectory(problem: anyhow::Error) -> anyhow::Result<LogError> {
    match problem.downcast()? {
        problem @ (LogError::Malformed { .. } | LogError::Trajectory { .. }) => Ok(problem),
        problem => Err(problem.into()),
    }
}

/// The bag (`None`: the log) and the topic that `topic:/odom`, `BAG:/odom`, `BAG:/tf:WORLD:BODY` or `BAG`
/// stand for; `None` for a file with a trajectory.
fn topic_of(path: &Path) -> anyhow::Result<Option<(Option<PathBuf>, PoseTopic)>> {
    let text = path.to_str().unwrap_or_default();
    if let Some(topic) = text.strip_prefix("topic:") {
        return Ok(Some((None, parse_topic(topic)?)));
    }
    if !is_missing(path) {
        // A folder must be a bag: no trajectory is a folder.
        let bag = path.is_dir() || is_bag(path)?;
        return Ok(bag.then(|| (Some(path.to_owned()), PoseTopic::default())));
    }
    for (at, _) in text.match_indices(":/") {
        let bag = Path::new(&text[..at]);
        if has_bag_name(bag) || bag.exists() {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_are_not_files() {
        let topic = |topic: &str, world: Option<&str>, body: Option<&str>| PoseTopic {
            topic: Some(topic.into()),
            world: world.map(str::to_owned),
            body: body.map(str::to_owned),
        };
        let of = |text: &str| topic_of(Path::new(text)).unwrap();
        assert_eq!(of("topic:/odom"), Some((None, topic("/odom", None, None))));
        assert_eq!(of("topic:/tf:map:lidar"), Some((None, topic("/tf", Some("map"), Some("lidar")))));
        for bag in ["none/a.mcap", "none/a.bag"] {
            assert_eq!(of(&format!("{bag}:/odom")), Some((Some(bag.into()), topic("/odom", None, None))));
        }
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
