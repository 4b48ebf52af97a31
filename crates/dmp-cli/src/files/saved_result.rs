//! Reading back what `dmp score --json` printed, or `--keep` kept.

use std::fmt;
use std::io::Read as _;
use std::path::Path;

use anyhow::{Context as _, anyhow, bail};
use dmp::Report;
use dmp_disk::open_input;
use dmp_log::{KeptReader, LogError, is_kept, is_printable, printable};
use serde::Deserialize;
use serde::de::{Deserializer as _, IgnoredAny, MapAccess, Visitor};
use serde_json::{Map, Value};

use super::save::is_missing;
use crate::console::Unreadable;

/// Largest result that is read: 64 MiB hold a hundred and eighty runs with all their pairs.
const MAX_BYTES: u64 = 64 << 20;

/// The one field that every version has.
#[derive(Debug, Deserialize)]
struct Head {
    schema: Option<String>,
}

/// Reads a result. Fields must be those of this version: a number that is not there must not pass for null.
pub(crate) fn read_result(path: &Path) -> anyhow::Result<Report> {
    Ok(read_with_returns(path)?.0)
}

/// The same, and its returns where they were kept.
pub(crate) fn read_with_returns(path: &Path) -> anyhow::Result<(Report, Option<KeptReader>)> {
    if is_missing(path) {
        return Err(LogError::NotFound { path: path.to_path_buf() }.into());
    }
    let (json, returns) = if is_kept(path).is_ok_and(|kept| kept) {
        let (reader, json) = KeptReader::open(path)?;
        (Ok(json), Some(reader))
    } else {
        (json_of(path), None)
    };
    let report = json.and_then(checked_length).and_then(|json| report(&json)).map_err(Unreadable);
    Ok((report.with_context(|| path.display().to_string())?, returns))
}

fn json_of(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let file = open_input(path).context("cannot open")?;
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).context("cannot read")?;
    Ok(bytes)
}

fn checked_length(json: Vec<u8>) -> anyhow::Result<Vec<u8>> {
    if json.len() as u64 > MAX_BYTES {
        bail!("more than {MAX_BYTES} bytes are no result of `dmp score --json`");
    }
    Ok(json)
}

fn report(bytes: &[u8]) -> anyhow::Result<Report> {
    // The schema first, without keeping anything else: the file may be whatever.
    let head: Head = serde_json::from_slice(bytes).map_err(|error| unreadable(&error))?;
    match head.schema.as_deref() {
        Some(Report::SCHEMA) => {}
        Some(other) => bail!("schema `{other}`: a result of `dmp score --json` has `{}`", Report::SCHEMA),
        None => bail!("no result of `dmp score --json`: it has no `schema`"),
    }
    // Then only what a result has: whatever else it is, as a tree it may need a hundred times the memory.
    let report: Report = serde_json::from_slice(bytes).map_err(|error| {
        // The rest lists every possible field, and the position.
        let error = error.to_string();
        let problem = error.split(", expected").next().and_then(|error| error.split(" at line ").next());
        other_version(problem.unwrap_or(&error))
    })?;
    for name in report.runs.iter().map(|run| &run.name) {
        if name.chars().any(|c| !is_printable(c)) {
            bail!("the run `{}` has characters in its name that are none to print", printable(name));
        }
    }
    let scales = report.config.scales;
    for run in &report.runs {
        let all =
            [(&run.r_cv_m2, &scales.lengths().cv_m[1..]), (&run.r_near_m2, &scales.lengths().near_m[..])];
        if all.iter().any(|(scores, scales_m)| !scores.iter().map(|(m, _)| m).eq(scales_m.iter().copied())) {
            bail!("the truncations of `{}` are not those of its `config.scales`", run.name);
        }
    }
    let Value::Object(whole) = serde_json::to_value(&report)? else {
        bail!("no result of `dmp score --json`")
    };
    let json = serde_json::Deserializer::from_slice(bytes).deserialize_map(FieldsOf(&whole));
    let json = json.map_err(|error| unreadable(&error))?;
    match missing(&Value::Object(whole), &Value::Object(json)) {
        Some(field) => Err(other_version(&format!("missing field `{field}`"))),
        None => Ok(report),
    }
}

/// Reads these fields alone: what else stands beside them may be anything.
struct FieldsOf<'a>(&'a Map<String, Value>);

impl<'de> Visitor<'de> for FieldsOf<'_> {
    type Value = Map<String, Value>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a result")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<Self::Value, A::Error> {
        let mut found = Map::new();
        while let Some(field) = fields.next_key::<String>()? {
            if self.0.contains_key(&field) {
                found.insert(field, fields.next_value()?);
            } else {
                fields.next_value::<IgnoredAny>()?;
            }
        }
        Ok(found)
    }
}

fn unreadable(error: &serde_json::Error) -> anyhow::Error {
    // What is expected is a word of this program.
    let error = error.to_string();
    let problem = error.split(", expected struct").next().unwrap_or(&error);
    anyhow!("no result of `dmp score --json`: {problem}")
}

fn other_version(problem: &str) -> anyhow::Error {
    let version = env!("CARGO_PKG_VERSION");
    anyhow!("{problem}: not made by this build of dmp {version}; score again")
}

/// The first field of `whole` that `read` does not have, as a path.
fn missing(whole: &Value, read: &Value) -> Option<String> {
    match (whole, read) {
        (Value::Object(whole), Value::Object(read)) => whole.iter().find_map(|(field, value)| {
            let Some(there) = read.get(field) else { return Some(field.clone()) };
            let below = missing(value, there)?;
            Some(if below.starts_with('[') { format!("{field}{below}") } else { format!("{field}.{below}") })
        }),
        (Value::Array(whole), Value::Array(read)) => {
            whole.iter().zip(read).enumerate().find_map(|(k, (value, there))| {
                let below = missing(value, there)?;
                Some(if below.starts_with('[') { format!("[{k}]{below}") } else { format!("[{k}].{below}") })
            })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example_reports;
    use serde_json::json;

    type Change<'a> = &'a dyn Fn(&mut Value);

    /// What reading this text says.
    fn read(text: &str) -> Result<Report, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        std::fs::write(&path, text).unwrap();
        read_result(&path).map_err(|error| {
            let line = crate::console::one_line(&error);
            line.strip_prefix(&format!("{}: ", path.display())).unwrap().to_owned()
        })
    }

    #[test]
    fn a_result_is_read_back_to_the_same_bits() {
        for mut report in
            [example_reports::three_runs(), example_reports::given_maps(), example_reports::one_run()]
        {
            // Digits that a careless reader rounds.
            report.runs[0].dmp_sum_m2 = 435_916.875_780_088_65;
            report.config.voxel_filled_share = Some(0.1 + 0.2);
            assert_eq!(read(&serde_json::to_string_pretty(&report).unwrap()).unwrap(), report);
        }
    }

    #[test]
    fn another_file_or_version_is_refused() {
        let report = || serde_json::to_value(example_reports::three_runs()).unwrap();
        let changed = |change: Change<'_>| {
            let mut report = report();
            change(&mut report);
            read(&report.to_string()).unwrap_err()
        };
        let remove =
            |value: &mut Value, field: &str| assert!(value.as_object_mut().unwrap().remove(field).is_some());
        let version = "not made by this build of dmp";
        let cases: [(Change<'_>, &str); 8] = [
            (
                &|json| json["schema"] = "dmp-score/1".into(),
                "schema `dmp-score/1`: a result of `dmp score --json` has `dmp-score/3`",
            ),
            (&|json| remove(json, "schema"), "no result of `dmp score --json`: it has no `schema`"),
            (&|json| remove(json, "sampling"), "missing field `sampling`: "),
            (&|json| remove(json, "order"), "missing field `order`: "),
            (&|json| remove(&mut json["runs"][1], "coverage"), "missing field `runs[1].coverage`: "),
            (
                &|json| remove(&mut json["pairs"][0]["scales"][2], "interval_m2"),
                "missing field `pairs[0].scales[2].interval_m2`: ",
            ),
            (&|json| json["runs"][0]["new"] = json!(1), "unknown field `new`: "),
            (&|json| json["order"] = json!(3), "invalid type: integer `3`"),
        ];
        for (k, (change, expected)) in cases.into_iter().enumerate() {
            let error = changed(change);
            assert!(error.starts_with(expected), "{error}");
            assert!(k < 2 || error.contains(version), "{error}");
            assert!(!error.contains('\n') && error.len() < 200, "{error}");
        }
        assert!(
            read("scores")
                .unwrap_err()
                .starts_with("no result of `dmp score --json`: expected value at line 1 column 1")
        );
        assert!(read("").unwrap_err().contains("EOF"));
        assert!(read("[1, 2]").unwrap_err().starts_with("no result of `dmp score --json`: "));
        let cut = report().to_string();
        assert!(read(&cut[..cut.len() / 2]).unwrap_err().contains("EOF while parsing"));
    }
}
