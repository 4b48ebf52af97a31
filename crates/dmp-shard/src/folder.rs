//! The files of parts in the folder of their plan.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use dmp_disk::{file_names, read_checked, write_checked};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::error::ShardError;
use super::part::Part;
use super::stage::Stage;

/// The header of a part's file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Head {
    plan: String,
    stage: Stage,
    part: Part,
}

impl fmt::Display for Head {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} of plan {}", self.stage, self.part, self.plan)
    }
}

/// The folder of a plan's parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlanFolder<'a> {
    pub(super) path: &'a Path,
    /// The hash of the plan.
    pub(super) plan: &'a str,
}

/// The common stem of a part's file names.
pub(super) fn stem_of(stage: Stage, part: Part) -> String {
    format!("{stage}-{}-of-{}", part.number(), part.of())
}

/// The name of the receipt file, which marks a part as done and has its result.
pub(super) fn receipt_name(stage: Stage, part: Part) -> String {
    format!("{}.part", stem_of(stage, part))
}

fn part_of(name: &str, stage: Stage) -> Option<Part> {
    let numbers = name.strip_prefix(stage.name())?.strip_prefix('-')?.strip_suffix(".part")?;
    let (number, of) = numbers.split_once("-of-")?;
    Part::new(number.parse().ok()?, of.parse().ok()?)
}

impl PlanFolder<'_> {
    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    fn head(&self, stage: Stage, part: Part) -> Head {
        Head { plan: self.plan.to_owned(), stage, part }
    }

    /// Writes the receipt of a part, after all its other files.
    pub(super) fn write(
        &self,
        stage: Stage,
        part: Part,
        content: &impl Serialize,
    ) -> Result<PathBuf, ShardError> {
        let path = self.file(&receipt_name(stage, part));
        let bytes = postcard::to_allocvec(&(self.head(stage, part), content))
            .map_err(|error| ShardError::Content { path: path.clone(), detail: error.to_string() })?;
        write_checked(&path, &bytes)?;
        Ok(path)
    }

    /// The finished parts of a stage, by the number of parts.
    fn done(&self, stage: Stage) -> Result<BTreeMap<u32, Vec<Part>>, ShardError> {
        let mut done: BTreeMap<u32, Vec<Part>> = BTreeMap::new();
        for part in file_names(self.path)?.iter().filter_map(|name| part_of(name, stage)) {
            done.entry(part.of()).or_default().push(part);
        }
        done.values_mut().for_each(|parts| parts.sort_unstable());
        Ok(done)
    }

    /// The results of all parts of a stage, in their order. If a stage was done in several numbers of parts,
    /// the fewest parts are read: the results are equal.
    pub(super) fn read<C: DeserializeOwned>(&self, stage: Stage) -> Result<Vec<(Part, C)>, ShardError> {
        let done = self.done(stage)?;
        let Some(parts) = done.iter().find(|(of, parts)| parts.len() as u32 == **of).map(|(_, parts)| parts)
        else {
            let missing = missing_in_words(&done);
            return Err(ShardError::Missing { folder: self.path.to_owned(), stage, missing });
        };
        parts.iter().map(|&part| Ok((part, self.read_part(stage, part)?))).collect()
    }

    fn read_part<C: DeserializeOwned>(&self, stage: Stage, part: Part) -> Result<C, ShardError> {
        let path = self.file(&receipt_name(stage, part));
        let Some(bytes) = read_checked(&path)? else {
            let missing = format!("part {part} was removed");
            return Err(ShardError::Missing { folder: self.path.to_owned(), stage, missing });
        };
        let content =
            |error: postcard::Error| ShardError::Content { path: path.clone(), detail: error.to_string() };
        let (head, rest): (Head, &[u8]) = postcard::take_from_bytes(&bytes).map_err(content)?;
        let expected = self.head(stage, part);
        if head != expected {
            let (found, expected) = (head.to_string(), expected.to_string());
            return Err(ShardError::OtherPart { path, found, expected });
        }
        postcard::from_bytes(rest).map_err(content)
    }
}

/// The missing parts of a stage, for the partition with most parts done.
fn missing_in_words(done: &BTreeMap<u32, Vec<Part>>) -> String {
    let share = |(of, parts): &(&u32, &Vec<Part>)| parts.len() as f64 / f64::from(**of);
    let Some((&of, parts)) = done.iter().max_by(|a, b| share(a).total_cmp(&share(b))) else {
        return "all parts are missing".to_owned();
    };
    let missing: Vec<String> = (1..=of)
        .filter_map(|number| Part::new(number, of))
        .filter(|part| parts.binary_search(part).is_err())
        .map(|part| part.to_string())
        .collect();
    let named = missing.iter().take(8).cloned().collect::<Vec<_>>().join(", ");
    match missing.len() {
        1 => format!("part {named} is missing"),
        count @ 2..=8 => format!("{count} parts are missing: {named}"),
        count => format!("{count} parts are missing: {named}, …"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(text: &str) -> Part {
        text.parse().unwrap()
    }

    #[test]
    fn all_parts_of_a_stage_are_read_and_none_of_another_plan() {
        let folder = tempfile::tempdir().unwrap();
        let plan = PlanFolder { path: folder.path(), plan: "abc" };
        let read = |stage| plan.read::<u32>(stage).map_err(|error| error.to_string());
        assert!(read(Stage::Cast).unwrap_err().ends_with(": cast is not done: all parts are missing"));
        plan.write(Stage::Cast, part("2/3"), &22_u32).unwrap();
        plan.write(Stage::Cast, part("3/3"), &33_u32).unwrap();
        plan.write(Stage::Fuse, part("1/3"), &77_u32).unwrap();
        assert!(read(Stage::Cast).unwrap_err().ends_with(": cast is not done: part 1/3 is missing"));
        plan.write(Stage::Cast, part("1/3"), &11_u32).unwrap();
        let all = Ok(vec![(part("1/3"), 11), (part("2/3"), 22), (part("3/3"), 33)]);
        assert_eq!(read(Stage::Cast), all);
        // Other partitions change nothing.
        plan.write(Stage::Cast, part("1/7"), &99_u32).unwrap();
        assert_eq!(read(Stage::Cast), all);

        let path = plan.file("cast-1-of-3.part");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
        assert!(read(Stage::Cast).unwrap_err().contains("cast-1-of-3.part: damaged in its content"));
        std::fs::copy(plan.file("cast-2-of-3.part"), &path).unwrap();
        let error = read(Stage::Cast).unwrap_err();
        assert!(error.ends_with("found cast 2/3 of plan abc, expected cast 1/3 of plan abc"), "{error}");
        let other = PlanFolder { plan: "xyz", ..plan };
        other.write(Stage::Cast, part("1/3"), &11_u32).unwrap();
        let error = read(Stage::Cast).unwrap_err();
        assert!(error.ends_with("found cast 1/3 of plan xyz, expected cast 1/3 of plan abc"), "{error}");
    }
}
