//! What is written must not take the place of what is read, nor of other things that are written.
//!
//! One guard for every command, before it does anything: what is written is named by the options of [`OUTPUTS`]; every other
//! argument that leads to a file is taken to be read.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::{ArgMatches, Command};
use dmp_disk::{is_stdout, place_of};

use crate::clash::{refuse_clashes, refuse_printed};
use crate::exit::Usage;
use crate::named::NamedFile;
use crate::save::is_missing;

/// The options that name what is written, whatever the command.
const OUTPUTS: [&str; 16] = [
    "junit",
    "keep",
    "output",
    "per_frame",
    "per_tile",
    "plot",
    "plots",
    "report",
    "residuals",
    "save_graph",
    "save_maps",
    "save_results",
    "save_trajectory",
    "save_truth",
    "scene",
    "svg",
];

/// Where results are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Results {
    /// To standard output.
    Out,
    /// To standard error: an output takes standard output for itself.
    Aside,
}

/// Refuses outputs of a command in the place of its inputs and of each other; says where results can go.
pub(crate) fn check(command: &Command, matches: &ArgMatches) -> anyhow::Result<Results> {
    if let Some((name, matches)) = matches.subcommand() {
        return command.find_subcommand(name).map_or(Ok(Results::Out), |command| check(command, matches));
    }
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    let (mut of_runs, mut residuals) = (Vec::new(), Vec::new());
    for argument in command.get_arguments() {
        let id = argument.get_id().as_str();
        let Ok(Some(values)) = matches.try_get_raw(id) else { continue };
        match id {
            "work" | "cache" => {}
            // One of some words, whatever file has that name.
            _ if !argument.get_possible_values().is_empty() => {}
            "residuals" => {
                let files: Vec<NamedFile> = values.map(|value| NamedFile::from(value.to_owned())).collect();
                let of_all = files.iter().filter(|file| file.name.is_none());
                of_runs.extend(of_all.map(|file| OfRuns::Residuals(file.path.clone())));
                residuals.extend(files.into_iter().map(|file| file.path));
            }
            "save_maps" => {
                outputs.extend(values.map(PathBuf::from));
                of_runs.extend(outputs.last().cloned().map(OfRuns::Maps));
            }
            "plots" => outputs.extend(values.flat_map(|folder| pictures_in(Path::new(folder)))),
            _ if OUTPUTS.contains(&id) => outputs.extend(values.map(PathBuf::from)),
            _ => inputs.extend(values.flat_map(files_of)),
        }
    }
    of_runs.iter().try_for_each(|files| files.refuse_among(&outputs))?;
    outputs.extend(residuals);
    refuse_clashes(&outputs, &inputs)?;
    refuse_printed(&outputs, &inputs)?;
    let Some(printed) = outputs.iter().find(|output| is_stdout(output)) else { return Ok(Results::Out) };
    if matches.try_get_one::<bool>("json").ok().flatten() == Some(&true) {
        bail!(Usage(format!(
            "{}: two outputs would go there, the other is that of --json",
            printed.display()
        )));
    }
    Ok(Results::Aside)
}

/// Files with a run's name each, which is not known yet.
enum OfRuns {
    /// `FOLDER/RUN.dmpmap`.
    Maps(PathBuf),
    /// `NAME.RUN.EXTENSION`, beside `NAME.EXTENSION`.
    Residuals(PathBuf),
}

impl OfRuns {
    /// Whether the file of some run has this name.
    fn may_be(&self, file: &Path) -> bool {
        let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
        let in_folder = |folder: &Path| {
            matches!((place_of(&folder.join("x")), place_of(file)), (Ok(Some(a)), Ok(Some(b)))
                if a.parent() == b.parent())
        };
        match self {
            Self::Maps(folder) => {
                in_folder(folder) && file.extension().is_some_and(|extension| extension == "dmpmap")
            }
            Self::Residuals(path) => {
                let (Some(all), Some(one)) = (name(path), name(file)) else { return false };
                let Some((stem, extension)) = all.rsplit_once('.') else { return false };
                let run = one.strip_prefix(stem).and_then(|rest| rest.strip_suffix(extension));
                let is_named =
                    run.is_some_and(|run| run.len() > 2 && run.starts_with('.') && run.ends_with('.'));
                is_named && in_folder(path.parent().unwrap_or(Path::new("")))
            }
        }
    }

    /// Refuses another output with such a name.
    fn refuse_among(&self, outputs: &[PathBuf]) -> anyhow::Result<()> {
        let Some(output) = outputs.iter().find(|output| self.may_be(output)) else { return Ok(()) };
        let option = match self {
            Self::Maps(_) => "--save-maps",
            Self::Residuals(_) => "--residuals",
        };
        bail!(Usage(format!("{}: the output may have the name of a run's file ({option})", output.display())))
    }
}

/// A folder of pictures and those in it, which may be replaced.
fn pictures_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let pictures = entries.filter(|file| file.extension().is_some_and(|extension| extension == "svg"));
    std::iter::once(folder.to_path_buf()).chain(pictures).collect()
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

#[cfg(test)]
mod tests {
    use std::any::TypeId;
    use std::collections::BTreeSet;

    use clap::Arg;

    use super::*;

    #[test]
    fn files_of_runs_have_names_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("maps")).unwrap();
        let maps = OfRuns::Maps(path("maps"));
        assert!(maps.may_be(&path("maps/kiss.dmpmap")) && maps.may_be(&path("./maps/../maps/a.dmpmap")));
        assert!(!maps.may_be(&path("kiss.dmpmap")) && !maps.may_be(&path("maps/kiss.xml")));
        assert!(!maps.may_be(&path("maps")));
        let residuals = OfRuns::Residuals(path("out.laz"));
        assert!(residuals.may_be(&path("out.kiss.laz")) && residuals.may_be(&path("maps/../out.a.laz")));
        for name in ["out.laz", "out.kiss.xml", "other.kiss.laz", "maps/out.kiss.laz", "out..laz"] {
            assert!(!residuals.may_be(&path(name)), "{name}");
        }
        assert!(residuals.refuse_among(&[path("out.laz"), path("out.a.laz")]).is_err());
        assert!(residuals.refuse_among(&[path("out.laz"), path("a.csv")]).is_ok());
    }

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
            "cache",
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
            "plan",
            "reference",
            "reference_map",
            "results",
            "run",
            "suite",
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
    }
}
