//! What is written must not take the place of what is read, nor of other things that are written.
//!
//! One guard for every command, before it does anything: what is written is named by the options of [`OUTPUTS`]; every other
//! argument that leads to a file is taken to be read.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use clap::{ArgMatches, Command};
use dmp_disk::folder_of;

use crate::exit::Usage;
use crate::named::NamedFile;
use crate::save::is_missing;

/// The options that name what is written, whatever the command.
const OUTPUTS: [&str; 13] = [
    "junit",
    "output",
    "per_frame",
    "per_tile",
    "plots",
    "report",
    "residuals",
    "save_graph",
    "save_maps",
    "save_results",
    "save_trajectory",
    "save_truth",
    "svg",
];
/// What folders of scans, of images and of bags are made of.
const OF_LOGS: [&str; 18] = [
    "bin", "npy", "pcd", "ply", "las", "laz", "mcap", "db3", "png", "txt", "csv", "tum", "yaml", "yml",
    "json", "f32", "g2o", "dmpmap",
];

/// Refuses outputs of a command in the place of its inputs and of each other.
pub(crate) fn check(command: &Command, matches: &ArgMatches) -> anyhow::Result<()> {
    if let Some((name, matches)) = matches.subcommand() {
        return command.find_subcommand(name).map_or(Ok(()), |command| check(command, matches));
    }
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    for argument in command.get_arguments() {
        let id = argument.get_id().as_str();
        let Ok(Some(values)) = matches.try_get_raw(id) else { continue };
        if OUTPUTS.contains(&id) {
            outputs.extend(values.map(|value| NamedFile::from(value.to_owned()).path));
        } else if id != "work" {
            inputs.extend(values.flat_map(files_of));
        }
    }
    refuse_clashes(&outputs, &inputs)
}

/// Refuses an output in the place of an input or of another output.
pub(crate) fn refuse_clashes(
    outputs: &[impl AsRef<Path>],
    inputs: &[impl AsRef<Path>],
) -> anyhow::Result<()> {
    for (number, output) in outputs.iter().map(AsRef::as_ref).enumerate() {
        inputs.iter().try_for_each(|input| refuse_same(input.as_ref(), output))?;
        let is_folder = output.is_dir();
        if outputs[..number].iter().any(|other| !is_folder && is_same_place(other.as_ref(), output)) {
            bail!(Usage(format!("{}: two outputs would have this name", output.display())));
        }
    }
    Ok(())
}

/// Refuses an output that is its own input, or a file of a folder that is read.
pub(crate) fn refuse_same(input: &Path, output: &Path) -> anyhow::Result<()> {
    let refused = |why: &str| bail!(Usage(format!("{}: the output would {why}", output.display())));
    let (Some(read), Some(there)) = (look(input)?, look(output)?) else { return Ok(()) };
    if read.is_file() && there.is_file() && is_same_file(input, output) {
        return refused(&format!("take the place of the input {}", input.display()));
    }
    let of_logs = output
        .extension()
        .and_then(OsStr::to_str)
        .is_some_and(|extension| OF_LOGS.iter().any(|known| extension.eq_ignore_ascii_case(known)));
    let is_inside = || match (input.canonicalize(), output.canonicalize()) {
        (Ok(input), Ok(output)) => output.starts_with(input),
        _ => false,
    };
    if read.is_dir() && there.is_file() && of_logs && is_inside() {
        return refused(&format!(
            "replace a file of the input {}; remove it first if it is none",
            input.display()
        ));
    }
    Ok(())
}

/// What is at a path, if anything. What cannot be looked at may be anything, so nothing takes its place.
fn look(path: &Path) -> anyhow::Result<Option<fs::Metadata>> {
    use ErrorKind::{InvalidFilename, InvalidInput, NotADirectory, NotFound};
    match fs::metadata(path) {
        Ok(found) => Ok(Some(found)),
        // Many values are no paths at all.
        Err(error) if matches!(error.kind(), NotFound | NotADirectory | InvalidFilename | InvalidInput) => {
            Ok(None)
        }
        Err(error) => Err(error).with_context(|| path.display().to_string()),
    }
}

/// The files that a value may stand for: `FILE`, `NAME=FILE`, `calib:FILE`, `BAG:/topic`.
fn files_of(value: &OsStr) -> Vec<PathBuf> {
    let mut texts = vec![value.to_owned(), NamedFile::from(value.to_owned()).path.into_os_string()];
    for text in texts.clone() {
        let Some(text) = text.to_str() else { continue };
        texts.extend(text.find(":/").map(|at| OsString::from(&text[..at])));
        texts.extend(text.split_once(':').map(|(_, file)| OsString::from(file)));
    }
    texts.into_iter().map(PathBuf::from).filter(|path| !is_missing(path)).collect()
}

/// Whether two outputs come to lie in one place, whether it is there yet or not.
fn is_same_place(a: &Path, b: &Path) -> bool {
    if a.exists() && b.exists() {
        // Devices and pipes take as much as one likes.
        return a.is_file() && is_same_file(a, b);
    }
    let place = |path: &Path| {
        let folder = folder_of(path);
        let name = path.file_name()?.to_string_lossy().into_owned();
        // Where disks do not tell them apart.
        let folds = cfg!(any(windows, target_os = "macos"));
        let name = if folds { name.to_lowercase() } else { name };
        Some((folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf()), name))
    };
    a == b || place(a).is_some_and(|a| Some(a) == place(b))
}

/// Whether two paths lead to one file, by whatever links and names.
#[cfg(unix)]
fn is_same_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let of = |path: &Path| fs::metadata(path).ok().map(|found| (found.dev(), found.ino()));
    of(a).is_some_and(|a| Some(a) == of(b))
}

#[cfg(not(unix))]
fn is_same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

#[cfg(test)]
mod tests {
    use std::any::TypeId;
    use std::collections::BTreeSet;

    use clap::Arg;

    use super::*;

    /// Whoever adds an option with a path decides here whether it is written to.
    #[test]
    fn every_path_is_read_or_written() {
        fn paths(command: &Command, found: &mut BTreeSet<String>) {
            let is_path = |argument: &&Arg| {
                let parser = argument.get_value_parser().type_id();
                parser == TypeId::of::<PathBuf>() || parser == TypeId::of::<NamedFile>()
            };
            found.extend(
                command.get_arguments().filter(is_path).map(|argument| argument.get_id().to_string()),
            );
            command.get_subcommands().for_each(|command| paths(command, found));
        }
        let mut found = BTreeSet::new();
        paths(&crate::command(), &mut found);
        let read = [
            "align",
            "between",
            "candidates",
            "files",
            "graph",
            "keyframes",
            "like",
            "log",
            "made_with",
            "map",
            "maps",
            "more",
            "reference",
            "reference_map",
            "results",
            "run",
            "trajectories",
            "trajectory",
            "truth",
            "work",
        ];
        let known: BTreeSet<String> = OUTPUTS.iter().chain(&read).map(|&id| id.to_owned()).collect();
        assert_eq!(found, known);
    }

    #[test]
    fn values_stand_for_their_files() {
        let folder = tempfile::tempdir().unwrap();
        let bag = folder.path().join("a.mcap");
        fs::write(&bag, b"").unwrap();
        let bag_text = bag.to_str().unwrap();
        for value in ["BAG", "run=BAG", "BAG:/odom", "run=BAG:/odom", "calib:BAG"] {
            let found = files_of(OsStr::new(&value.replace("BAG", bag_text)));
            assert!(found.contains(&bag), "{value}: {found:?}");
        }
        assert!(refuse_same(&bag, &folder.path().join("./a.mcap")).is_err());
        assert!(refuse_same(folder.path(), &bag).is_err());
        assert!(refuse_same(folder.path(), &folder.path().join("b.mcap")).is_ok());
        let new = ["x.csv", "./x.csv"].map(|name| folder.path().join(name));
        assert!(refuse_clashes(&new, &[&bag]).is_err());
        assert!(refuse_clashes(&["/dev/null", "/dev/null"], &[&bag]).is_ok());
    }
}
