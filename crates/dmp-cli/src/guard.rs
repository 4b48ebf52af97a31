//! What is written must not take the place of what is read, nor of other things that are written.
//!
//! One guard for every command, before it does anything: what is written is named by the options whose [`Role`] says so; every
//! other argument that leads to a file is treated as an input.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::bail;
use dmp_disk::{is_stdout, place_of};

use crate::console::Usage;
use crate::files::{is_missing, refuse_clashes, refuse_printed};
use crate::named::NamedFile;
use crate::options::{Asked, Entry, Role, output};

/// The file that gates write: they are not in the registry.
const JUNIT: &str = "junit";

/// Where results are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Results {
    /// To standard output.
    Out,
    /// To standard error: an output takes standard output for itself.
    Aside,
}

/// Refuses outputs of a command in the place of its inputs and of each other; says where results can go.
pub(crate) fn check(asked: &Asked) -> anyhow::Result<Results> {
    let (mut inputs, mut outputs, mut of_runs) = (Vec::new(), Vec::new(), Vec::new());
    let values = |id: &str| asked.matches().try_get_raw(id).ok().flatten().into_iter().flatten();
    for facts in asked.spec().entries().map(Entry::facts).filter(|facts| !facts.is_switch) {
        let values = values(facts.name);
        match facts.role {
            Role::Scratch | Role::Word => {}
            Role::WrittenByRun => of_runs.extend(values.map(|value| NamedFile::from(value.to_owned()))),
            Role::Pictures => outputs.extend(values.flat_map(|folder| pictures_in(Path::new(folder)))),
            Role::Written => outputs.extend(values.map(PathBuf::from)),
            Role::Read | Role::Value => inputs.extend(values.flat_map(files_of)),
        }
    }
    outputs.extend(values(JUNIT).map(PathBuf::from));
    if let Some(output) = outputs.iter().find(|output| of_runs.iter().any(|file| may_be_of_run(file, output)))
    {
        let output = output.display();
        bail!(Usage(format!("{output}: the output may have the name of a run's file (--residuals)")));
    }
    outputs.extend(of_runs.into_iter().map(|file| file.path));
    refuse_clashes(&outputs, &inputs)?;
    refuse_printed(&outputs, &inputs)?;
    let Some(printed) = outputs.iter().find(|output| is_stdout(output)) else { return Ok(Results::Out) };
    if asked.has(&output::JSON) {
        let printed = printed.display();
        bail!(Usage(format!("{printed}: two outputs would be written there, the other is that of --json")));
    }
    Ok(Results::Aside)
}

/// Whether `NAME.EXTENSION` of all runs may become this file, `NAME.RUN.EXTENSION` beside it: runs have no names yet.
fn may_be_of_run(of_runs: &NamedFile, file: &Path) -> bool {
    let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let (None, Some(all), Some(one)) = (&of_runs.name, name(&of_runs.path), name(file)) else { return false };
    let Some((stem, extension)) = all.rsplit_once('.') else { return false };
    let run = one.strip_prefix(stem).and_then(|rest| rest.strip_suffix(extension));
    let is_named = run.is_some_and(|run| run.len() > 2 && run.starts_with('.') && run.ends_with('.'));
    let folder = of_runs.path.parent().unwrap_or(Path::new(""));
    is_named
        && matches!((place_of(&folder.join("x")), place_of(file)), (Ok(Some(a)), Ok(Some(b)))
            if a.parent() == b.parent())
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
    use super::*;

    #[test]
    fn files_of_runs_have_names_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("maps")).unwrap();
        let path = |name: &str| folder.path().join(name);
        let of_all = NamedFile { name: None, path: path("out.laz") };
        for (name, may_be) in [
            ("out.kiss.laz", true),
            ("maps/../out.a.laz", true),
            ("out.laz", false),
            ("out.kiss.xml", false),
            ("other.kiss.laz", false),
            ("maps/out.kiss.laz", false),
            ("out..laz", false),
        ] {
            assert_eq!(may_be_of_run(&of_all, &path(name)), may_be, "{name}");
        }
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
