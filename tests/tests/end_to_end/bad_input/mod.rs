//! The list of bad inputs in `docs/bad-input.md`, row by row, through the command.
//!
//! A row is an entry of a [`table::Row`], with what is made and the commands and their ends, or a test called `row_NN_...` where
//! a line is not enough. On Unix: limits of the shell, links and pipes are part of many rows.
#![cfg(unix)]

mod clouds;
mod logs;
mod outputs;
mod raw;
mod runs;
mod shared;
mod stopping;
mod table;
mod texts;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::Duration;

use dmp_log::{FolderFormat, FolderScanWriter, read_trajectory, write_tum};
use dmp_sensor::{Isometry3, Scan, Trajectory};
use serde_json::Value;
use tempfile::TempDir;

use crate::common::{dmp_command, drift, small_town, text, workspace, write_mcap};

/// Options in one place, as several rows have them.
const GATE: &str = "--expect R_near_5<4.9";
const GATE_THAT_FAILS: &str = "--expect R_near_5<0.01cm";
const KEEPING_WORK: &str = "--work work --resume=0";

/// A folder with a drive of 24 scans as `town.mcap`, its truth and a wrong copy of that; and its scans.
struct Town {
    folder: TempDir,
    scans: &'static [Scan],
    /// Commands and their ends beside those of a row, where they depend on what is made.
    lines: RefCell<Vec<String>>,
    /// Reports of commands that several lines compare with.
    reports: RefCell<BTreeMap<String, Value>>,
}

impl Town {
    fn new() -> Self {
        static DRIVE: OnceLock<(Vec<Scan>, Trajectory)> = OnceLock::new();
        let (scans, truth) = DRIVE.get_or_init(|| small_town(24, 150));
        let town = Self {
            folder: tempfile::tempdir().unwrap(),
            scans,
            lines: RefCell::default(),
            reports: RefCell::default(),
        };
        write_mcap(&town.path("town.mcap"), scans);
        town.tum("truth.tum", truth);
        town.tum("drift.tum", &drift(0.5).apply(truth).unwrap());
        town
    }

    fn root(&self) -> &Path {
        self.folder.path()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root().join(name)
    }

    /// Writes a file, and the folders that it is in.
    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), bytes).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    fn mcap(&self, name: &str, scans: &[Scan]) {
        write_mcap(&self.path(name), scans);
    }

    fn tum(&self, name: &str, trajectory: &Trajectory) {
        let mut lines = Vec::new();
        write_tum(&mut lines, trajectory).unwrap();
        self.write(name, lines);
    }

    /// A run of the drive with other stamps and poses; poses without any are dropped.
    fn changed(
        &self,
        run: &str,
        change: impl Fn(i64, Isometry3<f64>) -> Option<(i64, Isometry3<f64>)>,
    ) -> Trajectory {
        let run = read_trajectory(&self.path(run)).unwrap().trajectory;
        let poses = run.stamps_ns().unwrap().iter().copied().zip(run.poses().iter().copied());
        Trajectory::stamped(poses.filter_map(|(ns, pose)| change(ns, pose)).collect()).unwrap().trajectory
    }

    /// Scans as a folder of files.
    fn scans(&self, name: &str, scans: &[Scan], format: FolderFormat) {
        let mut writer = FolderScanWriter::create(&self.path(name), format).unwrap();
        scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
        writer.finish().unwrap();
    }

    /// Changes the bytes of a file.
    fn change(&self, name: &str, how: impl FnOnce(&mut Vec<u8>)) {
        let mut bytes = self.read(name);
        how(&mut bytes);
        self.write(name, bytes);
    }

    /// One more command and its end.
    fn line(&self, line: String) {
        self.lines.borrow_mut().push(line);
    }

    /// Runs a command that must succeed; returns what it prints.
    fn make(&self, arguments: &str) -> Vec<u8> {
        let output = run(self.root(), "", arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", text(&output.stderr));
        output.stdout
    }

    /// The report of a command that must succeed, once for all lines.
    fn report(&self, arguments: &str) -> Value {
        let mut reports = self.reports.borrow_mut();
        reports.entry(arguments.to_owned()).or_insert_with(|| report(self.root(), "", arguments, 0)).clone()
    }

    fn pipe(&self, name: &str) {
        assert!(Command::new("mkfifo").arg(self.path(name)).status().unwrap().success());
    }
}

/// Runs the command under limits of the shell, such as `ulimit -n 40`, for two minutes at most. Writing beyond a limit of file
/// sizes is an error to it, as a full disk is.
fn run(folder: &Path, limits: &str, arguments: &str) -> Output {
    let samples = workspace().join("data-samples").display().to_string();
    let arguments = arguments.split_whitespace().map(|argument| argument.replace('@', &samples));
    let script = format!("{limits}\nexec timeout 120 \"$0\" \"$@\"");
    let mut command = Command::new("sh");
    command.args(["-c", &script, env!("CARGO_BIN_EXE_dmp-under-test")]).args(arguments).current_dir(folder);
    for name in ["COLUMNS", "NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "GITHUB_ACTIONS"] {
        command.env_remove(name);
    }
    command.stdin(Stdio::null()).output().unwrap()
}

/// The report of a command that is to end with `code` and print nothing on standard error.
fn report(folder: &Path, limits: &str, arguments: &str, code: i32) -> Value {
    let output = run(folder, limits, &format!("{arguments} --json --quiet"));
    assert_eq!(output.status.code(), Some(code), "{arguments}\n{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "", "{arguments}");
    let mut report: Value = serde_json::from_slice(&output.stdout).unwrap();
    if report["schema"] == "dmp-score/3" {
        let object = report.as_object_mut().unwrap();
        assert!(object.remove("timing").is_some() && object.remove("memory").is_some());
        let inputs = &report["inputs"];
        let dropped = inputs["dropped"].as_object().unwrap().values();
        let dropped: u64 = dropped.map(|count| count.as_u64().unwrap()).sum();
        assert_eq!(inputs["returns"].as_u64().unwrap(), inputs["returns_used"].as_u64().unwrap() + dropped);
    }
    report
}

/// What is equal where two logs hold the same: the runs, their order and their pairs.
fn scores(report: &Value) -> Value {
    serde_json::json!([report["runs"], report["order"], report["pairs"]])
}

/// The names in a folder, hidden ones too, in order.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Everything below a folder: files with what is in them, links with where they lead, folders, pipes. Of large files the length
/// and the time of change.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, about) = (entry.path(), entry.metadata().unwrap());
        let content = if about.is_dir() {
            found.extend(contents(&path));
            Vec::new()
        } else if about.is_symlink() {
            fs::read_link(&path).unwrap().to_string_lossy().into_owned().into()
        } else if about.is_file() && about.len() < 1 << 24 {
            fs::read(&path).unwrap()
        } else {
            format!("{} {:?}", about.len(), about.modified()).into()
        };
        found.push((path, content));
    }
    found.sort();
    found
}

/// Starts the command, its standard error kept.
fn begin(folder: &Path, arguments: &str) -> std::process::Child {
    let mut command = dmp_command(folder, arguments);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Sends a signal to a process, which may have ended meanwhile.
fn signal(child: &std::process::Child, name: &str) {
    Command::new("kill").args([name, &child.id().to_string()]).stderr(Stdio::null()).status().unwrap();
}

/// The exit code of a process that is to end by itself within a minute, and its standard error.
fn ended(mut child: std::process::Child) -> (Option<i32>, String) {
    for _ in 0..600 {
        if child.try_wait().unwrap().is_some() {
            let output = child.wait_with_output().unwrap();
            return (output.status.code(), text(&output.stderr));
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    child.kill().unwrap();
    panic!("it does not end: {}", text(&child.wait_with_output().unwrap().stderr));
}
