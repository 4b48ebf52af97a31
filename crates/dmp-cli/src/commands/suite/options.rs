//! Options of a suite as arguments of `dmp score`.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::file::At;
use super::paths::resolve;
use crate::commands::score;
use crate::console::{Failure, Usage};
use crate::options::{Asked, Entry, Facts, Role, input};

/// An argument, and what of it belongs to the settings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Argument {
    /// As the command takes it.
    pub(super) text: String,
    /// The same without the path of a file.
    pub(super) setting: String,
    /// That file: what it holds belongs to the settings.
    pub(super) file: Option<PathBuf>,
}

/// `dmp score` with these arguments.
pub(super) fn parsed(arguments: &[String]) -> Result<Asked, String> {
    let all = std::iter::once("dmp score").chain(arguments.iter().map(String::as_str));
    let matches = score::SPEC.clap().try_get_matches_from(all);
    matches.map(|matches| score::SPEC.called(matches)).map_err(|error| Failure::refused(&error).line)
}

/// Whether a suite takes an option: it changes what is scored, and neither is what the suite itself says nor of one log alone.
fn is_of_suite(facts: &Facts) -> bool {
    let of_suite = facts.name == input::RUNS.name;
    facts.group.changes_scores() && !of_suite
}

/// The options of a table, for a log with runs of these versions.
pub(super) struct Options<'a> {
    /// All versions, and those with a run on this log.
    pub(super) versions: &'a [String],
    pub(super) present: &'a [&'a str],
    pub(super) folder: &'a Path,
    pub(super) log: &'a str,
}

impl Options<'_> {
    /// The arguments, in the order of their names: how the file has them makes no difference.
    pub(super) fn arguments(&self, at: &At<'_>, table: &Table) -> Result<Vec<Argument>, Usage> {
        let mut found = Vec::new();
        for (key, value) in table {
            let at = at.below(key);
            let option = Self::option(&at, key, value)?;
            let values = self.values(&at, &option, value)?;
            found.extend(values.into_iter().map(|value| self.argument(&option, value)));
        }
        found.sort_by(|a, b| a.text.split('=').next().cmp(&b.text.split('=').next()));
        Ok(found)
    }

    fn option(at: &At<'_>, key: &str, value: &Value) -> Result<Facts, Usage> {
        let name = key.replace('_', "-");
        let mut known = score::SPEC.entries().map(Entry::facts).filter(|facts| !facts.is_argument);
        match known.find(|facts| facts.name == name) {
            Some(facts) if is_of_suite(&facts) => Ok(facts),
            Some(_) => Err(at.wrong(value, "a suite does not take this option of `dmp score`")),
            None => Err(at.wrong(value, "`dmp score` has no such option, or a suite does not take it")),
        }
    }

    /// Each value, as it follows the option's `=`, behind the version that it is for; `None` of a switch.
    fn values(&self, at: &At<'_>, option: &Facts, value: &Value) -> Result<Vec<Option<String>>, Usage> {
        let Facts { is_switch, may_be_alone, .. } = *option;
        match value {
            Value::Boolean(false) if is_switch || may_be_alone => Ok(Vec::new()),
            Value::Boolean(true) if is_switch || may_be_alone => Ok(vec![None]),
            _ if is_switch => Err(at.wrong(value, "true or false is expected")),
            Value::Table(table) => {
                let mut values = Vec::new();
                for (version, value) in table {
                    if !self.versions.contains(version) {
                        let why = format!("`{version}` is none of the versions {}", self.versions.join(", "));
                        return Err(at.wrong(value, &why));
                    }
                    if self.present.contains(&version.as_str()) {
                        let texts = self.texts(&at.below(version), value)?;
                        values.extend(texts.into_iter().map(|text| Some(format!("{version}={text}"))));
                    }
                }
                Ok(values)
            }
            _ => Ok(self.texts(at, value)?.into_iter().map(Some).collect()),
        }
    }

    /// One text, or several: a list of numbers is one.
    fn texts(&self, at: &At<'_>, value: &Value) -> Result<Vec<String>, Usage> {
        let one = |value: &Value| match value {
            Value::String(text) => Ok(text.replace("{log}", self.log)),
            Value::Integer(_) | Value::Float(_) => Ok(value.to_string()),
            other => Err(at.wrong(other, "a text or a number is expected")),
        };
        match value {
            Value::Array(values) => {
                let texts = values.iter().map(one).collect::<Result<Vec<_>, _>>()?;
                let are_numbers = values.iter().all(|value| value.is_integer() || value.is_float());
                Ok(if are_numbers { vec![texts.join(",")] } else { texts })
            }
            value => Ok(vec![one(value)?]),
        }
    }

    fn argument(&self, option: &Facts, value: Option<String>) -> Argument {
        let name = option.name;
        let Some(value) = value else {
            let text = format!("--{name}");
            return Argument { setting: text.clone(), text, file: None };
        };
        let (version, path) = match value.split_once('=') {
            Some((version, path)) if self.present.contains(&version) => (format!("{version}="), path),
            _ => (String::new(), value.as_str()),
        };
        let in_file = |before: &str, path: &str| {
            let file = resolve(self.folder, path);
            let setting = format!("--{name}={version}{before}");
            Argument { text: format!("{setting}{file}"), setting, file: Some(file.into()) }
        };
        match path.strip_prefix("calib:") {
            Some(path) if name == input::EXTRINSIC.name => in_file("calib:", path),
            _ if option.role == Role::Read => in_file("", path),
            _ => {
                let text = format!("--{name}={value}");
                Argument { setting: text.clone(), text, file: None }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<Vec<String>, String> {
        let versions = ["a".to_owned(), "b".to_owned()];
        let options =
            Options { versions: &versions, present: &["b"], folder: Path::new("/w"), log: "campus" };
        let table: Table = toml::from_str(text).unwrap();
        let found = options.arguments(&At::new(Path::new("s.toml"), "score"), &table);
        let arguments = found.map_err(|error| error.to_string())?;
        Ok(arguments.into_iter().map(|argument| argument.text).collect())
    }

    #[test]
    fn values_are_arguments() {
        let text = "voxel = 0.2\nmax_range = \"60 m\"\nmend = true\ntrust = false\nextrinsic = [0, 0, 0.28, 0, 0, 0, 1]\n\
                    pose_at = { a = \"end\", b = \"start\" }\nbetween = { b = \"odo/{log}.tum\" }\ndrift = true";
        let expected = [
            "--between=b=/w/odo/campus.tum",
            "--drift",
            "--extrinsic=0,0,0.28,0,0,0,1",
            "--max-range=60 m",
            "--mend",
            "--pose-at=b=start",
            "--voxel=0.2",
        ];
        assert_eq!(of(text).unwrap(), expected);
        assert_eq!(of("extrinsic = \"calib:k/calib.txt\"").unwrap(), ["--extrinsic=calib:/w/k/calib.txt"]);
        assert_eq!(
            of("poses_as = [\"inverted\", \"mm\"]").unwrap(),
            ["--poses-as=inverted", "--poses-as=mm"]
        );
    }

    #[test]
    fn options_that_a_suite_does_not_take_are_refused() {
        for (text, part) in [
            ("voxl = 0.2", "s.toml: score.voxl = 0.2: `dmp score` has no such option"),
            ("json = true", "s.toml: score.json = true: a suite does not take this option of `dmp score`"),
            ("memory = \"1GiB\"", "a suite does not take this option"),
            ("expect = \"best:a\"", "or a suite does not take it"),
            ("trajectory = \"a\"", "a suite does not take this option"),
            ("mend = 3", "s.toml: score.mend = 3: true or false is expected"),
            ("voxel = 1979-05-27", "a text or a number is expected"),
            ("pose_at = { c = \"end\" }", "`c` is none of the versions a, b"),
        ] {
            let error = of(text).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn what_the_parser_says_is_one_line() {
        let error = parsed(&["--voxel=x".into(), "--trajectory=a.tum".into(), "l.mcap".into()]).unwrap_err();
        assert!(error.starts_with("invalid value 'x' for '--voxel") && !error.contains('\n'), "{error}");
    }
}
