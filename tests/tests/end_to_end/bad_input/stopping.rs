//! Row 24: the first Ctrl-C ends a program wherever it is, in long sums as at pipes that nobody opens.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use super::{names_in, town};
use crate::common::{dmp, dmp_command, text};

/// Long enough for a program to come to where it waits.
const A_WHILE: Duration = Duration::from_secs(2);

fn pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

fn begin(folder: &Path, arguments: &str) -> Child {
    let mut command = dmp_command(folder, arguments);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

fn interrupt(child: &Child) {
    // It may have ended meanwhile.
    Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status().unwrap();
}

/// What came of a program that is to end by itself.
fn ended(mut child: Child) -> Output {
    for _ in 0..600 {
        if child.try_wait().unwrap().is_some() {
            return child.wait_with_output().unwrap();
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    child.kill().unwrap();
    panic!("it goes on: {}", text(&child.wait_with_output().unwrap().stderr));
}

/// Stops a program where it waits for ever.
fn stopped_where_it_waits(folder: &Path, arguments: &str) {
    let mut child = begin(folder, arguments);
    std::thread::sleep(A_WHILE);
    assert_eq!(child.try_wait().unwrap(), None, "it was to wait: {arguments}");
    interrupt(&child);
    let output = ended(child);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{arguments}: {stderr}");
    assert_eq!(stderr.lines().last(), Some("error: stopped before the end"), "{arguments}: {stderr}");
}

#[test]
fn row_24_long_steps_stop_midway_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let made = dmp(path, "simulate town -o town.mcap --truth truth.tum --scans 400");
    assert!(made.status.success(), "{}", text(&made.stderr));
    let cloud = dmp(path, "score town.mcap -t truth.tum --sample 100 --residuals cloud.laz --quiet");
    assert!(cloud.status.success(), "{}", text(&cloud.stderr));
    for arguments in [
        "calibrate town.mcap -t truth.tum",
        "drift town.mcap -t truth.tum",
        "score town.mcap -t truth.tum --quick=100%",
        "score town.mcap -t truth.tum --map cloud.laz",
        "convert log town.mcap -o out",
    ] {
        let before = names_in(path);
        let begun = Instant::now();
        let whole = dmp(path, arguments);
        let takes = begun.elapsed();
        assert!(whole.status.success(), "{arguments}: {}", text(&whole.stderr));
        let _ = fs::remove_dir_all(path.join("out"));
        let mut stopped = 0;
        for eighth in [1, 3, 5, 6] {
            let mut child = begin(path, arguments);
            std::thread::sleep(takes * eighth / 8);
            if child.try_wait().unwrap().is_some() {
                // It was faster this time.
                let _ = fs::remove_dir_all(path.join("out"));
                continue;
            }
            interrupt(&child);
            let output = ended(child);
            if output.status.success() {
                // It had just ended.
                let _ = fs::remove_dir_all(path.join("out"));
                continue;
            }
            let what = format!("{arguments}, after {eighth}/8: {}", text(&output.stderr));
            assert_eq!(output.status.code(), Some(130), "{what}");
            assert!(text(&output.stderr).ends_with("error: stopped before the end\n"), "{what}");
            assert_eq!(names_in(path), before, "{what}");
            stopped += 1;
        }
        assert!(stopped > 0, "{arguments}: it was never stopped");
    }
}

#[test]
fn row_24_outputs_and_lists_that_are_pipes_wait_until_they_are_stopped() {
    let (folder, _) = town();
    let path = folder.path();
    ["pipe", "pipe.html", "pipe.laz"].iter().for_each(|name| pipe(&path.join(name)));
    let before = names_in(path);
    for arguments in [
        "score town.mcap -t truth.tum --report pipe.html --quiet",
        "score town.mcap -t truth.tum --residuals pipe.laz --quiet",
        "convert trajectory truth.tum --to tum -o pipe",
        "loops pipe --candidates pipe --quiet",
    ] {
        stopped_where_it_waits(path, arguments);
        assert_eq!(names_in(path), before, "{arguments}");
    }
}

/// A program that refuses in one line with all the words, and waits for nobody.
fn refused_at_once(folder: &Path, arguments: &str, words: &[&str]) {
    let output = ended(begin(folder, &format!("{arguments} --quiet")));
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments}: {stderr}");
    let is_line = stderr.starts_with("error: ") && stderr.lines().count() == 1;
    assert!(is_line && words.iter().all(|word| stderr.contains(word)), "{arguments}: {stderr}");
}

/// They are read more than once: who waited there would wait for ever, or read what is left.
#[test]
fn row_24_inputs_that_are_pipes_are_refused_at_once() {
    let (folder, _) = town();
    let path = folder.path();
    let bag = path.join("bag.db3");
    fs::write(&bag, b"SQLite format 3\0").unwrap();
    ["pipe", "pipe.mcap", "pipe.laz", "pipe.obj", "pipe.dmpmap", "bag.db3-wal"]
        .iter()
        .for_each(|name| pipe(&path.join(name)));
    for arguments in [
        "score pipe.mcap -t truth.tum",
        "score pipe -t truth.tum",
        "info pipe",
        "score town.mcap -t pipe",
        "score town.mcap -t pipe:/odom",
        "score town.mcap -t truth.tum --extrinsic calib:pipe",
        "convert trajectory pipe --to tum -o out.tum",
        "score town.mcap -t truth.tum --map pipe.laz",
        "score town.mcap -t truth.tum --map pipe.obj",
        "score town.mcap -t truth.tum --map pipe.dmpmap",
        "map build pipe.laz -o out.dmpmap",
        "map info pipe.dmpmap",
        "compare pipe",
    ] {
        refused_at_once(path, arguments, &["it is a pipe", "save what comes out of it to a file first"]);
    }
    refused_at_once(path, "info bag.db3", &["bag.db3", "bag.db3-wal`, which belongs to it, is no file"]);
}

#[test]
fn row_24_what_is_asked_to_stop_twice_names_the_work_that_it_keeps() {
    let (folder, _) = town();
    let path = folder.path();
    let work = path.join("work");
    fs::create_dir(&work).unwrap();
    let with_checkpoint = || {
        let folders = names_in(&work).into_iter().map(|name| work.join(name));
        folders.into_iter().any(|folder| names_in(&folder).iter().any(|name| name.ends_with(".checkpoint")))
    };
    let score = "score town.mcap -t truth.tum -t drift.tum --work work --checkpoint 0";
    for _ in 0..100 {
        let mut child = begin(path, score);
        while child.try_wait().unwrap().is_none() && !with_checkpoint() {}
        interrupt(&child);
        interrupt(&child);
        let output = ended(child);
        let stderr = text(&output.stderr);
        let left = names_in(&work);
        // It may have ended meanwhile.
        if output.status.code() != Some(0) {
            assert_eq!(output.status.code(), Some(130), "{stderr}");
            let told = left.iter().all(|name| stderr.contains(name.as_str()) && stderr.contains("--resume"));
            assert!(told, "{left:?}\n{stderr}");
            if !left.is_empty() {
                return;
            }
        }
    }
    panic!("no work was kept");
}

/// Nobody reads what is said, and the pipe is full.
#[cfg(target_os = "linux")]
#[test]
fn row_24_who_cannot_say_a_word_stops_too() {
    let (folder, _) = town();
    let path = folder.path();
    pipe(&path.join("pipe.html"));
    let (_reader, full) = full_pipe();
    for arguments in
        ["score town.mcap -t truth.tum --report pipe.html --quiet", "score town.mcap -t truth.tum"]
    {
        let mut command = dmp_command(path, arguments);
        let child = command.stdout(Stdio::null()).stderr(full.try_clone().unwrap()).spawn().unwrap();
        std::thread::sleep(A_WHILE);
        interrupt(&child);
        assert_eq!(ended(child).status.code(), Some(130), "{arguments}");
    }
}

/// With as much in it as pipes of this system hold.
#[cfg(target_os = "linux")]
fn full_pipe() -> (std::io::PipeReader, std::io::PipeWriter) {
    let (reader, mut writer) = std::io::pipe().unwrap();
    std::io::Write::write_all(&mut writer, &vec![b'\n'; 1 << 16]).unwrap();
    (reader, writer)
}
