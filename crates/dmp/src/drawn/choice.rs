//! Which returns of which scans a later pass needs.

use dmp_reduce::FrameSet;
use dmp_runs::{PlannedFrame, ReturnDraw, drawn_by};
use dmp_sensor::Scan;

/// The rays of one scan in so many are followed, and of no fewer scans than these.
const SCANS_PER_FOLLOWED: usize = 8;
const FEWEST_FOLLOWED: usize = 50;

/// Of them, one return in so many is followed, or as many more as make so many rays.
const RETURNS_PER_RAY: u64 = 7;
const FEWEST_RAYS: u64 = 250_000;

/// The returns of a plan that are chosen.
#[derive(Debug)]
pub(crate) enum Choice {
    /// Those that are followed through the maps, to find what moved.
    ToFollow(Followed),
    /// Those that are cast, of every scan.
    ToCast(ReturnDraw),
}

/// The rays that are followed, by the log alone: no part of a score and no run changes them.
#[derive(Debug)]
pub(crate) struct Followed {
    /// Evenly spread over those of the log.
    pub(crate) scans: FrameSet,
    /// One of so many returns, by its coordinates.
    pub(crate) one_in: u64,
}

impl Followed {
    /// Those of these scans.
    pub(crate) fn of(frames: &[PlannedFrame]) -> Self {
        let scans = spread(frames.len(), FEWEST_FOLLOWED.max(frames.len() / SCANS_PER_FOLLOWED));
        let returns: u64 = scans.iter().map(|&ordinal| frames[ordinal].returns).sum();
        let one_in = (returns / FEWEST_RAYS).clamp(1, RETURNS_PER_RAY);
        Self { scans: scans.into_iter().collect(), one_in }
    }
}

impl Choice {
    /// The places of the chosen returns in a scan; `None` where none is wanted of it.
    pub(super) fn of_scan(
        &self,
        (ordinal, frame): (usize, &PlannedFrame),
        scan: &Scan,
    ) -> Option<Vec<usize>> {
        match self {
            Self::ToFollow(Followed { scans, one_in }) => scans.contains(ordinal).then(|| {
                let points = scan.points_in_sensor_m.iter().enumerate();
                let is_chosen = |point: [f32; 3]| drawn_by(point).is_multiple_of(*one_in);
                points.filter(|&(_, &point)| is_chosen(point)).map(|(place, _)| place).collect()
            }),
            Self::ToCast(draw) => Some(draw.of_scan(frame.number, scan.len()).collect()),
        }
    }

    /// About which share of the returns is kept.
    pub(crate) fn share(&self) -> f64 {
        match self {
            Self::ToFollow(followed) => 1.0 / (SCANS_PER_FOLLOWED as u64 * followed.one_in) as f64,
            Self::ToCast(draw) => 1.0 / draw.one_in() as f64,
        }
    }
}

/// Up to `count` of `total` ordinals, evenly spread.
pub(crate) fn spread(total: usize, count: usize) -> Vec<usize> {
    let count = count.min(total);
    (0..count).map(|k| k * total / count).collect()
}
