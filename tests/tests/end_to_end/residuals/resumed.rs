//! Returns of an evaluation that is taken up again.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use dmp::{Config, FrameSums, Progress, ScoredReturns, Sink, Watch, evaluate};

use crate::common::{comparable, drift, open, runs_of, small_town};
use crate::resume::{in_pieces, write_in_small_chunks};

/// Counts the returns and frames that come by.
#[derive(Default)]
struct Counting {
    returns: AtomicU64,
    frames: AtomicU64,
}

impl Sink for Counting {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        let count = returns.offsets_ns.len();
        for run in returns.runs {
            assert_eq!((run.rays.len(), run.residuals.len()), (count, count));
        }
        self.returns.fetch_add(count as u64, Ordering::Relaxed);
    }

    fn frame_scored(&self, _: usize, _: &FrameSums) {
        self.frames.fetch_add(1, Ordering::Relaxed);
    }

    fn wants_every_return(&self) -> bool {
        true
    }
}

/// Asks to stop once so many returns were scored.
struct StopInCast(AtomicU64);

impl Sink for StopInCast {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        self.0.fetch_add(returns.offsets_ns.len() as u64, Ordering::Relaxed);
    }
}

impl Progress for StopInCast {
    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed) > 20_000
    }
}

#[test]
fn every_return_comes_by_also_where_an_evaluation_is_taken_up() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(60, 180);
    write_in_small_chunks(&path, &scans);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let config = Config {
        work_folder: folder.path().to_path_buf(),
        checkpoint_every: Some(Duration::ZERO),
        resume: true,
        ..Config::default()
    };
    let log = open(&path);
    let stop = StopInCast(AtomicU64::new(0));
    let stopped = evaluate(log.as_ref(), &runs, &config, (&stop, &stop));
    assert!(stopped.is_err(), "it was to stop while it casts");
    let watch = Counting::default();
    let report = evaluate(log.as_ref(), &runs, &config, Watch::sink(&watch)).unwrap();
    assert_eq!(watch.returns.into_inner(), report.runs[0].returns);
    assert_eq!(watch.frames.into_inner(), report.sampling.frames_scored);
    let (whole, _) = in_pieces(&path, &runs, &Config { resume: false, ..config }, u64::MAX / 4);
    assert_eq!(comparable(&report), comparable(&whole));
}
