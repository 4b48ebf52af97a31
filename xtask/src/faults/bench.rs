//! The folder of a try, and the command in it with the layer in front of its files.

use std::path::PathBuf;

use tempfile::TempDir;

use super::calls::Tried;
use super::journal::{self, Operation};
use super::shim::{Mode, Place, Plan, Shim};
use super::verdict::{Files, OLD, Sound, may_be_old};
use crate::trials::{Ended, folder, paths, run, write};

/// The folder of a try.
#[derive(Debug)]
pub(super) struct Bench {
    _folder: TempDir,
    root: PathBuf,
}

impl Bench {
    pub(super) fn new(tried: &Tried) -> anyhow::Result<Self> {
        let folder = folder()?;
        let root = folder.path().canonicalize()?;
        let bench = Self { _folder: folder, root };
        for inside in ["work", "tmp"] {
            std::fs::create_dir_all(bench.under().join(inside))?;
        }
        write(&tried.files, &bench.under())?;
        Ok(bench)
    }

    pub(super) fn under(&self) -> PathBuf {
        self.root.join("in")
    }

    /// Something else in the place of each output.
    pub(super) fn put_old(&self, sound: &Sound) -> std::io::Result<()> {
        let mut outputs = sound.outputs.keys().filter(|output| may_be_old(output));
        outputs.try_for_each(|output| std::fs::write(self.under().join(output), OLD))
    }

    /// What is there, without the empty folders that are always there, and without what a suite keeps for the next time.
    pub(super) fn files(&self) -> anyhow::Result<Files> {
        let under = self.under();
        let found = paths(&under)
            .into_iter()
            .filter(|path| path != "work" && path != "tmp" && !path.starts_with("cache"));
        let read = |path: String| {
            let is_file = under.join(&path).is_file();
            let bytes = if is_file { std::fs::read(under.join(&path))? } else { Vec::new() };
            Ok((path.clone(), without_times(&path, bytes)))
        };
        found.map(read).collect()
    }
}

/// What runs the command.
#[derive(Debug)]
pub(super) struct Runner {
    pub(super) dmp: PathBuf,
    pub(super) shim: Shim,
}

impl Runner {
    pub(super) fn run(
        &self,
        words: &[String],
        bench: &Bench,
        plan: Plan,
    ) -> anyhow::Result<(Ended, Vec<Operation>)> {
        let (log, keep) = (bench.root.join("log"), bench.root.join("keep"));
        let _ = std::fs::remove_file(&log);
        let _ = std::fs::remove_dir_all(&keep);
        if plan.mode == Mode::Kill {
            std::fs::create_dir(&keep)?;
        }
        let under = bench.under();
        let place = Place { under: &under, log: &log, keep: &keep };
        let mut ended = run(&self.dmp, words, &under, &bench.root, &self.shim.surroundings(&place, plan))?;
        // Some of what is printed names whole paths.
        if let (Ok(printed), Some(root)) = (std::str::from_utf8(&ended.stdout), bench.root.to_str()) {
            ended.stdout = printed.replace(root, "").into_bytes();
        }
        Ok((ended, journal::read(&log)?))
    }
}

/// The files of a command by their paths.
pub(super) fn inputs(tried: &Tried) -> Files {
    tried.files.iter().map(|file| (file.path.clone(), file.bytes.clone())).collect()
}

/// An output without how long its making took, and in how much memory.
fn without_times(path: &str, bytes: Vec<u8>) -> Vec<u8> {
    let (begins, ends) = match path.rsplit('.').next() {
        Some("xml") => ("time=\"", '"'),
        Some("html") => ("<dd>", '<'),
        _ => return bytes,
    };
    let text = String::from_utf8_lossy(&bytes);
    // A page holds the numbers once more, as they are printed with `--json`.
    let text = match text.split_once("<script type=\"application/json\"") {
        Some((before, data)) => {
            [before, data.split_once("</script>").map_or(data, |(_, rest)| rest)].concat()
        }
        None => text.into_owned(),
    };
    let mut parts = text.split(begins);
    let mut kept = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let value = part.split(ends).next().unwrap_or_default();
        let differs = ends == '"' || value.contains(" s on ") || value.contains("iB of ");
        kept += begins;
        kept += if differs { &part[value.len()..] } else { part };
    }
    kept.into_bytes()
}
