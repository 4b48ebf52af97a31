//! Quick scores: of few scans, and more until they decide.

use std::fs;
use std::path::Path;

use dmp::{
    Config, DriftPairs, EvaluateError, Report, Run, SettingName, Verdict, evaluate, evaluate_quick,
    quick_steps,
};
use dmp_log::{LogOptions, LogOutline, outline_log};
use dmp_sensor::{Scan, Trajectory};
use dmp_sim::{CityOptions, CityRecording, LidarOptions, SlamErrors};
use serde_json::Value;

use crate::common::{
    SMALL_CHUNK, comparable, drift, ends, has, json, misused, noise, open, plain, runs_of, save_tum, scores,
    text, write_chunks,
};

fn outline(log: &Path) -> LogOutline {
    outline_log(log, &LogOptions::default()).unwrap()
}

fn quick(log: &Path, runs: &[Run], config: &Config) -> Report {
    evaluate_quick(&outline(log), runs, config, ()).unwrap()
}

/// A drive through a city with a small sensor: its scans and its truth.
fn city(travel_m: f64, revisit_share: f64) -> (Vec<Scan>, Trajectory) {
    let lidar = LidarOptions { azimuth_steps: 160, rate_hz: 10.0, ..LidarOptions::with_beams(16) };
    let options = CityOptions { seed: 3, travel_m, revisit_share, speed_m_s: 10.0, lidar };
    let recording = CityRecording::new(&options).unwrap();
    let truth = Trajectory::stamped(recording.poses(20.0).unwrap().collect()).unwrap().trajectory;
    (recording.scans().collect(), truth)
}

/// What all scores of the same scans have in common.
fn found(report: &Report) -> (Value, Value, Value) {
    let json = comparable(report);
    (json["runs"].clone(), json["order"].clone(), json["config"].clone())
}

/// A look is the score of every n-th scan, and little of the log is read for it.
#[test]
fn a_look_is_a_score_of_some_scans() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("city.mcap");
    let (scans, truth) = city(800.0, 0.4);
    write_chunks(&path, &scans, SMALL_CHUNK);
    let runs = runs_of(&truth, &[("drift", drift(2.0))]);
    let report = quick(&path, &runs, &plain());
    assert_eq!(report.pairs[0].verdict.better(), Some("truth"));
    let (taken, every, steps) =
        (report.sampling.quick.unwrap(), report.config.every, quick_steps(scans.len()));
    assert_eq!((steps[taken.look as usize - 1], steps.len()), (every, taken.looks as usize));
    let share = taken.bytes as f64 / report.inputs.bytes as f64;
    assert!(share < 0.5, "{share} of the log read for every {every}th of {} scans", scans.len());

    let config = Config { every, drift: DriftPairs::None, ..plain() };
    let whole = evaluate(open(&path).as_ref(), &runs, &config, ()).unwrap();
    assert_eq!(found(&report), found(&whole));
    let inputs = &report.inputs;
    assert_eq!((inputs.scans, inputs.scans_used), (scans.len(), scans.len().div_ceil(every)));
    assert_eq!(inputs.returns, inputs.returns_used + inputs.dropped.0.values().sum::<u64>());
    // All looks share the error rate.
    let error = |report: &Report| 1.0 - report.promise.interval_confidence;
    assert!((error(&report) * f64::from(taken.looks) / error(&whole) - 1.0).abs() < 1e-9);
    assert_eq!(report.promise.confidence, whole.promise.confidence);

    // The same whatever the threads and the memory.
    let other = Config { threads: 3, memory_bytes: 100 << 20, ..plain() };
    assert_eq!(comparable(&quick(&path, &runs, &other)), comparable(&report));
}

/// Two draws of the same noise, which are not the same to the millimetre, take all looks.
#[test]
fn equal_runs_take_every_look() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("city.mcap");
    let (scans, truth) = city(800.0, 0.4);
    write_chunks(&path, &scans, SMALL_CHUNK);
    let equal = [("one", 1), ("another", 2)]
        .map(|(name, seed)| Run::new(name, SlamErrors { seed, ..noise(0.05, 0.1) }.apply(&truth).unwrap()));
    let report = quick(&path, &equal, &Config { same_within_m: Some(0.001), ..plain() });
    let taken = report.sampling.quick.unwrap();
    assert_eq!((report.pairs[0].verdict.clone(), report.config.every), (Verdict::Undecided, 4));
    assert_eq!((taken.look, taken.looks as usize), (taken.looks, quick_steps(scans.len()).len()));
}

/// The log of a city in a folder, and the arguments for a quick score of it.
fn in_folder(folder: &Path) -> String {
    let (scans, truth) = city(600.0, 0.3);
    write_chunks(&folder.join("city.mcap"), &scans, SMALL_CHUNK);
    for run in runs_of(&truth, &[("drift", drift(1.0))]) {
        save_tum(&folder.join(format!("{}.tum", run.name)), &run.trajectory);
    }
    "score city.mcap -t truth.tum -t drift.tum --trust --quick".to_owned()
}

#[test]
fn the_command_says_what_it_took_and_refuses_what_quick_cannot() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = in_folder(folder.path());
    let report = json(folder.path(), &arguments);
    for field in ["look", "looks", "bytes"] {
        assert!(report["sampling"]["quick"][field].is_number(), "{field}: {report}");
    }
    let table = text(&ends(folder.path(), &format!("{arguments} --quiet"), 0).stdout);
    has(&table, &["a quick score: look ", " % of the log's bytes"]);
    // A short log is scored as a whole.
    let all = "score @/town.mcap -t @/truth.tum --trust --json";
    let whole = ends(folder.path(), &format!("{all} --quiet"), 0);
    let short = ends(folder.path(), &format!("{all} --quick"), 0);
    assert_eq!(scores(&short.stdout), scores(&whole.stdout));
    has(&text(&short.stderr), &["note: all is scored: 100 scans are too few for --quick"]);
    for option in ["--every 2", "--resume", "--per-frame frames.csv", "--map truth=map.laz"] {
        let name = option.split([' ', '=']).next().unwrap();
        misused(folder.path(), &format!("{arguments} {option}"), &[name, "--quick"]);
    }
    let (path, truth) = (folder.path().join("city.mcap"), folder.path().join("truth.tum"));
    let runs = [Run::new("truth", dmp_log::read_trajectory(&truth).unwrap().trajectory)];
    for config in [Config { every: 2, ..plain() }, Config { resume: true, ..plain() }] {
        let error = evaluate_quick(&outline(&path), &runs, &config, ()).unwrap_err();
        assert!(matches!(error, EvaluateError::Setting { setting: SettingName::Quick, .. }), "{error}");
    }
}

/// A fifth of the log is ruined.
#[test]
fn damage_is_reported_and_the_rest_scored() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = in_folder(folder.path());
    let path = folder.path().join("city.mcap");
    let mut bytes = fs::read(&path).unwrap();
    let (from, to) = (bytes.len() * 2 / 5, bytes.len() * 3 / 5);
    (from..to).step_by(997).for_each(|at| bytes[at] ^= 0x55);
    fs::write(&path, bytes).unwrap();
    let report = scores(&ends(folder.path(), &format!("{arguments} --json"), 3).stdout);
    assert_eq!(report["pairs"][0]["verdict"], "truth");
    assert!(report["inputs"]["damage"].as_array().unwrap().len() > 3, "{report}");
}
