//! A drive through a town, or a walk over a campus: when which point of its line is passed.

use std::ops::Range;

use dmp_sensor::{Isometry3, Trajectory, TrajectoryError, Vector3};

use super::motion;
use super::motion::{FORWARD_M_S2, HEIGHT_M, MARGIN_S, SIDEWAYS_M_S2, START_NS, WAVER, require_speed};
use super::path::{Path, STEP_M, hermite};
use super::profile::Profile;
use super::sway::{Stance, Sway, Sways};
use crate::error::{SimError, require};
use crate::random::Random;
use crate::route::Route;
use crate::town::{Town, TownOptions};

/// Speed is the mean over this many stations to either side, twice.
const SMOOTHING: usize = 8;
/// Slow-down on stairs per unit of slope, and share of the slope that becomes pitch: a
/// walker leans, but does not lie on the stairs as a car on a hill.
const EFFORT: f64 = 1.2;
const LEAN: f64 = 0.15;

/// How a [`Drive`] goes.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveOptions {
    /// Seed of the sway and of the small changes of speed and lane.
    pub seed: u64,
    /// Where it goes.
    pub route: Route,
    /// Speed on a straight street, metres per second; in curves it is slower.
    pub speed_m_s: f64,
    /// Length of the drive, seconds.
    pub duration_s: f64,
    /// The instant at which it starts, nanoseconds.
    pub start_ns: i64,
    /// Height of the body frame, which is the sensor's, above ground, metres.
    pub height_m: f64,
}

impl Default for DriveOptions {
    fn default() -> Self {
        let (start_ns, height_m) = (START_NS, HEIGHT_M);
        Self { seed: 1, route: Route::Loop, speed_m_s: 6.0, duration_s: 30.0, start_ns, height_m }
    }
}

impl DriveOptions {
    /// About how far the drive goes in a town of such blocks, curves considered, metres.
    pub fn travel_m(&self, town: &TownOptions) -> f64 {
        // The route depends on the travel and the travel on the route's curves: a few rounds settle it.
        let mut travel_m = self.speed_m_s * self.duration_s;
        for _ in 0..3 {
            let blocks = self.route.blocks(travel_m, town.block_m);
            travel_m = Plan::new(self, &TownOptions { blocks, ..town.clone() }, travel_m)
                .path_m(self.duration_s)
                - MARGIN_S * self.speed_m_s;
        }
        travel_m
    }
}

/// When which point of the line is passed.
#[derive(Debug, Clone)]
struct Plan {
    path: Path,
    /// How high it leads, on foot; a car follows the ground.
    profile: Option<Profile>,
    /// Speed at each station of the path, m/s, and the time after the start at which it is passed, s.
    speeds: Vec<f64>,
    times_s: Vec<f64>,
}

impl Plan {
    fn new(options: &DriveOptions, town: &TownOptions, travel_m: f64) -> Self {
        let length_m = options.speed_m_s * (1.0 + WAVER) * (options.duration_s + 2.0 * MARGIN_S) + 10.0;
        let path = options.route.path(town, travel_m, length_m);
        let waver = Sway::new(WAVER, &mut Random::new(options.seed, &[b'd'.into(), b'v'.into()]));
        let profile = (options.route == Route::Campus).then(|| Profile::of_walk(&path));
        let speeds = speeds(&path, profile.as_ref(), options.speed_m_s, &waver);
        let mut times_s = vec![-MARGIN_S];
        for pair in speeds.windows(2) {
            let before = times_s[times_s.len() - 1];
            times_s.push(before + 2.0 * STEP_M / (pair[0] + pair[1]));
        }
        Self { path, profile, speeds, times_s }
    }

    /// Distance along the path at `time_s` after the start, metres.
    fn path_m(&self, time_s: f64) -> f64 {
        let after = self.times_s.partition_point(|&t| t <= time_s).clamp(1, self.times_s.len() - 1);
        let (t0, t1) = (self.times_s[after - 1], self.times_s[after]);
        let u = ((time_s - t0) / (t1 - t0)).clamp(0.0, 1.0);
        let start_m = (after - 1) as f64 * STEP_M;
        hermite(start_m, self.speeds[after - 1], start_m + STEP_M, self.speeds[after], u, t1 - t0)
    }
}

/// A vehicle's drive through a town, or a walk over a campus: where the body is, and how it lies, at every
/// instant.
#[derive(Debug, Clone)]
pub struct Drive<'a> {
    town: &'a Town,
    options: DriveOptions,
    plan: Plan,
    sways: Sways,
}

impl<'a> Drive<'a> {
    /// Plans the drive through `town`.
    ///
    /// # Errors
    /// When speed or duration are not positive, or beyond what a car does; when no such route leads
    /// through `town`: a car's over a campus, a walk through streets, or one with corners through a tunnel.
    pub fn new(town: &'a Town, options: DriveOptions) -> Result<Self, SimError> {
        let DriveOptions { speed_m_s, duration_s, height_m, .. } = options;
        require_speed(speed_m_s)?;
        require(
            duration_s > 0.0 && duration_s <= 1e5,
            "the length of the drive in s",
            "up to 100000",
            duration_s,
        )?;
        require((0.2..=10.0).contains(&height_m), "the sensor's height in m", "from 0.2 to 10", height_m)?;
        let on_foot = options.route == Route::Campus;
        if !town.has(options.route) {
            return Err(SimError::OtherPlace { route: options.route });
        }
        let plan = Plan::new(&options, town.options(), options.travel_m(town.options()));
        let sways = if on_foot { Sways::of_walker(options.seed) } else { Sways::of_car(options.seed) };
        Ok(Self { town, options, plan, sways })
    }

    /// How it goes.
    pub fn options(&self) -> &DriveOptions {
        &self.options
    }

    /// The body's pose at an instant. From 2 s before the start to 2 s after the end it moves, before
    /// and after that it all but stands.
    pub fn world_from_body_at(&self, stamp_ns: i64) -> Isometry3<f64> {
        let time_s = motion::time_s(stamp_ns, self.options.start_ns, self.options.duration_s);
        let path_m = self.plan.path_m(time_s);
        let at = self.plan.path.at(path_m);
        let on_map = self.sways.on_map(&at, path_m);
        let stance = if let Some(profile) = &self.plan.profile {
            let (floor_m, slope) = profile.at(path_m);
            Stance { floor_m, pitch: -LEAN * libm::atan(slope), roll: 0.0 }
        } else {
            let [x, y, yaw] = on_map;
            Stance::on_ground(self.town.ground_m(x, y), self.town.slope(x, y), yaw)
        };
        self.sways.pose(on_map, &stance, self.options.height_m, time_s)
    }

    /// Distance along its line at `time_s` after the start, metres.
    pub(crate) fn path_m(&self, time_s: f64) -> f64 {
        self.plan.path_m(time_s)
    }

    /// The ground `left_m` to the left of its line, and the direction of the line there.
    pub(crate) fn beside_line(&self, path_m: f64, left_m: f64) -> (Vector3<f64>, f64) {
        let at = self.plan.path.at(path_m);
        let (sin, cos) = libm::sincos(at.heading_rad);
        let [x, y] = [at.x - sin * left_m, at.y + cos * left_m];
        (Vector3::new(x, y, self.town.ground_m(x, y)), at.heading_rad)
    }

    /// The true trajectory, `rate_hz` poses a second from just before the start to just after the end.
    ///
    /// Interpolated at 20 poses a second it is true to 1 mm and 0.3 mrad.
    ///
    /// # Errors
    /// When the rate is below 1 Hz or above 10 kHz.
    pub fn trajectory(&self, rate_hz: f64) -> Result<Trajectory, SimError> {
        let stamps_ns = motion::pose_stamps_ns(self.options.start_ns, self.options.duration_s, rate_hz)?;
        let poses = stamps_ns.map(|stamp_ns| (stamp_ns, self.world_from_body_at(stamp_ns)));
        Ok(sorted(Trajectory::stamped(poses.collect()).map(|repaired| repaired.trajectory)))
    }
}

/// The stamps of a drive ascend and are never empty; an error here would be a mistake of this crate.
fn sorted(trajectory: Result<Trajectory, TrajectoryError>) -> Trajectory {
    match trajectory {
        Ok(trajectory) => trajectory,
        Err(error) => unreachable!("stamps ascend by construction: {error}"),
    }
}

/// The indices within `reach` of `k`, of `count`.
fn around(k: usize, reach: usize, count: usize) -> Range<usize> {
    k.saturating_sub(reach)..(k + reach + 1).min(count)
}

/// Speeds at the stations: the requested one, as far as curves, stairs and gentle acceleration allow.
fn speeds(path: &Path, profile: Option<&Profile>, speed_m_s: f64, waver: &Sway) -> Vec<f64> {
    let limit = |(k, curvature): (usize, f64)| {
        let wanted = speed_m_s * (1.0 + waver.at(k as f64 * STEP_M / 60.0));
        let effort = profile.map_or(0.0, |profile| EFFORT * profile.slope(k).abs());
        (wanted / (1.0 + effort)).min(libm::sqrt(SIDEWAYS_M_S2 / curvature.abs().max(1e-9)))
    };
    let curvatures = path.stations().iter().map(|station| station.curvature);
    let limits: Vec<f64> = curvatures.enumerate().map(limit).collect();
    // The slowest within reach of the smoothing below: what is smoothed then stays within the limits.
    let slowest =
        |k: usize| limits[around(k, 2 * SMOOTHING, limits.len())].iter().copied().fold(f64::MAX, f64::min);
    let mut speeds: Vec<f64> = (0..limits.len()).map(slowest).collect();
    let reachable = |from: f64| libm::sqrt(from * from + 2.0 * FORWARD_M_S2 * STEP_M);
    for k in 1..speeds.len() {
        speeds[k] = speeds[k].min(reachable(speeds[k - 1]));
    }
    for k in (1..speeds.len()).rev() {
        speeds[k - 1] = speeds[k - 1].min(reachable(speeds[k]));
    }
    for _ in 0..2 {
        let mean = |k: usize| {
            let near = &speeds[around(k, SMOOTHING, speeds.len())];
            near.iter().sum::<f64>() / near.len() as f64
        };
        speeds = (0..speeds.len()).map(mean).collect();
    }
    speeds
}

#[cfg(test)]
mod tests;
