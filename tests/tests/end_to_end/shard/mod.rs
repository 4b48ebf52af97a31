//! Scores in parts: the bits of one process, whoever did which part, how often and in which order.

mod faults;
mod parts;

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::common::{dmp, scores_in_parts, text, town_in};

const TOWN: &str = "town.mcap -t truth.tum -t drift.tum --trust";
const STAGES: [&str; 4] = ["fuse", "merge", "cast", "drift"];

/// Parts of each stage.
type Counts = [u32; 4];

/// Runs a command that must not fail, and gives what it printed.
fn does(folder: &Path, arguments: &str) -> Output {
    let output = dmp(folder, arguments);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{arguments}\n{}", text(&output.stderr));
    output
}

/// A town and its plan in `work`.
fn planned(folder: &Path) {
    town_in(folder);
    plan(folder, "work", TOWN);
}

fn plan(folder: &Path, work: &str, asked: &str) {
    does(folder, &format!("shard plan {asked} -o {work} --quiet"));
}

/// Does all parts of a stage, the last one first.
fn stage(folder: &Path, work: &str, stage: &str, parts: u32) {
    for part in (1..=parts).rev() {
        does(folder, &format!("shard {stage} {work} --part {part}/{parts} --threads 1 --quiet"));
    }
}

fn all_stages(folder: &Path, work: &str, counts: Counts) {
    for (name, parts) in STAGES.into_iter().zip(counts) {
        stage(folder, work, name, parts);
    }
}

/// What `reduce` prints, but for what may differ, and the exit code.
fn reduced(folder: &Path, work: &str) -> (Value, Option<i32>) {
    let output = does(folder, &format!("shard reduce {work} --json --quiet"));
    (scores_in_parts(&output.stdout), output.status.code())
}

fn whole(folder: &Path, asked: &str) -> (Value, Option<i32>) {
    let output = does(folder, &format!("score {asked} --json --quiet"));
    (scores_in_parts(&output.stdout), output.status.code())
}

/// Every file of a folder, by name.
fn files_of(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = paths.map(|path| (name(&path), fs::read(&path).unwrap())).collect();
    files.sort();
    files
}
