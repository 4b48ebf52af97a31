//! The sink of an evaluation: it gets every return and the sums of every frame.

use std::collections::BTreeMap;
use std::sync::Mutex;

use dmp::{Config, FrameSums, RunSums, ScoredReturns, Sink, Watch, evaluate};

use crate::common::{collapse, drift, noise, open, runs_of, small_town, write_mcap};

/// Sums up the returns once more.
#[derive(Default)]
struct Again {
    runs: Mutex<BTreeMap<usize, Vec<RunSums>>>,
    frames: Mutex<BTreeMap<usize, Vec<RunSums>>>,
}

impl Sink for Again {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        let mut frames = self.runs.lock().unwrap();
        let sums = frames.entry(returns.frame).or_default();
        sums.resize_with(returns.runs.len(), RunSums::default);
        for (run, sums) in returns.runs.iter().zip(sums) {
            let Some(run) = run else { continue };
            assert_eq!(
                (run.residuals.len(), run.rays.len()),
                (returns.offsets_ns.len(), returns.offsets_ns.len())
            );
            let posed = run.residuals.iter().zip(run.is_posed).filter(|(_, is_posed)| **is_posed);
            posed.for_each(|(residuals, _)| sums.add(residuals));
        }
    }

    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        self.frames.lock().unwrap().insert(frame, sums.runs());
    }
}

#[test]
fn a_sink_gets_every_scored_return() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(40, 90);
    write_mcap(&path, &scans);
    let runs =
        runs_of(&truth, &[("noise", noise(0.05, 0.1)), ("drift", drift(1.0)), ("half", collapse(0.5))]);
    let again = Again::default();
    let config = Config { threads: 3, ..Config::default() };
    let report = evaluate(open(&path).as_ref(), &runs, &config, Watch::sink(&again)).unwrap();
    let by_return = again.runs.into_inner().unwrap();
    assert_eq!(by_return, again.frames.into_inner().unwrap());
    assert_eq!(by_return.len(), report.inputs.scans_used);
    for (run, scores) in report.runs.iter().enumerate() {
        let mut sums = RunSums::default();
        by_return.values().for_each(|frame| sums.merge(&frame[run]));
        assert_eq!(sums.returns(), scores.returns);
        assert_eq!(sums.dmp_sum_m2(), scores.dmp_sum_m2);
        assert_eq!(sums.r_near_m2()[2].1, scores.r_near_m2[2]);
        assert_eq!(sums.coverage(), scores.coverage);
        assert!(sums.with_first() > 0);
    }
}
