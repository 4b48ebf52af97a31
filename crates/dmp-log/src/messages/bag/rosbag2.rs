//! Folders as rosbag2 writes them: `metadata.yaml` and the files it names.

use crate::file::{files_with_extension, first_file, is_file, read_text, shorten, stays_inside};
use crate::{LogError, ParseError, PlaceInFile};
use saphyr_parser::{Event, Parser};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Largest metadata that is read. It has a few lines for a topic and for a file.
const MAX_METADATA_BYTES: u64 = 16 << 20;

/// The files of a bag, in order, and what its metadata names and is not there any more.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct BagFiles {
    pub(super) files: Vec<PathBuf>,
    pub(super) missing: Vec<String>,
}

/// The bag's files in a folder; `None` where there are none.
pub(super) fn files_of(folder: &Path) -> Result<Option<BagFiles>, LogError> {
    let path = folder.join("metadata.yaml");
    if is_file(&path)? {
        return named_files(folder, &path).map(Some);
    }
    let mut files = files_with_extension(folder, "mcap")?;
    files.append(&mut files_with_extension(folder, "db3")?);
    // Beside what it was converted to, it is the same log.
    if files.is_empty() {
        files = files_with_extension(folder, "bag")?;
    }
    match files.len() {
        0 => Ok(None),
        1 => Ok(Some(BagFiles { files, missing: Vec::new() })),
        several => {
            let problem = format!("{several} bags in the folder and no metadata.yaml: name one of them");
            Err(LogError::Option { path: folder.into(), problem })
        }
    }
}

/// The files that the metadata names, one of them there at least.
fn named_files(folder: &Path, path: &Path) -> Result<BagFiles, LogError> {
    let bytes = read_text(path, "metadata", MAX_METADATA_BYTES)?;
    let metadata = parse_metadata(&bytes).map_err(|e| e.in_file(path))?;
    let is_packed_by_file = metadata.compression_mode.eq_ignore_ascii_case("file");
    let packed = |name: &str| {
        let problem = format!(
            "the bag is packed by rosbag2 itself (compression_mode {}): unpack it with `ros2 bag convert`{}",
            shorten(&metadata.compression_mode),
            if is_packed_by_file {
                format!(", or its files with `zstd -d {}`", shorten(name))
            } else {
                String::new()
            }
        );
        LogError::malformed(path, PlaceInFile::WholeFile, problem)
    };
    if !metadata.compression_mode.is_empty() && !is_packed_by_file {
        return Err(packed(""));
    }
    if metadata.files.is_empty() {
        return Err(LogError::malformed(
            path,
            PlaceInFile::WholeFile,
            "it names no files under relative_file_paths",
        ));
    }
    let not_there = |line: u64, name: &str| {
        let problem = format!("the file `{}` that it names is not there", shorten(name));
        LogError::malformed(path, PlaceInFile::Line(line), problem)
    };
    let found = |(line, named): &'_ (u64, String)| -> Result<Result<PathBuf, String>, LogError> {
        // What describes a bag comes from elsewhere: it names no files but the bag's own.
        // Files that were packed may lie there unpacked, under the name without `.zstd`.
        let name = if is_packed_by_file { named.strip_suffix(".zstd").unwrap_or(named) } else { named };
        let inside = Some(name).filter(|name| stays_inside(Path::new(name)));
        // Old versions write the folder's own name in front.
        let file_name = Path::new(name).file_name().unwrap_or_default();
        let places = inside.map(|name| folder.join(name)).into_iter().chain([folder.join(file_name)]);
        let file = first_file(places)?;
        if file.is_none() && (inside.is_none() || is_packed_by_file) {
            return Err(if is_packed_by_file { packed(named) } else { not_there(*line, name) });
        }
        Ok(file.ok_or_else(|| name.to_owned()))
    };
    let mut met = BTreeSet::new();
    for (line, name) in &metadata.files {
        if !met.insert(name) {
            let problem = format!("the file `{}` is named twice", shorten(name));
            return Err(LogError::malformed(path, PlaceInFile::Line(*line), problem));
        }
    }
    let mut bag = BagFiles::default();
    for file in &metadata.files {
        match found(file)? {
            Ok(file) => bag.files.push(file),
            Err(name) => bag.missing.push(name),
        }
    }
    match metadata.files.first().filter(|_| bag.files.is_empty()) {
        Some((line, name)) => Err(not_there(*line, name)),
        None => Ok(bag),
    }
}

#[derive(Debug, Default, PartialEq, Eq)]
struct Metadata {
    /// Line and name of each file, in order.
    files: Vec<(u64, String)>,
    /// `FILE`, `MESSAGE`, or empty.
    compression_mode: String,
}

/// A mapping or list that has begun and not ended.
struct Open {
    /// In a mapping, the key whose value comes next.
    key: Option<String>,
    is_mapping: bool,
}

/// Reads events as they come: aliases are never followed, so that nothing grows beyond the file.
fn parse_metadata(bytes: &[u8]) -> Result<Metadata, ParseError> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        ParseError::new(PlaceInFile::Byte(e.valid_up_to() as u64), "not text, where metadata should be")
    })?;
    let mut metadata = Metadata::default();
    let mut open: Vec<Open> = Vec::new();
    for event in Parser::new_from_str(text) {
        let (event, span) = event
            .map_err(|e| ParseError::new(PlaceInFile::Line(e.marker().line() as u64), shorten(e.info())))?;
        match event {
            Event::MappingStart(..) | Event::SequenceStart(..) => {
                open.push(Open { key: None, is_mapping: matches!(event, Event::MappingStart(..)) });
            }
            Event::MappingEnd | Event::SequenceEnd => {
                open.pop();
                value_is_over(&mut open);
            }
            Event::Alias(_) => value_is_over(&mut open),
            Event::Scalar(value, ..) => {
                if let Some(inner) = open.last_mut().filter(|inner| inner.is_mapping && inner.key.is_none()) {
                    inner.key = Some(value.into_owned());
                    continue;
                }
                // What is used is not deeper; a file may be millions deep.
                if open.len() > 3 {
                    value_is_over(&mut open);
                    continue;
                }
                let keys: Vec<&str> =
                    open.iter().map(|outer| outer.key.as_deref().unwrap_or_default()).collect();
                match keys.as_slice() {
                    ["rosbag2_bagfile_information", "relative_file_paths", ""] => {
                        metadata.files.push((span.start.line() as u64, value.into_owned()));
                    }
                    ["rosbag2_bagfile_information", "compression_mode"] => {
                        metadata.compression_mode = value.into_owned();
                    }
                    _ => {}
                }
                value_is_over(&mut open);
            }
            _ => {}
        }
    }
    Ok(metadata)
}

fn value_is_over(open: &mut [Open]) {
    if let Some(outer) = open.last_mut() {
        outer.key = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// Brackets in brackets, and as many words as they are deep: an answer, and soon.
    #[test]
    fn deep_metadata_is_answered() {
        for (depth, words) in [(100, 100_000), (200_000, 200_000)] {
            let text = format!("a: {}{}{}\n", "[".repeat(depth), "b, ".repeat(words), "]".repeat(depth));
            assert!(
                parse_metadata(text.as_bytes()).is_ok_and(|found| found == Metadata::default())
                    || depth > 100
            );
        }
        let blocks = "- ".repeat(2_000) + "a\n";
        assert!(parse_metadata(blocks.as_bytes()).is_ok_and(|found| found.files.is_empty()));
    }

    #[test]
    fn a_file_named_twice_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let list = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - a.mcap\n    - a.mcap\n";
        fs::write(folder.path().join("metadata.yaml"), list).unwrap();
        fs::write(folder.path().join("a.mcap"), "").unwrap();
        let error = files_of(folder.path()).unwrap_err().to_string();
        assert!(error.ends_with("line 4: the file `a.mcap` is named twice"), "{error}");
    }

    #[test]
    fn no_file_outside_the_folder_is_read() {
        let parent = tempfile::tempdir().unwrap();
        fs::write(parent.path().join("a.mcap"), "").unwrap();
        let folder = parent.path().join("bag");
        fs::create_dir(&folder).unwrap();
        let absolute = parent.path().join("a.mcap");
        for name in ["../a.mcap", absolute.to_str().unwrap()] {
            let list = format!("rosbag2_bagfile_information:\n  relative_file_paths:\n    - '{name}'\n");
            fs::write(folder.join("metadata.yaml"), list).unwrap();
            let error = files_of(&folder).unwrap_err().to_string();
            assert!(error.contains("line 3: the file `") && error.ends_with("is not there"), "{error}");
        }
        fs::write(folder.join("a.mcap"), "").unwrap();
        assert_eq!(files_of(&folder).unwrap().unwrap().files, [folder.join("a.mcap")]);
        // What is gone is named, where something is left.
        let list = "rosbag2_bagfile_information:\n  relative_file_paths: [a.mcap, b.mcap]\n";
        fs::write(folder.join("metadata.yaml"), list).unwrap();
        let expected = BagFiles { files: vec![folder.join("a.mcap")], missing: vec!["b.mcap".to_owned()] };
        assert_eq!(files_of(&folder).unwrap().unwrap(), expected);
    }

    #[test]
    fn the_files_are_those_of_the_list_alone() {
        let text = "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  compression_mode: \"\"\n  \
                    relative_file_paths:\n    - a_0.mcap\n    - 'b 1.mcap'\n  files:\n    - path: c.mcap\n      \
                    relative_file_paths: [no]\nrelative_file_paths: [no]\n";
        let files = [(6, "a_0.mcap".to_owned()), (7, "b 1.mcap".to_owned())];
        let expected = Metadata { files: files.into(), compression_mode: String::new() };
        assert_eq!(parse_metadata(text.as_bytes()), Ok(expected));
    }

    #[test]
    fn what_is_no_yaml_is_named_with_its_line() {
        let error = parse_metadata(b"rosbag2_bagfile_information:\n  version: [1\n").unwrap_err();
        assert!(matches!(error.place, PlaceInFile::Line(2..=4)), "{error}");
        assert_eq!(parse_metadata(b"a\xff").unwrap_err().place, PlaceInFile::Byte(1));
        // A bomb of aliases stays as small as it is written.
        let bomb = "a: &a [x, x]\nb: &b [*a, *a, *a]\nc: &c [*b, *b, *b]\nd: [*c, *c, *c]\n";
        assert_eq!(parse_metadata(bomb.as_bytes()), Ok(Metadata::default()));
    }
}
