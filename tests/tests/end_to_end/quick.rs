//! Quick scores: of places, for which alone a log is read.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Mutex;

use dmp::{
    Config, Ego, EvaluateError, FrameSums, Report, Run, Sample, ScoredPlace, SettingName, Sink, Watch,
    evaluate, evaluate_quick,
};
use dmp_log::{FolderFormat, FolderScanWriter, LogOptions, LogOutline, outline_log, write_tum};
use dmp_sensor::{Scan, Trajectory};
use dmp_sim::{CityOptions, CityRecording, LidarOptions};

use crate::common::{comparable, drift, noise, open, runs_of, text, write_mcap};
use crate::resume::write_in_small_chunks;

fn outline(log: &Path) -> LogOutline {
    outline_log(log, &LogOptions::default()).unwrap()
}

fn quick(log: &Path, runs: &[Run], config: &Config, share: f64) -> Report {
    evaluate_quick(&outline(log), runs, config, share, ()).unwrap()
}

/// A drive through a city with a small sensor: its scans and its truth.
fn city(travel_m: f64, revisit_share: f64) -> (Vec<Scan>, Trajectory) {
    let lidar = LidarOptions { azimuth_steps: 240, rate_hz: 10.0, ..LidarOptions::with_beams(16) };
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
    let config = Config { ego: Ego::None, voxel_m: Some(0.4), ..Config::default() };

    let (whole, parts) = (Sums::default(), Sums::default());
    evaluate(open(&path).as_ref(), &runs, &config, Watch::sink(&whole)).unwrap();
    let report = evaluate_quick(&outline(&path), &runs, &config, 1.0, Watch::sink(&parts)).unwrap();
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
fn a_share_of_the_log_is_read_and_decides() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("city.mcap");
    let (scans, truth) = city(2500.0, 0.4);
    write_in_small_chunks(&path, &scans);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let config = Config::default();
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
    for (threads, memory_bytes) in [(1, 1 << 30), (3, 1 << 30), (2, 100 << 20)] {
        let again = quick(&path, &runs, &Config { threads, memory_bytes, ..config.clone() }, 0.5);
        assert_eq!(comparable(&again), comparable(&report));
    }
    // The same again from the same outline.
    let known = outline(&path);
    for _ in 0..2 {
        let again = evaluate_quick(&known, &runs, &config, 0.5, ()).unwrap();
        assert_eq!(comparable(&again), comparable(&report));
    }
    // Another seed draws other places, and sees the same.
    let other = quick(&path, &runs, &Config { seed: 1, ..config.clone() }, 0.5);
    assert_ne!(other.runs[0].dmp_sum_m2, report.runs[0].dmp_sum_m2);
    assert_eq!(other.pairs[0].verdict.better(), Some("truth"));
    // Less than any memory has room for.
    let little = Config { memory_bytes: 40 << 20, ..config };
    let error = evaluate_quick(&outline(&path), &runs, &little, 0.5, ()).unwrap_err();
    assert!(error.is_usage() && matches!(error, EvaluateError::TooLittleMemory { .. }), "{error}");
}

/// A folder has each scan in a file of its own, and the MCAP file one in each chunk.
#[test]
fn the_container_of_the_scans_changes_no_number() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, truth) = city(600.0, 0.3);
    let (mcap, pcd) = (folder.path().join("city.mcap"), folder.path().join("city"));
    let options = dmp_log::McapWriterOptions { chunk_bytes: 1, ..Default::default() };
    let mut writer = dmp_log::McapScanWriter::create(&mcap, &options).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
    let mut writer = FolderScanWriter::create(&pcd, FolderFormat::Pcd).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2)), ("drift", drift(1.0))]);
    let reports = [&mcap, &pcd].map(|log| quick(log, &runs, &Config::default(), 1.0));
    let numbers = |report: &Report| (report.runs.clone(), report.pairs.clone(), report.config.clone());
    assert_eq!(numbers(&reports[0]), numbers(&reports[1]));
    let places = reports[0].sampling.places.unwrap();
    assert_eq!(places.drawn, places.total);
    // All places, and on the whole what all scans say.
    let whole = evaluate(open(&mcap).as_ref(), &runs, &Config::default(), ()).unwrap();
    let verdicts = |report: &Report| report.pairs.iter().map(|p| p.verdict.to_string()).collect::<Vec<_>>();
    assert_eq!(verdicts(&reports[0])[1], verdicts(&whole)[1]);
    assert_eq!(whole.order[0], reports[0].order[0]);
}

#[test]
fn a_log_without_revisits_says_what_it_can_tell() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("city.mcap");
    let (scans, truth) = city(900.0, 0.0);
    write_in_small_chunks(&path, &scans[..scans.len() / 2]);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let report = quick(&path, &runs, &Config::default(), 0.5);
    let told = report.warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
    assert_eq!(report.sampling.places.unwrap().revisited_total, 0);
    assert!(told.contains("the way comes back to no place") && told.contains("within 70 m"), "{told}");
}

/// The log of a city in a folder, and the arguments for a quick score of it.
fn in_folder(folder: &Path) -> String {
    let (scans, truth) = city(600.0, 0.3);
    write_in_small_chunks(&folder.join("city.mcap"), &scans);
    for run in runs_of(&truth, &[("drift", drift(1.0))]) {
        let mut file = fs::File::create(folder.join(format!("{}.tum", run.name))).unwrap();
        write_tum(&mut file, &run.trajectory).unwrap();
    }
    "score city.mcap -t truth.tum -t drift.tum --quick=90%".to_owned()
}

#[test]
fn the_command_tells_what_was_drawn_and_read() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = in_folder(folder.path());
    let run = |more: &str| crate::common::dmp(folder.path(), &format!("{arguments}{more}"));
    let told = run("");
    assert_eq!(told.status.code(), Some(0), "{}", text(&told.stderr));
    let out = crate::common::unwrapped(&text(&told.stdout));
    for words in [
        "scans at ",
        " places, evenly spread (--seed 0)",
        " of them passed more than once",
        " read for them",
        " of the log in all",
    ] {
        assert!(out.contains(words), "{words}: {out}");
    }
    let json: serde_json::Value = serde_json::from_slice(&run(" --json").stdout).unwrap();
    let places = json.pointer("/sampling/places").unwrap();
    for field in ["drawn", "total", "revisited", "scans_read", "share_asked", "bytes_read", "radius_m"] {
        assert!(places.get(field).is_some_and(serde_json::Value::is_number), "{field}: {places}");
    }
    for (more, words) in [
        (" --sample 28", &["--sample", "--quick"][..]),
        (" --decide", &["--decide", "--quick"]),
        (" --resume", &["--resume", "--quick"]),
        (" --checkpoint 60", &["--checkpoint", "--quick"]),
        (" --per-frame frames.csv", &["--per-frame", "--quick"]),
        (" --like saved.json", &["--like", "--quick"]),
        (" --free-space", &["--free-space", "--quick"]),
        (" --map truth=map.laz", &["--map", "--quick"]),
        (" --save-maps maps", &["--save-maps", "--quick"]),
    ] {
        let output = run(more);
        assert_eq!(output.status.code(), Some(2), "{more}");
        assert!(words.iter().all(|word| text(&output.stderr).contains(word)), "{}", text(&output.stderr));
    }
    for wrong in ["0%", "101%", "5", "x%"] {
        let arguments = arguments.replace("90%", wrong);
        let output = crate::common::dmp(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        assert!(text(&output.stderr).contains("no share of a log: try 5%"), "{}", text(&output.stderr));
    }
}

/// Twenty places of a short log would be more than all of it.
#[test]
fn all_of_a_short_log_is_scored() {
    let folder = tempfile::tempdir().unwrap();
    let all = "score @/town.mcap -t @/truth.tum -t @/drift.tum --json";
    let scored = |more: &str| {
        let output = crate::common::dmp(folder.path(), &format!("{all}{more}"));
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let mut json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let object = json.as_object_mut().unwrap();
        assert!(object.remove("timing").is_some() && object.remove("memory").is_some());
        (json, text(&output.stderr).lines().map(str::to_owned).collect::<Vec<_>>())
    };
    let (expected, said) = scored("");
    let (found, told) = scored(" --quick");
    assert_eq!(found, expected);
    let note = "note: all is scored: --quick would read ";
    assert!(told.len() == said.len() + 1 && told[0].starts_with(note), "{told:?}");
    assert!(told[0].ends_with(" of this log of 2.08 MiB"), "{told:?}");
    assert!(scored(" --quick --quiet").1.is_empty());
    // Every place was asked for.
    assert!(scored(" --quick=100%").0["sampling"]["places"]["drawn"].is_number());
}

/// A fifth of the log is ruined: some places have nothing left at all.
#[test]
fn what_is_damaged_at_a_place_is_told_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = in_folder(folder.path()).replace("90%", "100%");
    let path = folder.path().join("city.mcap");
    let mut bytes = fs::read(&path).unwrap();
    let (from, to) = (bytes.len() * 2 / 5, bytes.len() * 3 / 5);
    for at in (from..to).step_by(997) {
        bytes[at] ^= 0x55;
    }
    fs::write(&path, bytes).unwrap();
    let damage_of = |threads: usize| {
        let output = crate::common::dmp(folder.path(), &format!("{arguments} --json --threads {threads}"));
        assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(report.pointer("/pairs/0/verdict").unwrap(), "truth");
        let damage = report.pointer("/inputs/damage").unwrap().as_array().unwrap();
        damage.iter().map(|lost| lost.as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let damage = damage_of(1);
    assert!(damage.len() > 3, "{damage:?}");
    assert_eq!(damage.iter().collect::<std::collections::BTreeSet<_>>().len(), damage.len());
    assert_eq!(damage, damage_of(3));
}

#[test]
fn a_drive_with_nothing_to_choose_among_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stand.mcap");
    let (scans, truth) = city(400.0, 0.0);
    write_mcap(&path, &scans[..20]);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let refusal =
        |config: &Config, share: f64| evaluate_quick(&outline(&path), &runs, config, share, ()).unwrap_err();
    let error = refusal(&Config::default(), 0.5);
    assert!(error.is_usage() && error.to_string().contains("nothing to choose among"), "{error}");
    for share in [0.0, -1.0, 1.1, f64::NAN] {
        assert!(matches!(
            refusal(&Config::default(), share),
            EvaluateError::Setting { setting: SettingName::Quick, .. }
        ));
    }
    let sampled = Config { sample: Sample::Frames(3), ..Config::default() };
    assert!(matches!(refusal(&sampled, 0.5), EvaluateError::Setting { setting: SettingName::Quick, .. }));
}
