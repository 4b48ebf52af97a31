//! The simulated drives of the study: four on which settings were chosen, four that were held out.

use anyhow::Context as _;
use dmp_sensor::Trajectory;
use dmp_sim::{LidarOptions, Recording, RecordingOptions, Route, Scenery, SimError, Town};

/// Speed of a car on a straight street and of a walker, m/s.
const CAR_M_S: f64 = 9.0;
const WALK_M_S: f64 = 1.3;
/// Standard deviation of the bearings where they have any.
const BEARING_NOISE_DEG: f64 = 0.05;
/// Cars in the streets of a drive with traffic.
const TRAFFIC: usize = 24;

/// What a drive may be used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Half {
    /// Thresholds and settings were looked at on these.
    Chosen,
    /// Nothing was chosen by these: they show whether a choice holds.
    HeldOut,
}

/// A drive of the suite.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DriveSpec {
    /// Its name: the place, then the beams.
    pub(super) name: &'static str,
    /// What it may be used for.
    pub(super) half: Half,
    /// What is special about it.
    pub(super) about: &'static str,
    /// All that the simulation needs.
    pub(super) options: RecordingOptions,
    /// What stands along its streets.
    pub(super) scenery: Scenery,
    /// Poses of the truth for each scan: one where the motion within a scan is nearly even, more for a gait.
    pub(super) poses_per_scan: usize,
}

impl DriveSpec {
    /// The town that it leads through.
    pub(super) fn town(&self) -> Result<Town, SimError> {
        self.options.town_of(self.scenery)
    }

    /// The true trajectory: a pose at the start of every sweep, or several a sweep, and one at the end of the
    /// last. Interpolated, it is true to a few millimetres.
    pub(super) fn truth(&self, recording: &Recording<'_>) -> anyhow::Result<Trajectory> {
        let drive = recording.drive();
        let count = recording.len() * self.poses_per_scan;
        let rate_hz = self.options.lidar.rate_hz * self.poses_per_scan as f64;
        let stamp_ns = |k: usize| drive.options().start_ns + (k as f64 * 1e9 / rate_hz).round() as i64;
        let poses = (0..=count).map(stamp_ns).map(|stamp_ns| (stamp_ns, drive.world_from_body_at(stamp_ns)));
        Ok(Trajectory::stamped(poses.collect()).context("stamps ascend")?.trajectory)
    }

    /// Time between the starts of two scans, nanoseconds.
    pub(super) fn scan_period_ns(&self) -> i64 {
        (1e9 / self.options.lidar.rate_hz).round() as i64
    }
}

/// All eight, the chosen ones first.
pub(super) fn drives() -> Vec<DriveSpec> {
    use Half::{Chosen, HeldOut};
    let noisy = |drive: DriveSpec| {
        let mut drive = drive;
        drive.options.lidar.bearing_noise_rad = BEARING_NOISE_DEG.to_radians();
        drive
    };
    let busy = |drive: DriveSpec| {
        let mut drive = drive;
        drive.options.traffic = TRAFFIC;
        drive
    };
    vec![
        car("loop-64", Chosen, "a lap and a half", 11, Route::Loop, [1000, 64, 96]),
        car("oneway-32", Chosen, "no street twice", 12, Route::OneWay, [1000, 32, 192]),
        busy(car("laps-16", Chosen, "two laps in traffic", 13, Route::TwoLaps, [1080, 16, 340])),
        walk("campus-32", Chosen, "on foot, stairs and passages", 14, [1640, 32, 100]),
        car("loop-128", HeldOut, "a lap and a half of another town", 21, Route::Loop, [1000, 128, 48]),
        car("opposite-32", HeldOut, "back in the opposite lane", 22, Route::OutAndBack, [1000, 32, 192]),
        busy(noisy(car(
            "laps-64",
            HeldOut,
            "two laps in traffic, bearings off",
            23,
            Route::TwoLaps,
            [1080, 64, 90],
        ))),
        noisy(car("bigloop-16", HeldOut, "one large lap, bearings off", 24, Route::Ring, [1100, 16, 360])),
    ]
}

/// A drive by car at 10 scans a second: number of scans, beams and firings in a turn.
fn car(
    name: &'static str,
    half: Half,
    about: &'static str,
    seed: u64,
    route: Route,
    [scans, beams, azimuth_steps]: [usize; 3],
) -> DriveSpec {
    let lidar = LidarOptions { azimuth_steps, ..LidarOptions::with_beams(beams) };
    let options = RecordingOptions { seed, scans, route, speed_m_s: CAR_M_S, traffic: 0, lidar };
    DriveSpec { name, half, about, options, scenery: Scenery::default(), poses_per_scan: 1 }
}

/// Drives out along a street and back, whose places look alike. They are no part of the suite.
fn look_alikes() -> [DriveSpec; 2] {
    let street = |name, about, seed, scenery| {
        let drive = car(name, Half::HeldOut, about, seed, Route::Straight, [800, 32, 192]);
        DriveSpec { scenery, ..drive }
    };
    [
        street("alike-32", "the same house again every 8 m", 31, Scenery::Alike { period_m: 8.0 }),
        street("tunnel-32", "a bare tunnel", 32, Scenery::Tunnel),
    ]
}

/// A walk at 5 scans a second.
fn walk(name: &'static str, half: Half, about: &'static str, seed: u64, size: [usize; 3]) -> DriveSpec {
    let mut drive = car(name, half, about, seed, Route::Campus, size);
    drive.options.speed_m_s = WALK_M_S;
    drive.options.lidar.rate_hz = 5.0;
    DriveSpec { poses_per_scan: 4, ..drive }
}

/// The drive of a name, of the suite or not.
pub(super) fn find(name: &str) -> anyhow::Result<DriveSpec> {
    let all: Vec<DriveSpec> = drives().into_iter().chain(look_alikes()).collect();
    let names: Vec<_> = all.iter().map(|drive| drive.name).collect();
    let unknown = format!("{name}: no such drive; the drives are {}", names.join(", "));
    all.into_iter().find(|drive| drive.name == name).context(unknown)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn four_drives_were_chosen_and_four_held_out_each_in_a_place_of_its_own() {
        let drives = drives();
        let names: BTreeSet<_> = drives.iter().map(|drive| drive.name).collect();
        let seeds: BTreeSet<_> = drives.iter().map(|drive| drive.options.seed).collect();
        assert_eq!((names.len(), seeds.len()), (8, 8));
        assert_eq!(drives.iter().filter(|drive| drive.half == Half::Chosen).count(), 4);
    }

    #[test]
    fn drives_are_as_long_and_come_back_as_often_as_they_say() {
        for spec in drives() {
            let town = spec.town().unwrap();
            let recording = Recording::new(&town, &spec.options).unwrap();
            let (travel_m, revisits) = recording.travel_and_revisits();
            let on_foot = spec.options.route == Route::Campus;
            let expected_m = if on_foot { 350.0..400.0 } else { 530.0..840.0 };
            assert!(expected_m.contains(&travel_m), "{}: {travel_m} m", spec.name);
            let expected = match spec.options.route {
                Route::OneWay => 0.0..0.001,
                Route::Ring => 0.01..0.06,
                Route::TwoLaps => 0.45..0.6,
                _ => 0.3..0.5,
            };
            assert!(expected.contains(&revisits), "{}: {revisits}", spec.name);
            let lidar = &spec.options.lidar;
            let fired = lidar.beams * lidar.azimuth_steps * spec.options.scans;
            assert!((5_000_000..6_500_000).contains(&fired), "{}: {fired} beams fired", spec.name);
        }
    }

    #[test]
    fn the_truth_interpolates_to_millimetres_and_covers_every_scan() {
        for spec in drives() {
            let town = spec.town().unwrap();
            let recording = Recording::new(&town, &spec.options).unwrap();
            let truth = spec.truth(&recording).unwrap();
            let start_ns = recording.drive().options().start_ns;
            let end_ns = start_ns + spec.scan_period_ns() * spec.options.scans as i64;
            let (mut worst_m, mut worst_rad) = (0.0, 0.0);
            for stamp_ns in (start_ns..=end_ns).step_by(23_456_789) {
                let between = truth.world_from_body_at(stamp_ns, i64::MAX).unwrap();
                let exact = recording.drive().world_from_body_at(stamp_ns);
                let apart = between.inv_mul(&exact);
                worst_m = f64::max(worst_m, apart.translation.vector.norm());
                worst_rad = f64::max(worst_rad, apart.rotation.angle());
            }
            assert!(truth.world_from_body_at(end_ns, i64::MAX).is_some());
            assert!(worst_m < 0.006 && worst_rad < 0.002, "{}: {worst_m} m, {worst_rad} rad", spec.name);
        }
    }
}
