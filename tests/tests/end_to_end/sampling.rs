//! Scores of a sample of the scans.

use std::collections::BTreeMap;
use std::sync::Mutex;

use dmp::{
    CastReturns, Config, Decide, FrameOrder, FrameSums, MapSource, Report, Residuals, Run, RunSums, Sample,
    ScoredReturns, Sink, Watch, evaluate,
};
use dmp_sim::SlamErrors;
use serde_json::Value;

use crate::common::{
    SCORE, SMALL_CHUNK, TWO, comparable, done, drift, has, json, noise, open, plain, refused, runs_of,
    sample, score, small_town, unwrapped, write, write_chunks, write_mcap,
};
use crate::resume::in_pieces;

/// The sums of every frame that is scored.
#[derive(Default)]
struct Frames(Mutex<BTreeMap<usize, Vec<RunSums>>>);

impl Sink for Frames {
    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        assert!(self.0.lock().unwrap().insert(frame, sums.runs()).is_none(), "frame {frame} twice");
    }
}

fn frames_of(
    log: &std::path::Path,
    runs: &[Run],
    config: &Config,
) -> (Report, BTreeMap<usize, Vec<RunSums>>) {
    let frames = Frames::default();
    let report = evaluate(open(log).as_ref(), runs, config, Watch::sink(&frames)).unwrap();
    (report, frames.0.into_inner().unwrap())
}

/// Scans without a pose are counted in all of the log, whatever the sample.
#[test]
fn a_sample_has_the_warnings_of_all_scans() {
    let folder = tempfile::tempdir().unwrap();
    let truth = std::fs::read_to_string(sample("truth.tum")).unwrap();
    let warnings = |poses: usize, more: &str| -> Vec<Value> {
        let part: String = truth.lines().take(poses).flat_map(|line| [line, "\n"]).collect();
        write(folder.path(), "part.tum", &part);
        let report = json(folder.path(), &format!("{SCORE} -t part.tum {more}"));
        let warnings = report["warnings"].as_array().unwrap().iter();
        warnings.filter(|warning| warning.to_string().contains("scan_without_pose")).cloned().collect()
    };
    // Of more than half of the scans, and of one in ten.
    for (poses, count) in [(300, 1), (720, 0)] {
        let of_all = warnings(poses, "");
        assert_eq!((of_all.len(), warnings(poses, "--sample 6")), (count, of_all), "{poses}");
    }
}

#[test]
fn a_sample_is_the_sum_of_its_frames_in_the_whole_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(60, 180);
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2)), ("drift", drift(1.0))]);
    let saved = Config { save_maps: Some(folder.path().to_path_buf()), every: 2, ..plain() };
    let (_, whole) = frames_of(&path, &runs, &saved);
    let given = |run: &Run| {
        let map = folder.path().join(format!("{}.dmpmap", run.name));
        Run { map: MapSource::Given(map), ..run.clone() }
    };
    let given: Vec<Run> = runs.iter().map(given).collect();
    let (_, given_whole) = frames_of(&path, &given, &Config { every: 2, ..plain() });
    for (runs, whole) in [(&runs, &whole), (&given, &given_whole)] {
        for (seed, order) in [(0, FrameOrder::Log), (1, FrameOrder::Shuffled(5))] {
            let config = Config { sample: Sample::Frames(7), seed, order, every: 2, ..plain() };
            let (report, sampled) = frames_of(&path, runs, &config);
            assert_eq!((sampled.len(), whole.len()), (7, 30));
            assert!(sampled.iter().all(|(frame, sums)| whole[frame] == *sums));
            // Evenly spread: 30 / 7 planned scans apart, which are every second of the log.
            let numbers: Vec<usize> = sampled.keys().map(|frame| frame / 2).collect();
            assert!(numbers.windows(2).all(|pair| (4..=5).contains(&(pair[1] - pair[0]))), "{numbers:?}");
            for (run, of_run) in report.runs.iter().enumerate() {
                let mut sums = RunSums::default();
                sampled.values().for_each(|frame| sums.merge(&frame[run]));
                assert_eq!(of_run.dmp_sum_m2, sums.dmp_sum_m2());
                assert_eq!((of_run.returns, of_run.frames), (sums.returns(), 7));
            }
            let sampling = &report.sampling;
            assert_eq!((sampling.frames_scored, sampling.frames_total, sampling.seed), (7, 30, Some(seed)));
            let inputs = &report.inputs;
            assert_eq!(inputs.returns, inputs.returns_used + inputs.dropped.0.values().sum::<u64>());
            let skipped = (0..60).step_by(2).filter(|frame| !sampled.contains_key(frame));
            let skipped: u64 = skipped.map(|frame| scans[frame].len() as u64).sum();
            assert_eq!(inputs.dropped.0["scan_not_sampled"], skipped);
        }
    }
}

#[test]
fn a_sample_of_everything_is_everything() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(40, 90);
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let whole = comparable(&score(&path, &runs, &plain()));
    for sample in [Sample::Share(1.0), Sample::Frames(1000)] {
        let all = score(&path, &runs, &Config { sample, seed: 3, ..plain() });
        assert_eq!(comparable(&all), whole);
    }
}

/// The residuals of every return that is cast, by scan, time and place.
#[derive(Default)]
struct Returns(Mutex<BTreeMap<(usize, i64, [u64; 3]), Vec<Residuals>>>);

impl Sink for Returns {
    fn returns_scored(&self, scored: &ScoredReturns<'_>) {
        let mut all = self.0.lock().unwrap();
        let runs: Vec<_> = scored.runs.iter().flatten().collect();
        for (index, &offset_ns) in scored.offsets_ns.iter().enumerate() {
            let residuals = runs.iter().map(|run| run.residuals[index]).collect();
            let place = runs[0].rays[index].endpoint_in_world().map(f64::to_bits);
            assert!(all.insert((scored.frame, offset_ns, place), residuals).is_none());
        }
    }
}

fn returns_of(
    log: &std::path::Path,
    runs: &[Run],
    config: &Config,
) -> (Report, BTreeMap<(usize, i64, [u64; 3]), Vec<Residuals>>) {
    let returns = Returns::default();
    let report = evaluate(open(log).as_ref(), runs, config, Watch::sink(&returns)).unwrap();
    (report, returns.0.into_inner().unwrap())
}

/// The oracle: of all residuals those of one of three consecutive returns, the same for every order and number of threads.
#[test]
fn a_draw_has_the_residuals_of_all_returns_in_the_same_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(40, 180);
    write_chunks(&path, &scans, SMALL_CHUNK);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let (whole, all) = returns_of(&path, &runs, &plain());
    let third = |seed| Config { returns: CastReturns::OneIn(3), seed, ..plain() };
    let (report, drawn) = returns_of(&path, &runs, &third(0));
    assert!(drawn.iter().all(|(key, residuals)| all[key] == *residuals));
    // Of each three consecutive ones, used or not, one is drawn.
    let used = (all.len() / 3) as f64;
    assert!((drawn.len() as f64 / used - 1.0).abs() < 0.05, "{} of {}", drawn.len(), all.len());
    let sum_m2: f64 = drawn.values().filter_map(|runs| runs[0].first_m).map(|m| m * m).sum();
    assert!((report.runs[0].dmp_sum_m2 / sum_m2 - 1.0).abs() < 1e-6);

    let [inputs, of_all] = [&report.inputs, &whole.inputs];
    assert_eq!((inputs.returns_used, report.sampling.returns_one_in), (drawn.len() as u64, 3));
    let mut dropped = inputs.dropped.0.clone();
    let not_drawn = dropped.insert("not_drawn".to_owned(), 0).unwrap();
    assert_eq!((not_drawn + inputs.returns_used, &dropped), (of_all.returns_used, &of_all.dropped.0));
    assert_eq!(report.runs[0].map.surfels, whole.runs[0].map.surfels);

    let shuffled = Config { threads: 3, order: FrameOrder::Shuffled(2), memory_bytes: 32 << 20, ..third(0) };
    assert_eq!(comparable(&score(&path, &runs, &shuffled)), comparable(&report));
    let other = returns_of(&path, &runs, &third(1)).1;
    assert!(!other.keys().eq(drawn.keys()));
}

#[test]
fn samples_grow_until_it_is_decided() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(60, 180);
    write_chunks(&path, &scans, SMALL_CHUNK);
    let mut runs = runs_of(&truth, &[("drift", drift(2.0))]);
    let decide = |pair: Option<(&str, &str)>| {
        let pair = pair.map(|(a, b)| (a.to_owned(), b.to_owned()));
        let decide = Some(Decide { pair });
        Config { sample: Sample::Frames(4), decide, ..plain() }
    };
    let report = score(&path, &runs, &decide(None));
    assert_eq!(report.pairs[0].verdict.better(), Some("truth"));
    let looks = report.sampling.looks.clone().unwrap();
    assert!(
        report.sampling.frames_scored < 60 && looks.last() == Some(&report.sampling.frames_scored),
        "{looks:?}"
    );
    // Looks at 4, 8, 16 and 32, at four scales each, share half of the error; the other half is kept for all scans.
    let error = |report: &Report| 1.0 - report.promise.interval_confidence;
    assert!((error(&report) / (0.01 / 32.0) - 1.0).abs() < 1e-9, "{}", error(&report));

    // Two equal runs, which cannot be called the same early, take all scans.
    let draw = |seed| SlamErrors { seed, ..noise(0.05, 0.1) }.apply(&truth).unwrap();
    runs.extend([Run::new("draw", draw(1)), Run::new("another draw", draw(2))]);
    let hopeless = Config {
        same_within_m: Some(0.001),
        checkpoint_every: Some(std::time::Duration::ZERO),
        ..decide(None)
    };
    let all = score(&path, &runs, &hopeless);
    assert_eq!(all.sampling.looks, Some(vec![4, 8, 16, 32, 60]));
    let differences = |report: &Report| -> Vec<_> {
        let scales = report.pairs.iter().flat_map(|pair| &pair.scales);
        scales.map(|scale| (scale.returns, scale.difference_m2)).collect()
    };
    let whole = score(&path, &runs, &plain());
    assert_eq!(all.runs, whole.runs);
    assert_eq!(differences(&all), differences(&whole));
    // But not where that pair does not matter.
    let other = score(&path, &runs, &decide(Some(("drift", "draw"))));
    assert!(other.sampling.frames_scored < 60, "{:?}", other.sampling);

    // Interrupted again and again it comes to the same.
    let config = Config { work_folder: folder.path().to_path_buf(), ..hopeless };
    let (pieces, count) = in_pieces(&path, &runs, &config, 100_000);
    assert!(count > 1, "{count} pieces");
    assert_eq!(comparable(&pieces), comparable(&all));
}

#[test]
fn the_command_samples_and_decides() {
    let folder = tempfile::tempdir().unwrap();
    let table = unwrapped(&done(folder.path(), &format!("{TWO} --quiet --sample 10")));
    has(&table, &["10 of ", "evenly spread"]);
    let report = json(folder.path(), &format!("{TWO} --decide=truth,drift --confidence 99.9%"));
    assert_eq!(report["pairs"][0]["verdict"], "truth", "{report}");
    assert_eq!(report["sampling"]["looks"][0], 28);
    for (options, words) in [
        ("-t @/truth.tum --decide", ["decide with one run", "two runs at least"]),
        ("-t @/truth.tum -t @/drift.tum --decide=truth,nobody", ["decide truth,nobody", "two of the runs"]),
    ] {
        refused(folder.path(), &format!("{SCORE} {options}"), 2, &words);
    }
}
