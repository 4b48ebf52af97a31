//! Trajectories and maps on the command line: `FILE`, `topic:/NAME` or `BAG:/NAME`, perhaps behind `NAME=`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use dmp::{MapSource, Run, RunSource};
use dmp_log::{
    LogError, LogSummary, PoseTopic, StaticFrames, TopicTrajectory, TrajectoryFile, TrajectoryFormat, is_bag,
    read_topic_trajectory, read_trajectory_as,
};
use dmp_sensor::Trajectory;

use crate::exit::Usage;
use crate::extrinsic::BodyFromSensor;

/// A file, perhaps with a name for what is in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct NamedFile {
    pub(crate) name: Option<String>,
    pub(crate) path: PathBuf,
}

impl From<OsString> for NamedFile {
    /// What stands before the first `=` is a name, unless it looks like the beginning of a path:
    /// `./a=b.tum` is a file.
    fn from(text: OsString) -> Self {
        match text.to_str().and_then(|text| text.split_once('=')) {
            Some((name, file)) if !name.is_empty() && !file.is_empty() && !name.contains(['/', '\\']) => {
                Self { name: Some(name.to_owned()), path: file.into() }
            }
            _ => Self { name: None, path: text.into() },
        }
    }
}

/// A run's trajectory, read.
#[derive(Debug)]
pub(crate) struct LoadedRun {
    pub(crate) name: String,
    /// Where it is from, as it was given.
    pub(crate) given: String,
    /// The file or bag that it is in.
    pub(crate) path: PathBuf,
    /// The file's format, or the type of the messages.
    pub(crate) format: &'static str,
    pub(crate) trajectory: Trajectory,
    pub(crate) out_of_order: usize,
    pub(crate) repeated: usize,
    /// The frame that moves, where messages name it.
    pub(crate) body_frame: Option<String>,
    /// Those of a bag of its own.
    pub(crate) static_frames: StaticFrames,
    pub(crate) notes: Vec<String>,
    /// Whether part of a bag of its own is lost; the notes say what.
    pub(crate) damaged: bool,
    pub(crate) fingerprint: String,
}

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

impl LoadedRun {
    fn of_file(name: String, given: String, path: &Path, file: TrajectoryFile) -> Self {
        let TrajectoryFile { format, trajectory, out_of_order, repeated, notes, fingerprint } = file;
        Self {
            name,
            given,
            path: path.to_owned(),
            format: format.name(),
            trajectory,
            out_of_order,
            repeated,
            body_frame: None,
            static_frames: StaticFrames::default(),
            notes,
            damaged: false,
            fingerprint,
        }
    }

    fn of_topic(name: String, given: String, path: &Path, read: TopicTrajectory, own_bag: bool) -> Self {
        let mut notes = read.notes;
        if own_bag {
            notes.insert(0, format!("topic {}", read.topic));
            notes.extend(read.damage.iter().map(|lost| format!("lost: {}: {}", lost.place, lost.what)));
        }
        Self {
            name,
            given,
            path: path.to_owned(),
            format: read.message_type,
            trajectory: read.trajectory,
            out_of_order: read.out_of_order,
            repeated: read.repeated,
            body_frame: read.body_frame,
            static_frames: read.static_frames,
            // What of the log itself is lost is told with the log.
            damaged: own_bag && !read.damage.is_empty(),
            notes,
            fingerprint: read.fingerprint,
        }
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

/// The runs' names: those given, else the files' without extension, with the folder in front where that
/// is needed to tell them apart.
fn names_of(files: &[NamedFile]) -> Result<Vec<String>, Usage> {
    let plain: Vec<String> =
        files.iter().map(|file| file.name.clone().unwrap_or_else(|| stem(&file.path))).collect();
    let taken = |k: usize| plain.iter().filter(|name| **name == plain[k]).count() > 1;
    let name = |(k, file): (usize, &NamedFile)| match (&file.name, folder(&file.path)) {
        (None, Some(folder)) if taken(k) => format!("{folder}/{}", plain[k]),
        _ => plain[k].clone(),
    };
    let names: Vec<String> = files.iter().enumerate().map(name).collect();
    for (k, name) in names.iter().enumerate() {
        if let Some(other) = names[..k].iter().position(|other| other == name) {
            return Err(Usage(format!(
                "{} and {}: both runs are called `{name}`; give them names of their own, as NAME=FILE",
                files[other].path.display(),
                files[k].path.display()
            )));
        }
    }
    Ok(names)
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The name of the folder that the file is in.
fn folder(path: &Path) -> Option<String> {
    let absolute = std::path::absolute(path).ok()?;
    Some(absolute.parent()?.file_name()?.to_string_lossy().into_owned())
}

/// Each run's map: the one given for it by name, else the one given for all, else fused from the scans.
///
/// A map that is missing is told here: it would be opened after the scans have been fused.
pub(crate) fn maps_of(runs: &[&str], maps: &[NamedFile]) -> anyhow::Result<Vec<MapSource>> {
    if let Some(map) = maps.iter().find(|map| !map.path.exists()) {
        return Err(LogError::NotFound { path: map.path.clone() }.into());
    }
    Ok(map_sources(runs, maps)?)
}

fn map_sources(runs: &[&str], maps: &[NamedFile]) -> Result<Vec<MapSource>, Usage> {
    let values = maps.iter().map(|map| (map.name.as_deref(), map.path.display().to_string(), &map.path));
    let source = |map: Option<&PathBuf>| map.map_or(MapSource::Fused, |path| MapSource::Given(path.clone()));
    Ok(assign("--map", runs, values)?.into_iter().map(source).collect())
}

/// Gives each run its value of an option `[NAME=]VALUE`: the one given for it by name, else the one given
/// for all. Values come with the run's name and with their text.
pub(crate) fn assign<'a, T: Copy>(
    option: &str,
    runs: &[&str],
    values: impl IntoIterator<Item = (Option<&'a str>, String, T)>,
) -> Result<Vec<Option<T>>, Usage> {
    let mut of_runs: Vec<Option<(String, T)>> = runs.iter().map(|_| None).collect();
    let mut of_all: Option<(String, T)> = None;
    for (name, text, value) in values {
        let (place, whose) = match name {
            None => (&mut of_all, "all runs".to_owned()),
            Some(name) => {
                let Some(run) = runs.iter().position(|run| *run == name) else {
                    let names = runs.join(", ");
                    return Err(Usage(format!(
                        "{option} {name}=…: no run has this name; the runs are {names}"
                    )));
                };
                (&mut of_runs[run], format!("run `{name}`"))
            }
        };
        if let Some((first, _)) = place.replace((text.clone(), value)) {
            return Err(Usage(format!("{option}: {first} and {text} are both given for {whose}")));
        }
    }
    let of_all = of_all.map(|(_, value)| value);
    Ok(of_runs.into_iter().map(|of_run| of_run.map(|(_, value)| value).or(of_all)).collect())
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

    fn named(text: &str) -> NamedFile {
        NamedFile::from(OsString::from(text))
    }

    fn names(texts: &[&str]) -> Result<Vec<String>, String> {
        let files: Vec<NamedFile> = texts.iter().map(|text| named(text)).collect();
        names_of(&files).map_err(|error| error.to_string())
    }

    #[test]
    fn what_stands_before_the_equals_sign_is_a_name() {
        assert_eq!(named("new=a/b.tum"), NamedFile { name: Some("new".into()), path: "a/b.tum".into() });
        assert_eq!(named("new=a=b.tum").path, Path::new("a=b.tum"));
        for path in ["a/b.tum", "./a=b.tum", "runs/x=1/b.tum", "=b.tum", "b="] {
            assert_eq!(named(path), NamedFile { name: None, path: path.into() });
        }
    }

    #[test]
    fn runs_are_called_after_their_files() {
        assert_eq!(names(&["a.tum", "x/b.c.txt", "d=a.tum"]).unwrap(), ["a", "b.c", "d"]);
        assert_eq!(names(&["one/traj.txt", "two/traj.tum", "b"]).unwrap(), ["one/traj", "two/traj", "b"]);
        assert_eq!(names(&["one/traj.txt", "traj=two/t.tum"]).unwrap(), ["one/traj", "traj"]);
    }

    #[test]
    fn two_runs_of_one_name_are_refused() {
        for texts in [["a.tum", "a.tum"], ["x=a.tum", "x=b.tum"], ["1/run/a.tum", "2/run/a.tum"]] {
            let error = names(&texts).unwrap_err();
            assert!(
                error.contains("NAME=FILE") && error.contains(texts[0].trim_start_matches("x=")),
                "{error}"
            );
        }
    }

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

    #[test]
    fn maps_find_their_runs() {
        let runs = ["a", "b"];
        let maps = |texts: &[&str]| {
            let maps: Vec<NamedFile> = texts.iter().map(|text| named(text)).collect();
            map_sources(&runs, &maps).map_err(|error| error.to_string())
        };
        let given = |path: &str| MapSource::Given(path.into());
        assert_eq!(maps(&[]).unwrap(), [MapSource::Fused, MapSource::Fused]);
        assert_eq!(maps(&["all.las"]).unwrap(), [given("all.las"), given("all.las")]);
        assert_eq!(maps(&["b=b.las", "all.las"]).unwrap(), [given("all.las"), given("b.las")]);
        assert_eq!(maps(&["a=a.las"]).unwrap(), [given("a.las"), MapSource::Fused]);
        assert!(maps(&["c=c.las"]).unwrap_err().contains("the runs are a, b"));
        assert!(maps(&["x.las", "y.las"]).unwrap_err().contains("x.las and y.las"));
        assert!(maps(&["a=x.las", "a=y.las"]).unwrap_err().contains("run `a`"));
    }
}
