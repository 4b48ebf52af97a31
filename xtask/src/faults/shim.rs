//! The file layer that breaks: C, since it takes the place of functions of the C library.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, ensure};
use tempfile::TempDir;

const SOURCE: &str = include_str!("shim.c");

/// The layer, compiled.
#[derive(Debug)]
pub(super) struct Shim {
    _folder: TempDir,
    library: PathBuf,
}

/// What is to go wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    /// Nothing: operations are counted.
    None,
    /// One operation fails, or does half of its work.
    Once,
    /// From that one on nothing can be written for want of room.
    Full,
    /// From that one on nothing works.
    Broken,
    /// The process is killed at it; operations that change nothing do not count.
    Kill,
}

/// What goes wrong in one run of the command.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    pub(super) mode: Mode,
    /// The number of the operation, from 1.
    pub(super) at: u64,
    /// Which of the faults that suit it.
    pub(super) draw: u64,
}

impl Plan {
    pub(super) const NOTHING: Self = Self { mode: Mode::None, at: 0, draw: 0 };
}

/// Where the layer looks and writes.
#[derive(Debug)]
pub(super) struct Place<'a> {
    /// The files of the try.
    pub(super) under: &'a Path,
    pub(super) log: &'a Path,
    /// Files that lost their names; none are kept where there is no such folder.
    pub(super) keep: &'a Path,
}

impl Shim {
    pub(super) fn build() -> anyhow::Result<Self> {
        ensure!(cfg!(target_os = "linux"), "faults are injected on Linux only");
        let folder = tempfile::tempdir()?;
        let (source, library) = (folder.path().join("shim.c"), folder.path().join("shim.so"));
        std::fs::write(&source, SOURCE)?;
        let mut command = Command::new("cc");
        command.args(["-shared", "-fPIC", "-O1", "-o"]).arg(&library).arg(&source).arg("-ldl");
        let output =
            command.output().context("no C compiler `cc`, which makes the file layer that breaks")?;
        ensure!(output.status.success(), "cc: {}", String::from_utf8_lossy(&output.stderr));
        Ok(Self { _folder: folder, library })
    }

    /// What a command's environment must hold.
    pub(super) fn surroundings(&self, place: &Place<'_>, plan: Plan) -> Vec<(&'static str, OsString)> {
        let mode = match plan.mode {
            Mode::None => "none",
            Mode::Once => "once",
            Mode::Full => "full",
            Mode::Broken => "broken",
            Mode::Kill => "kill",
        };
        vec![
            ("LD_PRELOAD", self.library.clone().into()),
            ("DMP_FAULTS_UNDER", place.under.into()),
            ("DMP_FAULTS_LOG", place.log.into()),
            ("DMP_FAULTS_KEEP", place.keep.into()),
            ("DMP_FAULTS_MODE", mode.into()),
            ("DMP_FAULTS_AT", plan.at.to_string().into()),
            ("DMP_FAULTS_DRAW", plan.draw.to_string().into()),
            // With these the command does not execute itself once more, which would count anew.
            ("MALLOC_MMAP_THRESHOLD_", "262144".into()),
            ("MALLOC_TRIM_THRESHOLD_", "1048576".into()),
            ("MALLOC_ARENA_MAX", "1".into()),
            ("TMPDIR", place.under.join("tmp").into()),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `cat` of two files below the folder: what it reads is written down, and the second read fails.
    #[test]
    fn operations_are_counted_and_fail() {
        let Ok(shim) = Shim::build() else {
            println!("skipped: no C compiler");
            return;
        };
        let folder = tempfile::tempdir().unwrap();
        let (under, log, keep) =
            (folder.path().join("in"), folder.path().join("log"), folder.path().join("keep"));
        std::fs::create_dir(&under).unwrap();
        std::fs::write(under.join("a"), "one").unwrap();
        let place = Place { under: &under, log: &log, keep: &keep };
        let head = |plan| {
            std::fs::write(&log, "").unwrap();
            let mut command = Command::new("head");
            command.args(["-c", "3", "a"]).current_dir(&under).envs(shim.surroundings(&place, plan));
            (command.output().unwrap(), std::fs::read_to_string(&log).unwrap())
        };
        let (output, lines) = head(Plan::NOTHING);
        assert!(
            output.status.success() && lines.contains("\tread\t") && lines.contains("/in/a\t"),
            "{lines}"
        );
        let reads = lines.lines().find(|line| line.contains("\tread\t")).unwrap();
        let at = reads.split('\t').next().unwrap().parse().unwrap();
        let (output, lines) = head(Plan { mode: Mode::Once, at, draw: 0 });
        assert!(!output.status.success() && lines.contains("\t5\t"), "{lines}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("Input/output error"));
    }
}
