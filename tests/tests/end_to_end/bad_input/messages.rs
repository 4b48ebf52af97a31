//! Rows 26, 27 and 30: nobody listens, text that is not what it looks like, and what results tell of the machine.

use std::fs;
use std::process::Stdio;

use dmp_log::{McapScanWriter, McapWriterOptions};

use super::times::timed;
use super::town;
use crate::common::{dmp, dmp_command, refused, text};

/// Scores and exit codes are what they are, whoever reads the messages.
#[cfg(unix)]
#[test]
fn row_26_messages_that_nobody_takes_change_nothing() {
    let (folder, _) = town();
    let path = folder.path();
    let all = "score town.mcap -t truth.tum -t drift.tum --json --no-progress";
    let heard = dmp(path, all);
    assert_eq!(heard.status.code(), Some(0));
    let scores = |bytes: &[u8]| {
        let mut report: serde_json::Value = serde_json::from_slice(bytes).unwrap();
        let object = report.as_object_mut().unwrap();
        assert!(object.remove("timing").is_some() && object.remove("memory").is_some());
        report
    };
    let gate = format!("{all} --fail-above R_near_5=0.01cm");
    assert_eq!(dmp(path, &gate).status.code(), Some(4));
    let full = || Stdio::from(fs::File::options().write(true).open("/dev/full").unwrap());
    let closed = || {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        Stdio::from(writer)
    };
    for (stderr, what) in [(full(), "full"), (closed(), "closed")] {
        let unheard = dmp_command(path, all).stderr(stderr).stdout(Stdio::piped()).output().unwrap();
        assert_eq!(unheard.status.code(), Some(0), "{what}");
        assert_eq!(scores(&unheard.stdout), scores(&heard.stdout), "{what}");
    }
    for (stderr, what) in [(full(), "full"), (closed(), "closed")] {
        let unheard = dmp_command(path, &gate).stderr(stderr).stdout(Stdio::piped()).output().unwrap();
        assert_eq!(unheard.status.code(), Some(4), "{what}");
    }
    // A reader who has seen enough is no failure; a disk that is full is one.
    let read = dmp_command(path, all).stdout(closed()).stderr(closed()).output().unwrap();
    assert_eq!(read.status.code(), Some(0));
    let lost = dmp_command(path, all).stdout(full()).stderr(closed()).output().unwrap();
    assert_eq!(lost.status.code(), Some(1));
    let wrong = dmp_command(path, "score nowhere.mcap -t truth.tum").stderr(closed()).output().unwrap();
    assert_eq!(wrong.status.code(), Some(2));
}

/// Names of files, topics, runs and frames command no terminal and no CI server.
#[test]
fn row_27_foreign_text_is_written_out() {
    let (folder, scans) = town();
    let path = folder.path();
    let odd = "/a\u{1b}[2J\n::stop-commands::x\u{202e}\u{9b}";
    let options =
        McapWriterOptions { topic: odd.into(), frame_id: odd.into(), ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(&path.join("odd.mcap"), &options).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
    // A scan file that is cut is named.
    fs::create_dir(path.join("seq")).unwrap();
    for name in ["000000.bin", "0\n::stop-commands::x\u{1b}[2J.bin"] {
        if fs::write(path.join("seq").join(name), [0; 1601]).is_err() {
            // Not every system has such names.
            return;
        }
    }
    let written_out = r"\u001b[2J\u000a::stop-commands::x\u202e\u009b";
    for arguments in [
        "info odd.mcap",
        "info odd.mcap --json",
        "info seq",
        "score odd.mcap -t truth.tum -t drift.tum --verbose",
        "score odd.mcap -t truth.tum -t drift.tum --json",
        "score odd.mcap --topic /none -t truth.tum",
        "score seq -t truth.tum",
        "convert log seq -o new.mcap",
    ] {
        let output = dmp(path, arguments);
        for stream in [&output.stdout, &output.stderr] {
            let told = text(stream);
            let odd = told.chars().find(|c| c.is_control() && *c != '\n' && *c != '\t' || *c == '\u{202e}');
            assert_eq!(odd, None, "{arguments}\n{told}");
            let commands = told.lines().find(|line| line.trim_start().starts_with("::"));
            assert_eq!(commands, None, "{arguments}\n{told}");
        }
        if arguments == "info odd.mcap" {
            assert!(text(&output.stdout).contains(written_out), "{}", text(&output.stdout));
        }
    }
    let named =
        dmp_command(path, "score town.mcap -t").arg("a\n::stop-commands::x=truth.tum").output().unwrap();
    assert_eq!((named.status.code(), text(&named.stderr).lines().count()), (Some(2), 1));
    // In a result of another day's.
    let saved = dmp(path, "score town.mcap -t truth.tum -t drift.tum --json --quiet");
    let saved = text(&saved.stdout);
    fs::write(path.join("odd.json"), saved.replace("\"truth\"", "\"tr\\u001b[2Juth\"")).unwrap();
    refused(path, "compare odd.json", 1, &["odd.json", r"tr\u001b[2Juth"]);
}

/// Names as long as a format allows.
#[test]
fn row_27_long_names_are_shown_as_far_as_they_fit() {
    let (folder, scans) = town();
    let path = folder.path();
    let long = format!("/{}", "n".repeat(65_535));
    let options = McapWriterOptions { topic: long.clone(), ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(&path.join("long.mcap"), &options).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
    let info = dmp(path, "info long.mcap");
    assert_eq!(info.status.code(), Some(0), "{}", text(&info.stderr));
    assert!(text(&info.stdout).contains("(65536 characters)"));
    let saved = dmp(path, "score town.mcap -t truth.tum -t drift.tum --json --quiet");
    fs::write(path.join("a.json"), text(&saved.stdout)).unwrap();
    let renamed = text(&saved.stdout).replace("\"truth\"", &format!("\"{}\"", &long[1..]));
    fs::write(path.join("long.json"), renamed).unwrap();
    for arguments in ["compare long.json", "compare a.json long.json"] {
        let output = dmp(path, arguments);
        assert!(output.status.code().is_some_and(|code| code != 101), "{}", text(&output.stderr));
    }
}

/// What is handed to others does not tell of folders: whatever is given by a path from the root is named by its last part.
#[test]
fn row_30_results_hold_no_paths_from_the_root() {
    let (folder, scans) = town();
    let path = folder.path();
    let root = path.canonicalize().unwrap();
    let root = root.to_str().unwrap();
    let score = format!("score {root}/town.mcap -t {root}/truth.tum -t {root}/drift.tum");
    let outputs = format!("--report {root}/r.html --save-maps {root}/maps");
    let told = |arguments: &str| {
        let output = dmp(path, arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}\n{}", text(&output.stderr));
        assert!(!text(&output.stdout).contains(root), "{arguments}\n{}", text(&output.stdout));
        output
    };
    let report = told(&format!("{score} {outputs} --json --quiet"));
    let report: serde_json::Value = serde_json::from_slice(&report.stdout).unwrap();
    assert_eq!(report["inputs"]["log"], "town.mcap");
    assert_eq!(report["inputs"]["runs"][0]["file"], "truth.tum");
    let relative = dmp(path, "score town.mcap -t ./truth.tum -t drift.tum --json --quiet");
    let relative: serde_json::Value = serde_json::from_slice(&relative.stdout).unwrap();
    assert_eq!(relative["inputs"]["runs"][0]["file"], "./truth.tum");
    let name = path.file_name().unwrap().to_str().unwrap();
    let upward = told(&format!("info ../{name}/town.mcap --json"));
    let upward: serde_json::Value = serde_json::from_slice(&upward.stdout).unwrap();
    assert_eq!(upward["log"], "town.mcap");
    let map = format!("{root}/maps/truth.dmpmap");
    told(&format!("{score} --map truth={map} --json --quiet"));
    told(&format!("info {root}/town.mcap -t {root}/truth.tum --json"));
    // Times that are not understood: a problem names the log too.
    timed(
        &path.join("own"),
        &scans,
        &[("time", 'F', 8, &|_, ns| (ns as f64 / 1e9 + 700.0).to_le_bytes().into())],
    );
    let info = told(&format!("info {root}/own --json"));
    let info: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    let problem = info["streams"][0]["problem"].as_str().unwrap();
    assert!(problem.starts_with("own: point time"), "{problem}");
    told(&format!("map info {map} --json"));
    told(&format!("map info {map}"));
    told(&format!("truth ape {root}/truth.tum {root}/drift.tum --json"));
    assert_eq!(dmp(path, "map export maps/truth.dmpmap -o truth.ply").status.code(), Some(0));
    told(&format!("truth smd {root}/truth.ply {map} --json --quiet"));
    told(&format!("calibrate {root}/town.mcap -t {root}/truth.tum --json --quiet"));
    for entry in fs::read_dir(path.join("maps")).unwrap().chain(fs::read_dir(path).unwrap()) {
        let file = entry.unwrap().path();
        if file.extension().is_some_and(|e| e == "html" || e == "dmpmap") {
            let bytes = fs::read(&file).unwrap();
            assert!(!bytes.windows(root.len()).any(|part| part == root.as_bytes()), "{}", file.display());
        }
    }
}
