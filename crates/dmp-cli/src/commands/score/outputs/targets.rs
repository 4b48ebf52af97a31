//! Where outputs go, and what cannot go there.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use dmp::file_stem_of;
use dmp_log::ResidualFormat;

use crate::console::Usage;
use crate::named::{NamedFile, assign};

/// A file of scored returns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ResidualFile {
    pub(super) path: PathBuf,
    pub(super) format: ResidualFormat,
}

/// Each run's file: the one given for it by name, else what the one given for all becomes with its name.
pub(super) fn residual_files(runs: &[&str], files: &[NamedFile]) -> Result<Vec<Option<ResidualFile>>, Usage> {
    let values = files.iter().map(|file| (file.name.as_deref(), file.path.display().to_string(), file));
    let assigned = assign("--residuals", runs, values)?;
    let of_run = |(run, file): (&&str, Option<&NamedFile>)| {
        let Some(file) = file else { return Ok(None) };
        let format = format_of(&file.path)?;
        let own = file.name.is_some() || runs.len() == 1;
        let path = if own { file.path.clone() } else { with_run(&file.path, &file_stem_of(runs, run)) };
        Ok(Some(ResidualFile { path, format }))
    };
    runs.iter().zip(assigned).map(of_run).collect()
}

/// `out.laz` as `out.NAME.laz`.
pub(crate) fn with_run(path: &Path, run: &str) -> PathBuf {
    let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_os_string();
    let mut name = part(path.file_stem());
    for part in [".".as_ref(), run.as_ref(), ".".as_ref(), part(path.extension()).as_os_str()] {
        name.push(part);
    }
    path.with_file_name(name)
}

fn format_of(path: &Path) -> Result<ResidualFormat, Usage> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    ResidualFormat::of_extension(extension).ok_or_else(|| {
        let known = ResidualFormat::EXTENSIONS.join(", .");
        Usage(format!("{}: scored returns are written as .{known}", path.display()))
    })
}

/// Rejects a file whose extension is none of these; `what` is written there.
fn check(path: &Path, extensions: &[&str], what: &str) -> Result<(), Usage> {
    let is =
        |extension: &std::ffi::OsStr| extensions.iter().any(|known| extension.eq_ignore_ascii_case(known));
    if path.extension().is_some_and(is) {
        return Ok(());
    }
    Err(Usage(format!("{}: {what} written as .{}", path.display(), extensions[0])))
}

pub(super) fn check_csv(path: &Path) -> Result<(), Usage> {
    check(path, &["csv"], "tables are")
}

pub(super) fn check_mcap(path: &Path) -> Result<(), Usage> {
    check(path, &["mcap"], "a scene is")
}

pub(super) fn check_dmp(path: &Path) -> Result<(), Usage> {
    check(path, &["dmp"], "a result is")
}

pub(crate) fn check_html(path: &Path) -> Result<(), Usage> {
    check(path, &["html", "htm"], "a report is")
}

fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Rejects a missing folder, one in which nothing can be written, and a folder in the file's own place.
pub(crate) fn writable(file: &Path) -> anyhow::Result<()> {
    let folder = folder_of(file);
    match std::fs::metadata(folder) {
        Ok(found) if found.is_dir() => {}
        Err(error) if !matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Err(error).with_context(|| format!("{}: cannot look at its folder", file.display()));
        }
        _ => bail!(Usage(format!("{}: there is no folder {}", file.display(), folder.display()))),
    }
    if file.is_dir() {
        bail!(Usage(format!("{}: a folder has this name", file.display())));
    }
    // What is there may be a device or a link, and is written through.
    if !file.exists() {
        let folder = folder_of(file);
        tempfile::tempfile_in(folder).with_context(|| format!("{}: cannot write", file.display()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::OsString;

    fn paths(runs: &[&str], files: &[&str]) -> Result<Vec<Option<String>>, String> {
        let files: Vec<NamedFile> = files.iter().map(|file| NamedFile::from(OsString::from(file))).collect();
        let found = residual_files(runs, &files).map_err(|error| error.to_string())?;
        Ok(found.into_iter().map(|file| Some(file?.path.display().to_string())).collect())
    }

    #[test]
    fn each_run_has_a_file_of_its_own() {
        let some = |name: &str| Some(name.to_owned());
        assert_eq!(paths(&["a"], &["x/out.laz"]).unwrap(), [some("x/out.laz")]);
        let two = ["a", "one/b"];
        assert_eq!(paths(&two, &["x/o.t.laz"]).unwrap(), [some("x/o.t.a.laz"), some("x/o.t.one_b.laz")]);
        assert_eq!(paths(&two, &["a=x.ply"]).unwrap(), [some("x.ply"), None]);
        assert_eq!(paths(&two, &["a=x.ply", "o.mcap"]).unwrap(), [some("x.ply"), some("o.one_b.mcap")]);
        assert_eq!(paths(&two, &[]).unwrap(), [None, None]);
    }

    #[test]
    fn what_cannot_be_written_is_named() {
        for (files, words) in [
            (&["out.txt"][..], ".laz, .las, .ply, .pcd, .mcap"),
            (&["out"], "out: scored returns"),
            (&["c=out.laz"], "the runs are a, b"),
            (&["x.laz", "y.laz"], "x.laz and y.laz"),
        ] {
            let error = paths(&["a", "b"], files).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        assert!(writable("no/such/out.laz".as_ref()).unwrap_err().to_string().contains("no folder no/such"));
        assert!(check_csv("a.parquet".as_ref()).is_err() && check_csv("a.CSV".as_ref()).is_ok());
        assert!(check_mcap("a.rrd".as_ref()).is_err() && check_mcap("a.MCAP".as_ref()).is_ok());
        assert!(check_dmp("a.json".as_ref()).is_err() && check_dmp("a.DMP".as_ref()).is_ok());
        assert!(check_html("a.pdf".as_ref()).is_err() && check_html("a.HTML".as_ref()).is_ok());
    }
}
