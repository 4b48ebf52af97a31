//! The list of bad inputs, through the command: every test is called after its row in `docs/bad-input.md`.
//!
//! A row ends in one of two ways: refused in one line (`refused`), or scored with what is lost or doubtful
//! named (`scored`, which looks at the exit code and at what is on standard error).

mod beside;
mod bounds;
mod crashes;
mod foreign;
mod in_place;
mod log_bytes;
mod log_files;
mod maps;
mod messages;
mod outputs;
mod points;
mod raw;
mod shared_folders;
mod stopping;
mod times;
mod trajectories;
mod untold;

use std::path::Path;
use std::process::{Command, Output};

use dmp_log::{FolderFormat, FolderScanWriter, write_tum};
use dmp_sensor::{Scan, Trajectory};
use serde_json::Value;
use tempfile::TempDir;

use crate::common::{dmp, drift, small_town, text, workspace, write_mcap};

/// A folder with a drive of 24 scans as `town.mcap`, its truth and a wrong copy of that; and its scans.
fn town() -> (TempDir, Vec<Scan>) {
    let folder = tempfile::tempdir().unwrap();
    let (scans, truth) = small_town(24, 150);
    write_mcap(&folder.path().join("town.mcap"), &scans);
    save_tum(&folder.path().join("truth.tum"), &truth);
    save_tum(&folder.path().join("drift.tum"), &drift(0.5).apply(&truth).unwrap());
    (folder, scans)
}

fn save_tum(path: &Path, trajectory: &Trajectory) {
    let mut lines = Vec::new();
    write_tum(&mut lines, trajectory).unwrap();
    std::fs::write(path, lines).unwrap();
}

fn write_folder(path: &Path, scans: &[Scan], format: FolderFormat) {
    let mut writer = FolderScanWriter::create(path, format).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
}

/// The report of a command that is to end with `code` and say nothing beside it.
fn scored(folder: &Path, arguments: &str, code: i32) -> Value {
    let output = dmp(folder, &format!("{arguments} --json --quiet"));
    report_of(&output, arguments, code)
}

fn report_of(output: &Output, arguments: &str, code: i32) -> Value {
    assert_eq!(output.status.code(), Some(code), "{arguments}\n{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "", "{arguments}");
    let mut report: Value = serde_json::from_slice(&output.stdout).unwrap();
    if report["schema"] == "dmp-score/2" {
        let object = report.as_object_mut().unwrap();
        assert!(object.remove("timing").is_some() && object.remove("memory").is_some());
        let inputs = &report["inputs"];
        let dropped = inputs["dropped"].as_object().unwrap().values();
        let dropped: u64 = dropped.map(|count| count.as_u64().unwrap()).sum();
        assert_eq!(inputs["returns"].as_u64().unwrap(), inputs["returns_used"].as_u64().unwrap() + dropped);
    }
    report
}

/// Whether some text of a list holds all the words.
fn says(list: &Value, words: &[&str]) -> bool {
    list.as_array().unwrap().iter().any(|item| words.iter().all(|word| item.to_string().contains(word)))
}

/// What is to be equal where two logs hold the same: the runs, their order and their pairs.
fn scores(report: &Value) -> Value {
    serde_json::json!([report["runs"], report["order"], report["pairs"]])
}

/// The scores in numbers, of each run.
fn numbers(report: &Value) -> Vec<f64> {
    let runs = report["runs"].as_array().unwrap();
    let of_run = |run: &Value| {
        let near = |scale: &str| run["r_near_m2"][scale].as_f64().unwrap();
        [
            run["dmp_sum_m2"].as_f64().unwrap(),
            near("5"),
            near("2"),
            near("0.5"),
            run["miss_rate"].as_f64().unwrap(),
        ]
    };
    runs.iter().flat_map(of_run).collect()
}

fn assert_close(a: &Value, b: &Value, tolerance: f64) {
    let (of_a, of_b) = (numbers(a), numbers(b));
    assert_eq!(of_a.len(), of_b.len());
    let close = of_a.iter().zip(&of_b).all(|(a, b)| (a / b - 1.0).abs() < tolerance);
    assert!(close, "{of_a:?}\n{of_b:?}");
}

/// The command under limits of the shell, such as `ulimit -n 40`. Writing beyond a limit of file sizes is an
/// error to it, as a full disk is.
#[cfg(unix)]
fn dmp_limited(folder: &Path, limits: &str, arguments: &str) -> Output {
    let samples = workspace().join("data-samples").display().to_string();
    let arguments = arguments.split_whitespace().map(|argument| argument.replace('@', &samples));
    let script = format!("trap '' XFSZ; {limits}; exec \"$0\" \"$@\"");
    let dmp = env!("CARGO_BIN_EXE_dmp-under-test");
    Command::new("sh").args(["-c", &script, dmp]).args(arguments).current_dir(folder).output().unwrap()
}

/// A command under limits that is to fail in one line with all the words.
#[cfg(unix)]
fn refused_limited(folder: &Path, limits: &str, arguments: &str, words: &[&str]) {
    let output = dmp_limited(folder, limits, &format!("{arguments} --quiet"));
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments}\n{stderr}");
    assert!(stderr.lines().count() == 1 && stderr.starts_with("error: "), "{arguments}\n{stderr}");
    assert!(words.iter().all(|word| stderr.contains(word)), "{arguments}: {words:?} not in\n{stderr}");
    assert_eq!(text(&output.stdout), "", "{arguments}");
}

/// The names in a folder, hidden ones too, in order.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
