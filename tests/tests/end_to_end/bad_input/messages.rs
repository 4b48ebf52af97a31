//! Rows 26 and 30: nobody listens, and what results tell of the machine.

use std::fs;
use std::process::Stdio;

use super::times::timed;
use super::town;
use crate::common::{dmp, dmp_command, text};

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
    for results in
        ["--help", "score --help", "--version", "info town.mcap", "info town.mcap --json", "man score"]
    {
        let lost = dmp_command(path, results).stdout(full()).stderr(Stdio::piped()).output().unwrap();
        let told = text(&lost.stderr);
        let named = told.starts_with("error: standard output: cannot write: ") && told.lines().count() == 1;
        assert!(lost.status.code() == Some(1) && named, "{results}\n{told}");
        let read = dmp_command(path, results).stdout(closed()).stderr(Stdio::piped()).output().unwrap();
        assert_eq!((read.status.code(), text(&read.stderr).as_str()), (Some(0), ""), "{results}");
    }
    let wrong = dmp_command(path, "score nowhere.mcap -t truth.tum").stderr(closed()).output().unwrap();
    assert_eq!(wrong.status.code(), Some(2));
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
    fs::write(path.join("saved.json"), report.to_string()).unwrap();
    let compared = told(&format!("compare {root}/saved.json --json"));
    let compared: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert_eq!(compared["results"][0]["file"], "saved.json");
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
    told(&format!("drift {root}/town.mcap -t {root}/truth.tum --json --quiet"));
    for entry in fs::read_dir(path.join("maps")).unwrap().chain(fs::read_dir(path).unwrap()) {
        let file = entry.unwrap().path();
        if file.extension().is_some_and(|e| e == "html" || e == "dmpmap") {
            let bytes = fs::read(&file).unwrap();
            assert!(!bytes.windows(root.len()).any(|part| part == root.as_bytes()), "{}", file.display());
        }
    }
}
