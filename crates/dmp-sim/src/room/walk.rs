//! A walk through a room with a camera in the hand.

use std::f64::consts::{PI, TAU};

use dmp_sensor::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::furnished::Room;
use crate::error::{SimError, require};
use crate::random::Random;
use crate::ways::Sway;

/// Directions from the middle of the walk in which the room's width is known.
const DIRECTIONS: usize = 360;
/// A walk keeps so far from what stands between these heights, and from walls, metres.
const APART_M: f64 = 0.62;
const HEIGHTS_M: [f64; 2] = [0.85, 2.05];
/// It goes no farther from its middle than this, and needs this much room, metres.
const FARTHEST_M: f64 = 2.6;
const NEAREST_M: f64 = 0.5;
/// Steps in which room is looked for, metres.
const STEP_M: f64 = 0.02;
/// The path is the mean of the room over this many directions to either side.
const SMOOTHING: usize = 24;
/// The second round is smaller by this share, halfway through the walk.
const SMALLER: f64 = 0.12;
/// Height of the camera above the floor and how far it goes up and down, metres.
const HEIGHT_M: f64 = 1.42;
const RISE_M: f64 = 0.12;
/// Where the camera looks, from straight away from the middle to the left: on the mean, and how far it sweeps.
const ASIDE_RAD: f64 = 1.25;
const SWEEP_RAD: f64 = 0.75;
/// It looks down by this much, and nods by this much.
const DOWN_RAD: f64 = 0.16;
const NOD_RAD: f64 = 0.2;
/// Of the hand: metres and radians.
const HAND_M: f64 = 0.01;
const HAND_RAD: f64 = 0.012;
/// Share of a round that a walk goes which sees everything once.
const ONCE: f64 = 0.62;

/// How a camera is carried through a room.
#[derive(Debug, Clone, PartialEq)]
pub struct RoomWalkOptions {
    /// Seed of the path and of the hand's sway.
    pub seed: u64,
    /// Time from start to end, seconds.
    pub duration_s: f64,
    /// The instant at which it starts, nanoseconds.
    pub start_ns: i64,
    /// Whether it goes two rounds and ends where it began, looking the same way; otherwise a part of a round,
    /// looking outwards, with everything passed once.
    pub revisit: bool,
}

/// The path of a hand-held camera through a [`Room`]: where it is at every instant.
#[derive(Debug, Clone)]
pub struct RoomWalk {
    options: RoomWalkOptions,
    middle: [f64; 2],
    /// Distance of the path from the middle, by direction.
    radii_m: Vec<f64>,
    /// Direction from the middle at the start, and phases of rise, sweep and nod.
    start_rad: f64,
    phases: [f64; 3],
    hand: [Sway; 6],
}

impl RoomWalk {
    /// Plans the walk: round the middle of the room, as far from it as what stands along the walls allows.
    ///
    /// # Errors
    /// When the duration is not positive, or there is no room to walk in.
    pub fn new(room: &Room, options: RoomWalkOptions) -> Result<Self, SimError> {
        let duration_s = options.duration_s;
        require(
            duration_s > 0.0 && duration_s <= 1e6,
            "the length of the walk in s",
            "up to 1000000",
            duration_s,
        )?;
        let mut random = Random::new(options.seed, &[b'r'.into(), b'w'.into()]);
        let [width, depth, _] = room.options.size_m;
        // South of the middle: a corner that is cut out, or a dividing wall, lies in the north.
        let middle = [width * random.between(0.46, 0.5), depth * random.between(0.4, 0.44)];
        let free_m: Vec<f64> =
            (0..DIRECTIONS).map(|k| free_m(room, middle, k as f64 * TAU / DIRECTIONS as f64)).collect();
        let radii_m = smoothed(&free_m);
        let least_m = radii_m.iter().copied().fold(f64::INFINITY, f64::min);
        require(least_m >= NEAREST_M, "the room to walk in, from its middle, in m", "0.5 or more", least_m)?;
        let start_rad = random.between(0.0, TAU);
        let phases = [0; 3].map(|_| random.between(0.0, TAU));
        let hand =
            [HAND_M, HAND_M, HAND_M, HAND_RAD, HAND_RAD, HAND_RAD].map(|size| Sway::new(size, &mut random));
        Ok(Self { options, middle, radii_m, start_rad, phases, hand })
    }

    /// The camera's pose at an instant: z ahead, x right, y down. Before the start and after the end it stands.
    pub fn world_from_camera_at(&self, stamp_ns: i64) -> Isometry3<f64> {
        let RoomWalkOptions { duration_s, start_ns, revisit, .. } = self.options;
        let time_s = (stamp_ns.saturating_sub(start_ns) as f64 * 1e-9).clamp(0.0, duration_s);
        let share = time_s / duration_s;
        let rounds = if revisit { 2.0 } else { ONCE };
        let direction = self.start_rad + TAU * rounds * share;
        let half_way = libm::sin(PI * share);
        let radius_m = self.radius_m(direction) * (1.0 - SMALLER * half_way * half_way);
        let wave = |times: f64, k: usize| libm::sin(TAU * times * share + self.phases[k]);
        let (sin, cos) = libm::sincos(direction);
        let hand: [f64; 6] = std::array::from_fn(|k| self.hand[k].at(time_s));
        let place = Translation3::new(
            self.middle[0] + radius_m * cos + hand[0],
            self.middle[1] + radius_m * sin + hand[1],
            HEIGHT_M + RISE_M * wave(3.0, 0) + hand[2],
        );
        let (aside, sweep) =
            if revisit { (ASIDE_RAD, SWEEP_RAD) } else { (0.25 * ASIDE_RAD, 0.2 * SWEEP_RAD) };
        let yaw = direction + aside + sweep * wave(if revisit { 4.0 } else { 2.0 }, 1) + hand[3];
        let pitch = DOWN_RAD + NOD_RAD * wave(5.0, 2) + hand[4];
        let body = UnitQuaternion::from_euler_angles(hand[5], pitch, yaw);
        Isometry3::from_parts(place, body * body_from_camera())
    }

    fn radius_m(&self, direction: f64) -> f64 {
        let at = libm::fmod(direction, TAU) / TAU * DIRECTIONS as f64;
        let at = if at < 0.0 { at + DIRECTIONS as f64 } else { at };
        let (k, u) = (at as usize % DIRECTIONS, at - libm::floor(at));
        self.radii_m[k] * (1.0 - u) + self.radii_m[(k + 1) % DIRECTIONS] * u
    }
}

/// x right, y down, z ahead, as seen from x ahead, y left, z up.
fn body_from_camera() -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(0.5, -0.5, 0.5, -0.5))
}

/// How far one can go from the middle in a direction and stay away from everything, metres.
fn free_m(room: &Room, middle: [f64; 2], direction: f64) -> f64 {
    let (sin, cos) = libm::sincos(direction);
    let at = |k: usize| k as f64 * STEP_M;
    let free = |&k: &usize| is_free(room, [middle[0] + at(k) * cos, middle[1] + at(k) * sin]);
    let steps = (1..=(FARTHEST_M / STEP_M) as usize).take_while(free);
    steps.last().map_or(0.0, at)
}

/// Whether nothing that stands as high as a camera is carried is near a place, by the bounds of what there is.
fn is_free(room: &Room, [x, y]: [f64; 2]) -> bool {
    room.bounds.iter().all(|(low, high)| {
        let beside = |at: f64, k: usize| (low[k] - at).max(at - high[k]).max(0.0);
        low.z > HEIGHTS_M[1] || high.z < HEIGHTS_M[0] || libm::hypot(beside(x, 0), beside(y, 1)) > APART_M
    })
}

/// The smallest of the radii around each, smoothed thrice over less than that: never larger than they are.
fn smoothed(free_m: &[f64]) -> Vec<f64> {
    let count = free_m.len();
    let around = |k: usize, reach: usize| (0..=2 * reach).map(move |n| (k + count + n - reach) % count);
    let least = |k: usize| around(k, 3 * SMOOTHING).map(|n| free_m[n]).fold(f64::INFINITY, f64::min);
    let mut radii_m: Vec<f64> = (0..count).map(least).collect();
    for _ in 0..3 {
        let mean =
            |k: usize| around(k, SMOOTHING).map(|n| radii_m[n]).sum::<f64>() / (2 * SMOOTHING + 1) as f64;
        radii_m = (0..count).map(mean).collect();
    }
    radii_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::Vector3;

    #[test]
    fn the_camera_looks_ahead_with_x_right_and_y_down() {
        let axes = body_from_camera();
        assert!((axes * Vector3::z() - Vector3::x()).norm() < 1e-12);
        assert!((axes * Vector3::x() + Vector3::y()).norm() < 1e-12);
        assert!((axes * Vector3::y() + Vector3::z()).norm() < 1e-12);
    }
}
