//! What a front end measures of a loop, and what is wrong with it.

use std::f64::consts::{PI, TAU};
use std::fmt;

use dmp_lengths::LoopLengths;
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph, UnitQuaternion, Vector3};

use super::keyframes::Keyframes;
use crate::random::Random;

const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

/// Error of every loop measurement about each axis.
const SIGMA_RAD: f64 = 0.2 * RAD_PER_DEG;
/// What all of them claim to be off by: the front end does not know better.
const CLAIMED_SIGMA_RAD: f64 = 0.5 * RAD_PER_DEG;
/// How far the headings of two places which look alike differ from those of one street.
const ALIKE_WITHIN_RAD: f64 = 3.0 * RAD_PER_DEG;
/// Standard deviation of the direction in which it is off, from that of travel.
const NEAR_SIGMA_RAD: f64 = 15.0 * RAD_PER_DEG;

/// What a simulated loop candidate is, with the lengths of a drive; in a room it is the same with other [`LoopLengths`], and a
/// camera at one place also looks the same way.
///
/// As text (`Display`): `true`, `false`, `near`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoopKind {
    /// Two keyframes within 8 m of each other, with more than 100 m of travel between them, measured to 0.05 m and
    /// 0.2° about each axis.
    True,
    /// Two keyframes more than 40 m from each other, with more than 100 m of travel between them, measured as if
    /// they were at one place of a street: at most 2 m apart in the plane, heading the same way or the opposite one
    /// to 3°. Two streets look alike.
    False,
    /// As a true one, but off by 3 to 10 m, mostly along the path: a street looks alike all along.
    Near,
}

impl LoopKind {
    /// Whether a graph should have it.
    pub fn is_true(self) -> bool {
        self == Self::True
    }
}

impl fmt::Display for LoopKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::True => "true",
            Self::False => "false",
            Self::Near => "near",
        })
    }
}

/// A loop candidate, and what it is.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedLoop {
    /// The measurement, from the earlier vertex to the later one.
    pub edge: PoseEdge,
    /// What it is.
    pub kind: LoopKind,
}

/// Measures loops of a drive.
pub(super) struct Measurer<'a> {
    pub(super) keyframes: &'a Keyframes,
    pub(super) lengths: LoopLengths,
    pub(super) random: Random,
}

impl Measurer<'_> {
    pub(super) fn measure(&mut self, from: usize, to: usize, kind: LoopKind) -> SimulatedLoop {
        let truly = self.keyframes.poses[from].inv_mul(&self.keyframes.poses[to]);
        let seen = match kind {
            LoopKind::True => truly,
            LoopKind::False => self.as_if_here(),
            LoopKind::Near => Isometry3::from(self.along_the_way(from)) * truly,
        };
        let from_from_to = seen * off_by(&mut self.random, self.lengths.sigma_m, SIGMA_RAD, Vector3::zeros());
        let information = PoseGraph::information_of(self.lengths.claimed_sigma_m, CLAIMED_SIGMA_RAD);
        let edge = PoseEdge { from: from as i64, to: to as i64, from_from_to, information };
        SimulatedLoop { edge, kind }
    }

    /// A pose near the identity, or near one that looks back where that sees the same.
    fn as_if_here(&mut self) -> Isometry3<f64> {
        // Within what noise may add, evenly over the disc.
        let radius_m = (self.lengths.alike_within_m - 8.0 * self.lengths.sigma_m) * self.random.unit().sqrt();
        let angle = TAU * self.random.unit();
        let [up, ahead] = up_and_ahead(&self.lengths);
        let place = ahead * (radius_m * libm::cos(angle)) + up.cross(&ahead) * (radius_m * libm::sin(angle));
        let looks_back = self.random.chance(0.5) && self.lengths.views.is_none();
        let back = if looks_back { PI } else { 0.0 };
        let within = ALIKE_WITHIN_RAD - 8.0 * SIGMA_RAD;
        let yaw = back + self.random.between(-within, within);
        Isometry3::from_parts(place.into(), UnitQuaternion::from_scaled_axis(up * yaw))
    }

    /// A shift along the path at a keyframe, in its frame.
    fn along_the_way(&mut self, at: usize) -> Vector3<f64> {
        let poses = &self.keyframes.poses;
        let (before, after) = (at.saturating_sub(1), (at + 1).min(poses.len() - 1));
        let ahead = poses[after].translation.vector - poses[before].translation.vector;
        let ahead =
            ahead.try_normalize(1e-9).unwrap_or_else(|| poses[at].rotation * up_and_ahead(&self.lengths)[1]);
        let aside = UnitQuaternion::from_scaled_axis(Vector3::z() * (NEAR_SIGMA_RAD * self.random.normal()));
        let sign = if self.random.chance(0.5) { -1.0 } else { 1.0 };
        let length_m = self.random.between(self.lengths.near_m[0], self.lengths.near_m[1]);
        poses[at].rotation.inverse() * (aside * ahead) * (sign * length_m)
    }
}

/// Which way is up in the body, and ahead.
pub(super) fn up_and_ahead(lengths: &LoopLengths) -> [Vector3<f64>; 2] {
    if lengths.views.is_some() { [-Vector3::y(), Vector3::z()] } else { [Vector3::z(), Vector3::x()] }
}

/// A small pose: a normal shift, and a normal turn beside a given one.
pub(super) fn off_by(
    random: &mut Random,
    sigma_m: f64,
    sigma_rad: f64,
    turn: Vector3<f64>,
) -> Isometry3<f64> {
    let shift = Vector3::from_fn(|_, _| sigma_m * random.normal());
    let turn = turn + Vector3::from_fn(|_, _| sigma_rad * random.normal());
    Isometry3::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn))
}
