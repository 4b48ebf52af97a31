//! Options for one run or for all: `FILE` or `NAME=FILE`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use dmp::MapSource;
use dmp_log::LogError;

use crate::console::Usage;
use crate::files::is_missing;

/// A file, perhaps with a name for what is in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct NamedFile {
    pub(crate) name: Option<String>,
    pub(crate) path: PathBuf,
}

/// A value of one run or of all: `[NAME=]VALUE`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Named<T> {
    run: Option<String>,
    value: T,
    text: String,
}

impl<T> Named<T> {
    /// As [`assign`] takes it.
    pub(crate) fn parts(&self) -> (Option<&str>, String, &T) {
        (self.run.as_deref(), self.text.clone(), &self.value)
    }
}

impl<T: FromStr> FromStr for Named<T> {
    type Err = T::Err;

    fn from_str(text: &str) -> Result<Self, T::Err> {
        // A file of `calib:FILE` may have such a sign in its name; a run may be called like its topic.
        let is_value = text.starts_with("calib:") || text.starts_with("frame:");
        let (run, value) = match text.split_once('=') {
            Some((name, value)) if !name.is_empty() && !is_value => (Some(name), value),
            _ => (None, text),
        };
        Ok(Self { run: run.map(str::to_owned), value: value.parse()?, text: value.to_owned() })
    }
}

impl From<OsString> for NamedFile {
    /// What stands before the first `=` is a name, unless it looks like the beginning of a path:
    /// `./a=b.tum` is a file.
    fn from(text: OsString) -> Self {
        match text.to_str().and_then(|text| text.split_once('=')) {
            Some((name, file)) if !name.is_empty() && !file.is_empty() && !name.contains(['/', '\\']) => {
                Self { name: Some(name.to_owned()), path: at_home(file.into()) }
            }
            _ => Self { name: None, path: at_home(text.into()) },
        }
    }
}

/// `~/FILE` in the user's folder: a shell leaves it alone behind `NAME=`.
pub(crate) fn at_home(path: PathBuf) -> PathBuf {
    match (path.strip_prefix("~"), std::env::home_dir()) {
        (Ok(rest), Some(home)) if !path.exists() => home.join(rest),
        _ => path,
    }
}

/// The runs' names: those given, else the files' without extension, with the folder in front where that
/// is needed to make them different.
pub(crate) fn names_of(files: &[NamedFile]) -> Result<Vec<String>, Usage> {
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
                "{} and {}: both runs are named `{name}`; give each its own name, as NAME=FILE",
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
/// A map that is missing is reported here: it would be opened after the scans have been fused.
pub(crate) fn maps_of(runs: &[&str], maps: &[NamedFile]) -> anyhow::Result<Vec<MapSource>> {
    if let Some(map) = maps.iter().find(|map| is_missing(&map.path)) {
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
        let home = std::env::home_dir().unwrap();
        assert_eq!(named("new=~/b.tum"), NamedFile { name: Some("new".into()), path: home.join("b.tum") });
        assert_eq!(named("~/b.tum").path, home.join("b.tum"));
        assert_eq!(named("~b.tum").path, Path::new("~b.tum"));
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
