//! The keyframes of a drive.

use dmp_sensor::{Isometry3, Trajectory};

use crate::error::SimError;

/// Tolerance for rounding of the summed steps, metres.
const ROUNDING_M: f64 = 1e-9;

/// How far keyframes are from each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spacing {
    /// Travel from one to the next, metres.
    pub(super) travel_m: f64,
    /// Or the turn, radians.
    pub(super) turn_rad: f64,
}

/// The true poses at the keyframes of a drive, in order of time. At least one.
pub(super) struct Keyframes {
    pub(super) stamps_ns: Vec<i64>,
    /// `world_from_body`.
    pub(super) poses: Vec<Isometry3<f64>>,
    /// Path length from the first keyframe to each, metres, with all that lies between them. Never falls.
    pub(super) travel_m: Vec<f64>,
}

impl Keyframes {
    /// The first instant, and each that is at least a spacing of travel or of turn from the keyframe before it. Travel is summed up over all instants.
    pub(super) fn choose(
        truth: &Trajectory,
        spacing: Spacing,
        instants_ns: Option<&[i64]>,
    ) -> Result<Self, SimError> {
        let mut keyframes = Self { stamps_ns: Vec::new(), poses: Vec::new(), travel_m: Vec::new() };
        let (mut travel_m, mut last) = (0.0, None);
        for (stamp_ns, pose) in instants(truth, instants_ns)? {
            travel_m += last.map_or(0.0, |last: Isometry3<f64>| {
                (pose.translation.vector - last.translation.vector).norm()
            });
            last = Some(pose);
            let since = keyframes.travel_m.last().map(|of_last| travel_m - of_last);
            let turned =
                keyframes.poses.last().map_or(0.0, |before| before.rotation.angle_to(&pose.rotation));
            if since.is_none_or(|since_m| since_m >= spacing.travel_m - ROUNDING_M)
                || turned >= spacing.turn_rad
            {
                keyframes.stamps_ns.push(stamp_ns);
                keyframes.poses.push(pose);
                keyframes.travel_m.push(travel_m);
            }
        }
        if keyframes.poses.is_empty() { Err(SimError::NoInstants) } else { Ok(keyframes) }
    }

    pub(super) fn len(&self) -> usize {
        self.poses.len()
    }
}

/// The true poses at all instants that may be keyframes.
fn instants(truth: &Trajectory, given_ns: Option<&[i64]>) -> Result<Vec<(i64, Isometry3<f64>)>, SimError> {
    let stamps_ns = truth.stamps_ns().ok_or(SimError::NoStamps)?;
    let Some(given_ns) = given_ns else {
        return Ok(stamps_ns.iter().copied().zip(truth.poses().iter().copied()).collect());
    };
    let mut given_ns = given_ns.to_vec();
    given_ns.sort_unstable();
    given_ns.dedup();
    let max_gap_ns = truth.usual_gap_ns();
    let pose = |stamp_ns| {
        let pose = truth.world_from_body_at(stamp_ns, max_gap_ns);
        pose.map(|pose| (stamp_ns, pose)).ok_or(SimError::NoPose { stamp_ns })
    };
    given_ns.into_iter().map(pose).collect()
}
