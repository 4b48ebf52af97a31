//! Trajectories and maps on the command line: `FILE` or `NAME=FILE`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use dmp::MapSource;
use dmp_log::{LogError, TrajectoryFile, read_trajectory};

use crate::exit::Usage;

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
    pub(crate) path: PathBuf,
    pub(crate) file: TrajectoryFile,
}

/// Names the runs and reads their trajectories.
pub(crate) fn load(files: &[NamedFile]) -> anyhow::Result<Vec<LoadedRun>> {
    let names = names_of(files)?;
    let load = |(name, file): (String, &NamedFile)| {
        Ok(LoadedRun { name, path: file.path.clone(), file: read_trajectory(&file.path)? })
    };
    Ok(names.into_iter().zip(files).map(load).collect::<Result<_, LogError>>()?)
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
pub(crate) fn maps_of(runs: &[LoadedRun], maps: &[NamedFile]) -> anyhow::Result<Vec<MapSource>> {
    if let Some(map) = maps.iter().find(|map| !map.path.exists()) {
        return Err(LogError::NotFound { path: map.path.clone() }.into());
    }
    Ok(assign(runs, maps)?)
}

fn assign(runs: &[LoadedRun], maps: &[NamedFile]) -> Result<Vec<MapSource>, Usage> {
    let mut of_runs: Vec<Option<&Path>> = vec![None; runs.len()];
    let mut of_all = None;
    for map in maps {
        let (place, whose) = match &map.name {
            None => (&mut of_all, "all runs".to_owned()),
            Some(name) => {
                let Some(run) = runs.iter().position(|run| run.name == *name) else {
                    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
                    let names = names.join(", ");
                    return Err(Usage(format!("--map {name}=…: no run has this name; the runs are {names}")));
                };
                (&mut of_runs[run], format!("run `{name}`"))
            }
        };
        if let Some(first) = place.replace(&map.path) {
            return Err(Usage(format!(
                "--map: {} and {} are both given for {whose}",
                first.display(),
                map.path.display()
            )));
        }
    }
    let source = |map: Option<&Path>| map.map_or(MapSource::Fused, |path| MapSource::Given(path.to_owned()));
    Ok(of_runs.into_iter().map(|map| source(map.or(of_all))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_log::TrajectoryFormat;
    use dmp_sensor::{Isometry3, Trajectory};

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
    fn maps_find_their_runs() {
        let run = |name: &str| LoadedRun {
            name: name.into(),
            path: name.into(),
            file: TrajectoryFile {
                format: TrajectoryFormat::Tum,
                trajectory: Trajectory::unstamped(vec![Isometry3::identity()]).unwrap(),
                out_of_order: 0,
                repeated: 0,
                notes: Vec::new(),
                fingerprint: String::new(),
            },
        };
        let runs = [run("a"), run("b")];
        let maps = |texts: &[&str]| {
            let maps: Vec<NamedFile> = texts.iter().map(|text| named(text)).collect();
            assign(&runs, &maps).map_err(|error| error.to_string())
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
