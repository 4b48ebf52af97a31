//! Which returns of which scans a later pass needs.

use dmp_reduce::FrameSet;
use dmp_runs::{PlannedFrame, ReturnDraw, drawn_by};
use dmp_sensor::Scan;

use crate::passes::plan::Plan;
use crate::passes::survey::spread;

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
    pub(crate) fn of(plan: &Plan) -> Self {
        let scans = plan.frames().len();
        let scans: FrameSet =
            spread(scans, FEWEST_FOLLOWED.max(scans / SCANS_PER_FOLLOWED)).into_iter().collect();
        let one_in = (plan.returns_of(&scans) / FEWEST_RAYS).clamp(1, RETURNS_PER_RAY);
        Self { scans, one_in }
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

    /// About how many returns of all are kept.
    pub(crate) fn share(&self, plan: &Plan, all: u64) -> f64 {
        match self {
            Self::ToFollow(Followed { scans, one_in }) => {
                plan.returns_of(scans) as f64 / *one_in as f64 / all.max(1) as f64
            }
            Self::ToCast(draw) => 1.0 / draw.one_in() as f64,
        }
    }
}
