//! Whether what is written would take the place of what is read, or of something else that is written.

use std::ffi::OsStr;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use dmp_disk::place_of;
use dmp_log::{Companions, is_of_log};

use crate::console::Usage;

/// What users keep in folders of scans, of images and of bags, beside the scans.
const KEPT: [&str; 9] = ["npy", "txt", "csv", "tum", "yaml", "yml", "json", "g2o", "dmpmap"];
/// How deep in a folder the files that are read lie.
const DEPTH: u32 = 3;

/// Refuses an output in the place of an input or of another output.
pub(crate) fn refuse_clashes(
    outputs: &[impl AsRef<Path>],
    inputs: &[impl AsRef<Path>],
) -> anyhow::Result<()> {
    for (number, output) in outputs.iter().map(AsRef::as_ref).enumerate() {
        inputs.iter().try_for_each(|input| refuse_same(input.as_ref(), output))?;
        outputs[..number].iter().try_for_each(|other| refuse_shared(other.as_ref(), output))?;
    }
    Ok(())
}

/// Refuses an output that is its own input, or what is read with it, or in it.
pub(crate) fn refuse_same(input: &Path, output: &Path) -> anyhow::Result<()> {
    let refused = |why: &str| bail!(Usage(format!("{}: the output would {why}", output.display())));
    let Some(read) = look(input)? else { return Ok(()) };
    let is_file = look(output)?.is_some_and(|there| there.is_file());
    let name = input.display();
    if read.is_file() && is_file && is_same_file(input, output) {
        return refused(&format!("take the place of the input {name}"));
    }
    let companions = if read.is_dir() { Companions::of_folder(input) } else { Companions::of_file(input) };
    if let Some(file) = companions.files.iter().find(|file| is_same_place(file, output)) {
        return refused(&format!(
            "take the place of {}, which is read with the input {name}",
            file.display()
        ));
    }
    if companions.folders.iter().any(|folder| is_part(folder, output)) {
        return refused(&format!("be read as a part of the input {name}: write it elsewhere"));
    }
    if read.is_dir() && is_file && (is_inside(input, output) || holds(input, DEPTH, output)) {
        return refused(&format!("replace a file of the input {name}; remove it first if it is none"));
    }
    Ok(())
}

/// Refuses an output in the place of another output, or in a log that is another output.
fn refuse_shared(other: &Path, output: &Path) -> anyhow::Result<()> {
    if !output.is_dir() && is_same_place(other, output) {
        bail!(Usage(format!("{}: two outputs would have this name", output.display())));
    }
    for (log, file) in [(other, output), (output, other)] {
        let is_in = || match (place_of(log), place_of(file)) {
            (Ok(Some(log)), Ok(Some(file))) => file.starts_with(log),
            _ => false,
        };
        let is_read = || {
            let parts = Companions::of_folder(log);
            parts.files.iter().any(|part| is_same_place(part, file))
                || parts.folders.iter().any(|folder| is_part(folder, file))
        };
        if !log.exists() && is_in() && is_read() {
            let (file, log) = (file.display(), log.display());
            bail!(Usage(format!("{file}: the output would be a part of the output {log}")));
        }
    }
    Ok(())
}

/// Refuses what the shell has opened for results and messages where that is an input, a part of one, or an output.
#[cfg(unix)]
pub(crate) fn refuse_printed(
    outputs: &[impl AsRef<Path>],
    inputs: &[impl AsRef<Path>],
) -> anyhow::Result<()> {
    use std::os::fd::AsFd as _;
    let (out, err) = (std::io::stdout(), std::io::stderr());
    for (stream, open) in [("standard output", out.as_fd()), ("standard error", err.as_fd())] {
        let Ok(found) = open.try_clone_to_owned().and_then(|open| fs::File::from(open).metadata()) else {
            continue;
        };
        if !found.is_file() {
            continue;
        }
        let is_it = |path: &Path| id_of(path) == Some(id(&found));
        let refused = |path: &Path, what: &str| {
            bail!(Usage(format!("{}: {stream} goes there, and it is {what}", path.display())))
        };
        // An output by the name of an open file is meant to go there.
        let by_name = |path: &&Path| matches!(place_of(path), Ok(Some(_)));
        if let Some(output) = outputs.iter().map(AsRef::as_ref).filter(by_name).find(|path| is_it(path)) {
            return refused(output, "an output too");
        }
        for input in inputs.iter().map(AsRef::as_ref) {
            if is_it(input) {
                return refused(input, "an input");
            }
            let companions =
                if input.is_dir() { Companions::of_folder(input) } else { Companions::of_file(input) };
            let in_folders = companions.folders.iter().flat_map(|folder| files_in(folder));
            let mut read = companions.files.iter().cloned().chain(in_folders.filter(|file| is_of_log(file)));
            if let Some(file) = read.find(|file| is_it(file)) {
                return refused(&file, &format!("read with the input {}", input.display()));
            }
        }
    }
    Ok(())
}

/// Where files have no numbers it is not known what the shell has opened.
#[cfg(not(unix))]
pub(crate) fn refuse_printed(_: &[impl AsRef<Path>], _: &[impl AsRef<Path>]) -> anyhow::Result<()> {
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

/// Whether a file of a folder that is read would be the output.
fn is_part(folder: &Path, output: &Path) -> bool {
    let Ok(Some(place)) = place_of(output) else { return false };
    let name = place.file_name().map(Path::new).filter(|name| is_of_log(name));
    name.is_some_and(|name| is_same_place(&folder.join(name), output))
}

/// Whether users may have put such a file into a folder of a log to keep it.
fn is_kept(file: &Path) -> bool {
    let extension = file.extension().and_then(OsStr::to_str);
    is_of_log(file)
        || extension.is_some_and(|found| KEPT.iter().any(|known| found.eq_ignore_ascii_case(known)))
}

/// Whether a file of a log lies in a folder.
fn is_inside(folder: &Path, file: &Path) -> bool {
    match (folder.canonicalize(), file.canonicalize()) {
        (Ok(folder), Ok(file)) => file.starts_with(folder) && is_kept(&file),
        _ => false,
    }
}

fn files_in(folder: &Path) -> impl Iterator<Item = PathBuf> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

/// Whether a file is in a folder by another name.
fn holds(folder: &Path, depth: u32, file: &Path) -> bool {
    files_in(folder).any(|path| {
        if is_kept(&path) {
            return is_same_file(&path, file);
        }
        depth > 0 && path.is_dir() && holds(&path, depth - 1, file)
    })
}

/// Whether two paths are one file, whether it exists yet or not.
pub(crate) fn is_same_place(a: &Path, b: &Path) -> bool {
    if a.exists() && b.exists() {
        // Devices and pipes take as much as one likes.
        return a.is_file() && is_same_file(a, b);
    }
    let place = |path: &Path| {
        let place = place_of(path).unwrap_or_else(|_| Some(path.to_path_buf()))?;
        // Where file names ignore case.
        let folds = cfg!(any(windows, target_os = "macos"));
        Some(if folds { place.to_string_lossy().to_lowercase().into() } else { place })
    };
    place(a).is_some_and(|a| Some(a) == place(b))
}

/// Whether two paths lead to one file, by whatever links and names.
#[cfg(unix)]
fn is_same_file(a: &Path, b: &Path) -> bool {
    id_of(a).is_some_and(|a| Some(a) == id_of(b))
}

#[cfg(unix)]
fn id_of(path: &Path) -> Option<[u64; 2]> {
    fs::metadata(path).ok().map(|found| id(&found))
}

#[cfg(unix)]
fn id(found: &fs::Metadata) -> [u64; 2] {
    use std::os::unix::fs::MetadataExt as _;
    [found.dev(), found.ino()]
}

#[cfg(not(unix))]
fn is_same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let bag = path("a.mcap");
        fs::write(&bag, b"").unwrap();
        fs::create_dir(path("scans")).unwrap();
        fs::write(path("scans/0.bin"), b"").unwrap();
        fs::hard_link(path("scans/0.bin"), path("report.html")).unwrap();
        let may = |input: &Path, name: &str| refuse_same(input, &path(name)).is_ok();
        for name in ["./a.mcap", "times.txt", "calib.txt", "../calib.txt", "a.mcap-wal"] {
            assert!(!may(&bag, name), "{name}");
        }
        for name in ["a.mcap", "b.mcap", "scans/new.laz", "report.html", "times/0.f32", "depth.txt"] {
            assert!(!may(folder.path(), name), "{name}");
        }
        for name in ["times.txt", "scans/times.txt", "camera.json"] {
            assert!(!may(&path("scans"), name), "{name}");
        }
        for name in ["new.html", "results/out.laz", "scores.csv"] {
            assert!(may(folder.path(), name) && may(&bag, name), "{name}");
        }
        assert!(may(&bag, "b.mcap") && may(&path("scans"), "out.laz"));
    }

    #[test]
    fn outputs_are_not_in_one_place() {
        let folder = tempfile::tempdir().unwrap();
        let may = |names: [&str; 2]| {
            let none: [&Path; 0] = [];
            refuse_clashes(&names.map(|name| folder.path().join(name)), &none).is_ok()
        };
        assert!(!may(["x.csv", "./x.csv"]) && !may(["drive", "drive/times.txt"]));
        assert!(!may(["drive/scans/0.bin", "drive"]) && may(["drive", "drive/truth.tum"]));
        assert!(may(["/dev/null", "/dev/null"]) && may(["x.csv", "times.txt"]));
    }
}
