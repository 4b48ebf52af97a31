//! Quick scores: of places, for which alone a log is read.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::Mutex;

use dmp::{
    Config, Ego, EvaluateError, FrameSums, Quick, Report, Run, RunSums, ScoredPlace, SettingName, Sink,
    Verdict, Watch, evaluate, evaluate_quick,
};
use dmp_log::{LogOptions, LogOutline, outline_log};
use dmp_sensor::{Scan, Trajectory};
use dmp_sim::{CityOptions, CityRecording, LidarOptions, SlamErrors};
use serde_json::Value;

use crate::common::{
    SMALL_CHUNK, comparable, drift, ends, has, json, misused, noise, open, plain, runs_of, save_tum, scores,
    text, write_chunks, write_mcap,
};

fn outline(log: &Path) -> LogOutline {
    outline_log(log, &LogOptions::default()).unwrap()
}

fn quick(log: &Path, runs: &[Run], config: &Config, share: f64) -> Report {
    evaluate_quick(&outline(log), runs, config, Quick::Share(share), ()).unwrap()
}

/// A drive through a city with a small sensor: its scans and its truth.
fn city(travel_m: f64, revisit_share: f64) -> (Vec<Scan>, Trajectory) {
    let lidar = LidarOptions { azimuth_steps: 160, rate_hz: 10.0, ..LidarOptions::with_beams(16) };
    let options = CityOptions { seed: 3, travel_m, revisit_share, speed_m_s: 10.0, lidar };
    let recording = CityRecording::new(&options).unwrap();
    let truth = Trajectory::stamped(recording.poses(20.0).unwrap().collect()).unwrap().trajectory;
    (recording.scans().collect(), truth)
}

/// The sums of every frame and every place.
#[derive(Default)]
struct Sums {
    frames: Mutex<BTreeMap<usize, FrameSums>>,
    places: Mutex<BTreeMap<usize, (ScoredPlace, FrameSums)>>,
}

impl Sink for Sums {
    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        self.frames.lock().unwrap().insert(frame, sums.clone());
    }

    fn place_scored(&self, place: ScoredPlace, sums: &FrameSums) {
        assert!(self.places.lock().unwrap().insert(place.number, (place, sums.clone())).is_none());
    }
}

fn same(a: &FrameSums, b: &FrameSums) -> bool {
    a.runs() == b.runs() && a.pair_sums().eq(b.pair_sums())
}

/// Scans 4.5 m apart, so that none is left out, and a drive so short that the places in its middle see all of it.
#[test]
fn a_place_that_sees_the_whole_drive_is_scored_as_in_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let (all, truth) = city(400.0, 0.0);
    let at_m =
        |scan: &Scan| truth.world_from_body_at(scan.stamp_ns.unwrap(), i64::MAX).unwrap().translation.vector;
    let first_m = at_m(&all[0]);
    let mut scans: Vec<Scan> = Vec::new();
    for scan in all.into_iter().take_while(|scan| (at_m(scan) - first_m).norm() < 52.0) {
        if scans.last().is_none_or(|last| (at_m(&scan) - at_m(last)).norm() > 4.2) {
            // Times of points say how far apart scans are, and these are farther.
            scans.push(Scan { time_offsets_ns: Vec::new(), ..scan });
        }
    }
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2))]);
    let config = Config { ego: Ego::None, voxel_m: Some(0.4), ..plain() };

    let (whole, parts) = (Sums::default(), Sums::default());
    evaluate(open(&path).as_ref(), &runs, &config, Watch::sink(&whole)).unwrap();
    let report =
        evaluate_quick(&outline(&path), &runs, &config, Quick::Share(1.0), Watch::sink(&parts)).unwrap();
    let whole = whole.frames.into_inner().unwrap();
    let (frames, places) = (parts.frames.into_inner().unwrap(), parts.places.into_inner().unwrap());
    let of_report = report.sampling.places.unwrap();
    assert_eq!((of_report.drawn, of_report.total), (places.len() as u64, places.len() as u64));
    assert_eq!(report.sampling.frames_scored, whole.len() as u64);

    let ends = [first_m, at_m(scans.last().unwrap())];
    let length_m = (ends[1] - ends[0]).norm();
    assert!(length_m > 45.0, "{length_m} m, {} scans", scans.len());
    let sees_all = |k: &usize| ends.iter().all(|end| (at_m(&scans[*k]) - end).norm() < 30.0);
    let in_middle: Vec<usize> = (0..scans.len()).filter(sees_all).collect();
    assert!(!in_middle.is_empty());
    for frame in in_middle {
        assert!(same(&whole[&frame], &frames[&frame]), "scan {frame}");
        assert!(whole[&frame].runs()[0].coverage().unwrap() > 0.1, "scan {frame}: nothing independent");
    }
    // Those at the ends see less: the places are not simply the whole.
    assert!(whole.keys().any(|frame| !same(&whole[frame], &frames[frame])));
    let sum = |sums: &mut dyn Iterator<Item = &FrameSums>| {
        let mut all = FrameSums::new(whole[&0].bases());
        sums.for_each(|sums| all.merge(sums));
        all
    };
    assert!(same(&sum(&mut frames.values()), &sum(&mut places.values().map(|(_, sums)| sums))));
}

#[test]
#[ignore = "nightly: a long drive three times"]
fn a_share_of_the_log_is_read_and_decides() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("city.mcap");
    let (scans, truth) = city(2500.0, 0.4);
    write_chunks(&path, &scans, SMALL_CHUNK);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let config = plain();
    let report = quick(&path, &runs, &config, 0.5);
    let places = report.sampling.places.unwrap();
    let bytes = report.inputs.bytes;
    assert!(places.bytes_read.unwrap() <= bytes / 2, "{places:?} of {bytes}");
    assert!(places.bytes_read.unwrap() > bytes / 4, "{places:?} of {bytes}");
    assert!(places.drawn >= 20 && places.drawn < places.total / 2, "{places:?}");
    // As many of either kind as there are.
    let expected = places.drawn as f64 * places.revisited_total as f64 / places.total as f64;
    assert!((places.revisited as f64 - expected).abs() <= 1.0 && places.revisited > 3, "{places:?}");
    assert_eq!((report.order[0].as_str(), report.pairs[0].verdict.better()), ("truth", Some("truth")));
    let inputs = &report.inputs;
    assert_eq!(inputs.returns, inputs.returns_used + inputs.dropped.0.values().sum::<u64>());
    assert_eq!((inputs.scans, inputs.scans_used), (scans.len(), scans.len()));
    assert!(report.sampling.frames_scored < places.scans_read && places.scans_read < scans.len() as u64 / 2);

    // The same whatever the threads and the memory.
    let again = quick(&path, &runs, &Config { threads: 3, memory_bytes: 100 << 20, ..config.clone() }, 0.5);
    assert_eq!(comparable(&again), comparable(&report));
    // Less than any memory has room for.
    let little = Config { memory_bytes: 40 << 20, ..config };
    let error = evaluate_quick(&outline(&path), &runs, &little, Quick::Share(0.5), ()).unwrap_err();
    assert!(error.is_usage() && matches!(error, EvaluateError::TooLittleMemory { .. }), "{error}");
}

#[test]
#[ignore = "nightly: a long drive twice"]
fn places_grow_until_they_decide() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("city.mcap");
    let (scans, truth) = city(2500.0, 0.4);
    write_chunks(&path, &scans, SMALL_CHUNK);
    let grown = |runs: &[Run], config: &Config| {
        let places = Sums::default();
        let (log, watch) = (outline(&path), Watch::sink(&places));
        let report = evaluate_quick(&log, runs, config, Quick::UntilDecided, watch).unwrap();
        // No place is scored twice, and the sums are those of all.
        let places = places.places.into_inner().unwrap();
        for (run, of_run) in report.runs.iter().enumerate() {
            let mut sums = RunSums::default();
            places.values().for_each(|(_, place)| sums.merge(&place.runs()[run]));
            assert_eq!(of_run.dmp_sum_m2, sums.dmp_sum_m2());
        }
        let of_report = report.sampling.places.unwrap();
        assert_eq!((of_report.drawn, of_report.share_asked), (places.len() as u64, None));
        (report, places.into_keys().collect::<BTreeSet<_>>())
    };
    let error = |report: &Report| 1.0 - report.promise.interval_confidence;

    let (decided, first) = grown(&runs_of(&truth, &[("drift", drift(1.0))]), &plain());
    assert_eq!(decided.pairs[0].verdict.better(), Some("truth"));
    assert_eq!((decided.sampling.places.unwrap().looks, first.len()), (Some(1), 20));
    // Two draws of the same noise, which are not the same to the millimetre, take all that may be read.
    let equal = [("one", 1), ("another", 2)]
        .map(|(name, seed)| Run::new(name, SlamErrors { seed, ..noise(0.05, 0.1) }.apply(&truth).unwrap()));
    let (open, all) = grown(&equal, &Config { same_within_m: Some(0.001), ..plain() });
    assert_eq!((open.pairs[0].verdict.clone(), all.len()), (Verdict::Undecided, 40));
    assert!(open.sampling.places.unwrap().looks == Some(2) && first.is_subset(&all), "{first:?} {all:?}");
    // Both share the error rate of two looks at four scales.
    for report in [&decided, &open] {
        assert!((error(report) / (0.01 / 8.0) - 1.0).abs() < 1e-9, "{}", error(report));
    }
}

/// The log of a city in a folder, and the arguments for a quick score of it.
fn in_folder(folder: &Path) -> String {
    let (scans, truth) = city(600.0, 0.3);
    write_chunks(&folder.join("city.mcap"), &scans, SMALL_CHUNK);
    for run in runs_of(&truth, &[("drift", drift(1.0))]) {
        save_tum(&folder.join(format!("{}.tum", run.name)), &run.trajectory);
    }
    "score city.mcap -t truth.tum -t drift.tum --trust --quick=90%".to_owned()
}

#[test]
fn the_command_reports_what_was_drawn_and_refuses_what_quick_cannot() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = in_folder(folder.path());
    let report = json(folder.path(), &arguments);
    for field in ["drawn", "total", "revisited", "scans_read", "share_asked", "bytes_read", "radius_m"] {
        assert!(report["sampling"]["places"][field].is_number(), "{field}: {report}");
    }
    let decided = json(folder.path(), &arguments.replace("90%", "decided"));
    assert!(
        decided["sampling"]["places"]["share_asked"].is_null() || decided["sampling"]["places"].is_null()
    );
    // A log of which all would be read is scored as a whole.
    let all = "score @/town.mcap -t @/truth.tum --trust --json";
    let whole = ends(folder.path(), &format!("{all} --quiet"), 0);
    let short = ends(folder.path(), &format!("{all} --quick"), 0);
    assert_eq!(scores(&short.stdout), scores(&whole.stdout));
    has(&text(&short.stderr), &["note: ", "--quick would read "]);
    for option in ["--resume", "--per-frame frames.csv", "--map truth=map.laz"] {
        let name = option.split([' ', '=']).next().unwrap();
        misused(folder.path(), &format!("{arguments} {option}"), &[name, "--quick"]);
    }
    for wrong in ["0%", "101%", "5", "x%"] {
        misused(folder.path(), &arguments.replace("90%", wrong), &["no share of a log: try 5%, or decided"]);
    }
}

/// A fifth of the log is ruined: some places have nothing left at all.
#[test]
fn damage_at_a_place_is_reported_and_the_rest_scored() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = in_folder(folder.path()).replace("90%", "100%");
    let path = folder.path().join("city.mcap");
    let mut bytes = fs::read(&path).unwrap();
    let (from, to) = (bytes.len() * 2 / 5, bytes.len() * 3 / 5);
    (from..to).step_by(997).for_each(|at| bytes[at] ^= 0x55);
    fs::write(&path, bytes).unwrap();
    let report = scores(&ends(folder.path(), &format!("{arguments} --json"), 3).stdout);
    assert_eq!(report["pairs"][0]["verdict"], "truth");
    let damage = report["inputs"]["damage"].as_array().unwrap().iter().map(Value::to_string);
    let (damage, count) = (damage.clone().collect::<BTreeSet<_>>(), damage.count());
    assert!(damage.len() > 3 && damage.len() == count, "{damage:?}");
}

#[test]
fn a_drive_with_nothing_to_choose_among_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stand.mcap");
    let (scans, truth) = city(400.0, 0.0);
    write_mcap(&path, &scans[..20]);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let refusal =
        |share: f64| evaluate_quick(&outline(&path), &runs, &plain(), Quick::Share(share), ()).unwrap_err();
    let error = refusal(0.5);
    assert!(error.is_usage() && error.to_string().contains("too short for a sample of places"), "{error}");
    for share in [0.0, -1.0, 1.1, f64::NAN] {
        assert!(matches!(refusal(share), EvaluateError::Setting { setting: SettingName::Quick, .. }));
    }
}
