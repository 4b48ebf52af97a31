//! The points of every run's map, thinned alike.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use dmp::{FrameSums, Progress, ScoredReturns, ScoredRun, Sink, Stage, Watch};

/// Collects the returns of an evaluation as points in each run's world, and passes everything on to
/// another watch.
///
/// Every used return is kept or not by a hash of its scan and its place in it, so that the same returns
/// are kept for every run, whatever the threads; a step through the returns would pick the same beams
/// again and again. The first scans are kept whole besides.
pub(crate) struct CloudWatch<'a> {
    inner: Watch<'a>,
    max_points: usize,
    first_returns: usize,
    /// A return is kept when its hash is at most this.
    kept_up_to: AtomicU64,
    state: Mutex<State>,
}

/// What an evaluation left: one cloud for each run, in its world frame, metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct RunClouds {
    /// For each run, the thinned returns, in order of the log: the k-th is the same return in every run.
    pub(crate) clouds: Vec<Vec<[f64; 3]>>,
    /// For each run, all returns of the first scans, in order of the log.
    pub(crate) first_scans: Vec<Vec<[f64; 3]>>,
    /// How many scans these are.
    pub(crate) first_scan_count: usize,
}

#[derive(Debug, Default)]
struct State {
    frames: BTreeMap<usize, FramePoints>,
    /// The first scans so far.
    whole: BTreeMap<usize, Vec<Vec<[f64; 3]>>>,
}

#[derive(Debug, Default)]
struct FramePoints {
    /// Used returns so far.
    returns: u64,
    /// For each run, those kept.
    kept: Vec<Vec<[f64; 3]>>,
}

impl<'a> CloudWatch<'a> {
    /// Keeps about `max_points` returns of the log, and as many of the first scans whole as it takes for
    /// `first_returns` used returns.
    pub(crate) fn new(inner: impl Into<Watch<'a>>, max_points: usize, first_returns: usize) -> Self {
        let inner = inner.into();
        let kept_up_to = AtomicU64::new(u64::MAX);
        Self { inner, max_points, first_returns, kept_up_to, state: Mutex::default() }
    }

    /// The points, once the evaluation has ended.
    pub(crate) fn finish(self) -> RunClouds {
        let State { frames, whole } = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        let first_scan_count = whole.len();
        RunClouds {
            clouds: join(frames.into_values().map(|frame| frame.kept)),
            first_scans: join(whole.into_values()),
            first_scan_count,
        }
    }
}

/// Parts of every run put behind one another.
fn join(parts: impl Iterator<Item = Vec<Vec<[f64; 3]>>>) -> Vec<Vec<[f64; 3]>> {
    let mut joined: Vec<Vec<[f64; 3]>> = Vec::new();
    for part in parts {
        append(&mut joined, part);
    }
    joined
}

fn append(to: &mut Vec<Vec<[f64; 3]>>, part: Vec<Vec<[f64; 3]>>) {
    to.resize_with(to.len().max(part.len()), Vec::new);
    for (of_run, mut points) in to.iter_mut().zip(part) {
        of_run.append(&mut points);
    }
}

fn points(returns: &ScoredReturns<'_>, kept: impl Fn(usize) -> bool) -> Vec<Vec<[f64; 3]>> {
    let of_run = |run: &ScoredRun<'_>| {
        let kept = (0..run.rays.len()).filter(|&k| kept(k));
        kept.map(|k| run.own_ray(k).endpoint_in_world()).collect()
    };
    returns.runs.iter().map(of_run).collect()
}

impl State {
    /// Whether the scans before this one are not yet enough.
    fn is_first(&self, frame: usize, first_returns: usize) -> bool {
        self.whole.range(..frame).map(|(_, scan)| returns_of(scan)).sum::<usize>() < first_returns
    }

    /// Drops the last of the first scans as long as those before it are enough. What is dropped could
    /// never come back: scans only become more.
    fn prune(&mut self, first_returns: usize) {
        while let Some((&last, _)) = self.whole.last_key_value() {
            if self.is_first(last, first_returns) {
                break;
            }
            self.whole.remove(&last);
        }
    }
}

fn returns_of(scan: &[Vec<[f64; 3]>]) -> usize {
    scan.first().map_or(0, Vec::len)
}

impl Progress for CloudWatch<'_> {
    fn begin(&self, stage: Stage, total: u64) {
        if stage == Stage::Cast {
            let share = if total == 0 { 1.0 } else { self.max_points as f64 / total as f64 };
            // Saturates at the largest: everything is kept.
            self.kept_up_to.store((share * u64::MAX as f64) as u64, Ordering::Relaxed);
        }
        self.inner.progress.begin(stage, total);
    }

    fn advance(&self, amount: u64) {
        self.inner.progress.advance(amount);
    }

    fn cancelled(&self) -> bool {
        self.inner.progress.cancelled()
    }
}

impl Sink for CloudWatch<'_> {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        let count = returns.offsets_ns.len();
        let kept_up_to = self.kept_up_to.load(Ordering::Relaxed);
        let lock = || self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (offset, is_first) = {
            let mut state = lock();
            let frame = state.frames.entry(returns.frame).or_default();
            let offset = frame.returns;
            frame.returns += count as u64;
            (offset, state.is_first(returns.frame, self.first_returns))
        };
        let kept = |k: usize| hash(returns.frame as u64, offset + k as u64) <= kept_up_to;
        let kept = points(returns, kept);
        let whole = is_first.then(|| points(returns, |_| true));
        let mut state = lock();
        append(&mut state.frames.entry(returns.frame).or_default().kept, kept);
        if let Some(whole) = whole {
            append(state.whole.entry(returns.frame).or_default(), whole);
            state.prune(self.first_returns);
        }
        drop(state);
        self.inner.sink.returns_scored(returns);
    }

    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        self.inner.sink.frame_scored(frame, sums);
    }

    fn wants_every_return(&self) -> bool {
        true
    }
}

/// Evenly spread over all integers (the finaliser of splitmix64, twice).
fn hash(frame: u64, index: u64) -> u64 {
    let mix = |mut z: u64| {
        z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    mix(mix(frame) ^ index)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp::Residuals;
    use dmp_sensor::{Isometry3, Ray};

    /// Frame `frame` with its returns split into parts; two runs, one a metre beside the other.
    fn feed(watch: &CloudWatch<'_>, frame: usize, parts: &[usize]) {
        let mut next = 0;
        for &count in parts {
            let ray = |k: usize, y: f64| Ray {
                origin_in_world: [frame as f64, y, 0.0],
                direction_in_world: [0.0, 0.0, 1.0],
                range_m: (next + k) as f64,
            };
            let rays = [0.0, 1.0].map(|y| (0..count).map(|k| ray(k, y)).collect::<Vec<_>>());
            let residuals = vec![Residuals::MISS; count];
            let run = |rays| ScoredRun {
                own_from_sensor: Isometry3::identity(),
                own_from_world: Isometry3::identity(),
                rays,
                residuals: &residuals,
            };
            watch.returns_scored(&ScoredReturns {
                frame,
                ordinal: frame,
                first: next,
                offsets_ns: &vec![0; count],
                runs: &[run(&rays[0]), run(&rays[1])],
            });
            next += count;
        }
    }

    fn collect(max_points: usize, frames: &[(usize, &[usize])]) -> RunClouds {
        let watch = CloudWatch::new((), max_points, 250);
        watch.begin(Stage::Cast, 10_000);
        frames.iter().for_each(|(frame, parts)| feed(&watch, *frame, parts));
        watch.finish()
    }

    #[test]
    fn order_and_parts_do_not_matter() {
        let mut frames: Vec<(usize, &[usize])> = (0..100).map(|k| (3 * k, &[100][..])).collect();
        let one = collect(2000, &frames);
        frames.reverse();
        frames[7].1 = &[1, 60, 39];
        frames.swap(3, 90);
        assert_eq!(one, collect(2000, &frames));
        let kept = one.clouds[0].len();
        assert!((1850..2150).contains(&kept), "{kept}");
        // The same returns in both runs, in order of the log.
        assert!(one.clouds[0].is_sorted_by(|a, b| (a[0], a[2]) < (b[0], b[2])));
        let moved: Vec<[f64; 3]> = one.clouds[0].iter().map(|p| [p[0], 1.0, p[2]]).collect();
        assert_eq!(one.clouds[1], moved);
        // Three scans make 250 returns.
        assert_eq!((one.first_scan_count, one.first_scans[1].len()), (3, 300));
        assert_eq!(one.first_scans[1][299], [6.0, 1.0, 99.0]);
    }

    #[test]
    fn small_logs_are_kept_whole() {
        let frames: Vec<(usize, &[usize])> = (0..100).map(|k| (k, &[100][..])).collect();
        assert_eq!(collect(10_000, &frames).clouds[0].len(), 10_000);
        assert_eq!(collect(1_000_000, &frames).clouds[0].len(), 10_000);
        assert_eq!(collect(0, &frames).clouds[0].len(), 0);
        assert_eq!(collect(5, &[]), RunClouds::default());
    }
}
