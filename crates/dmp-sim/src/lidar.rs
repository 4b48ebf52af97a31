//! A LiDAR, and its scans of a drive through a town.

use std::f64::consts::{PI, TAU};

use dmp_sensor::{Scan, Vector3};

use crate::company::{self, Companion};
use crate::error::SimError;
use crate::lidar_options::{LidarOptions, Sweep};
use crate::parts::solid::Hit;
use crate::random::Random;
use crate::town::Town;
use crate::ways::Drive;

/// The range at which a LiDAR sees "at most" is given for a surface that is this bright, seen straight on.
const NOMINAL_REFLECTIVITY: f64 = 0.8;

/// Scans that are measured at the same time, on all threads, and held in memory together.
pub(crate) const BATCH: usize = 16;

/// A LiDAR that turns about its z axis, counter-clockwise from the rear (−x), and measures as it moves.
#[derive(Debug, Clone)]
pub struct Lidar {
    options: LidarOptions,
    /// Sine and cosine of each beam's elevation.
    elevations: Vec<(f64, f64)>,
}

impl Lidar {
    /// A sensor as described.
    ///
    /// # Errors
    /// When a number is outside what a sensor can be: no beams, a negative noise, …
    pub fn new(options: LidarOptions) -> Result<Self, SimError> {
        options.check()?;
        let LidarOptions { beams, elevation_rad: [low, high], .. } = options;
        let step = if beams > 1 { (high - low) / (beams - 1) as f64 } else { 0.0 };
        let elevations = (0..beams).map(|beam| libm::sincos(low + step * beam as f64)).collect();
        Ok(Self { options, elevations })
    }

    /// What it is like.
    pub fn options(&self) -> &LidarOptions {
        &self.options
    }

    /// Sine and cosine of each beam's elevation, lowest first.
    pub(crate) fn elevations(&self) -> &[(f64, f64)] {
        &self.elevations
    }

    /// When sweep number `index` of a drive starts.
    pub fn stamp_ns(&self, start_ns: i64, index: usize) -> i64 {
        start_ns + libm::round(index as f64 * 1e9 / self.options.rate_hz) as i64
    }

    /// Sweep number `index` of a drive through `town`, with the sensor in the body frame. Its stamp is the
    /// start of the sweep; the returns are in the order in which they were made.
    pub fn scan(&self, town: &Town, drive: &Drive<'_>, index: usize) -> Scan {
        self.scan_among(town, drive, &[], index).0
    }

    /// The same among companions, and whether each return is of something that moves.
    pub(crate) fn scan_among(
        &self,
        town: &Town,
        drive: &Drive<'_>,
        companions: &[Companion],
        index: usize,
    ) -> (Scan, Vec<bool>) {
        let start_ns = drive.options().start_ns;
        let stamp_ns = self.stamp_ns(start_ns, index);
        let LidarOptions { azimuth_steps, sweep, .. } = self.options;
        let turn_ns = 1e9 / self.options.rate_hz;
        let (mut scan, mut is_moving) = (Scan { stamp_ns: Some(stamp_ns), ..Scan::default() }, Vec::new());
        let still = drive.world_from_body_at(stamp_ns);
        for firing in 0..azimuth_steps {
            let share = firing as f64 / azimuth_steps as f64;
            let offset_ns = (turn_ns * share) as i64;
            let (pose, at_ns) = match sweep {
                Sweep::Spinning => (drive.world_from_body_at(stamp_ns + offset_ns), stamp_ns + offset_ns),
                Sweep::Instant => (still, stamp_ns),
            };
            let time_s = (at_ns - start_ns) as f64 * 1e-9;
            let solids = company::solids(companions, drive, time_s);
            let place = [index as u64, firing as u64];
            let mut random = Random::new(self.options.seed, &[b'l'.into(), place[0], place[1]]);
            // A stream of its own: without this noise, all else is what it was.
            let mut aside = Random::new(self.options.seed, &[b'l'.into(), b'b'.into(), place[0], place[1]]);
            for fired in self.bearings(TAU * share - PI) {
                let reported = self.reported(fired, &mut aside);
                let (origin, direction) = (pose.translation.vector, pose.rotation * fired);
                let hit = company::nearer(town.cast(origin, direction, time_s), &solids, origin, direction);
                let Some(point) = self.measure(hit, reported, &mut random) else { continue };
                is_moving.push(hit.is_some_and(|hit| hit.surface.is_moving()));
                scan.points_in_sensor_m.push(point);
                if sweep == Sweep::Spinning {
                    scan.time_offsets_ns.push(offset_ns);
                }
            }
        }
        (scan, is_moving)
    }

    /// Unit vectors of the beams at an azimuth, lowest first, sensor frame.
    fn bearings(&self, azimuth_rad: f64) -> impl Iterator<Item = Vector3<f64>> {
        let (sin, cos) = libm::sincos(azimuth_rad);
        self.elevations.iter().map(move |&(up, level)| Vector3::new(level * cos, level * sin, up))
    }

    /// The bearing that the sensor believes it fired along.
    pub(crate) fn reported(&self, fired: Vector3<f64>, random: &mut Random) -> Vector3<f64> {
        let sigma = self.options.bearing_noise_rad;
        if sigma == 0.0 {
            return fired;
        }
        // No beam is vertical: the elevations lie within ±π/2.
        let left = Vector3::new(-fired.y, fired.x, 0.0).normalize();
        let up = fired.cross(&left);
        (fired + (left * random.normal() + up * random.normal()) * sigma).normalize()
    }

    /// The point of one beam, sensor frame, from what it met and the bearing reported; `None` where there is to be none.
    fn measure(&self, hit: Option<Hit>, reported: Vector3<f64>, random: &mut Random) -> Option<[f32; 3]> {
        let options = &self.options;
        // Drawn in any case: what one beam meets does not change the noise of the next.
        let (lost, noise) = (random.chance(options.drop_out), random.normal());
        let range_m =
            hit.filter(|hit| !lost && self.sees(hit)).map(|hit| hit.range_m + options.range_noise_m * noise);
        match range_m.filter(|&range_m| range_m >= options.min_range_m) {
            Some(range_m) => {
                Some((reported * range_m).map(|c| round_to(c, options.resolution_m) as f32).into())
            }
            None => options.no_return.point(),
        }
    }

    /// Whether enough light comes back.
    pub(crate) fn sees(&self, hit: &Hit) -> bool {
        let nearer = self.options.max_range_m / hit.range_m;
        hit.range_m <= self.options.max_range_m
            && hit.reflectivity * hit.cos_incidence * nearer * nearer >= NOMINAL_REFLECTIVITY
    }
}

fn round_to(value: f64, step: f64) -> f64 {
    if step > 0.0 { libm::round(value / step) * step } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar_options::NoReturn;
    use crate::town::TownOptions;
    use crate::ways::DriveOptions;

    fn scene(options: LidarOptions) -> Scan {
        let town = Town::new(TownOptions::default()).unwrap();
        let drive = Drive::new(&town, DriveOptions::default()).unwrap();
        Lidar::new(options).unwrap().scan(&town, &drive, 7)
    }

    fn small() -> LidarOptions {
        LidarOptions { azimuth_steps: 300, ..LidarOptions::with_beams(16) }
    }

    #[test]
    fn times_ascend_within_the_sweep() {
        let scan = scene(small());
        assert_eq!(scan.time_offsets_ns.len(), scan.len());
        assert!(scan.time_offsets_ns.is_sorted());
        assert!(scan.time_offsets_ns.iter().all(|t| (0..100_000_000).contains(t)));
        assert_eq!(scan.stamp_ns, Some(1_700_000_000_700_000_000));
        let scan = scene(LidarOptions { sweep: Sweep::Instant, ..small() });
        assert!(scan.time_offsets_ns.is_empty() && !scan.is_empty());
    }

    #[test]
    fn returns_lie_on_the_town_within_the_noise() {
        let town = Town::new(TownOptions::default()).unwrap();
        let drive = Drive::new(&town, DriveOptions::default()).unwrap();
        let scan = Lidar::new(small()).unwrap().scan(&town, &drive, 3);
        let mut squares = 0.0;
        for (point, offset_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
            let pose = drive.world_from_body_at(scan.stamp_ns.unwrap() + offset_ns);
            let point = Vector3::from(point.map(f64::from));
            let range_m = point.norm();
            // The rounded point has a slightly other bearing: edges apart, it meets the same surface.
            let hit = town.cast(pose.translation.vector, pose.rotation * (point / range_m), 0.0);
            squares += hit.map_or(1.0, |hit| (hit.range_m - range_m).powi(2)).min(0.01);
        }
        let deviation = (squares / scan.len() as f64).sqrt();
        assert!((0.017..0.035).contains(&deviation), "{deviation} m");
    }

    #[test]
    fn what_does_not_return_can_be_kept_as_rows() {
        let dark = |no_return| scene(LidarOptions { no_return, drop_out: 1.0, ..small() });
        assert!(dark(NoReturn::Omitted).is_empty());
        assert!(dark(NoReturn::Zero).points_in_sensor_m.iter().all(|p| *p == [0.0; 3]));
        let rows = dark(NoReturn::NotANumber);
        assert_eq!((rows.len(), rows.time_offsets_ns.len()), (4800, 4800));
        assert!(rows.points_in_sensor_m.iter().all(|p| p[0].is_nan()));
    }

    #[test]
    fn bearings_are_off_by_the_noise_asked_for_and_ranges_are_not() {
        let exact = LidarOptions { resolution_m: 0.0, ..small() };
        let sigma = 0.002;
        let (sharp, blurred) =
            (scene(exact.clone()), scene(LidarOptions { bearing_noise_rad: sigma, ..exact.clone() }));
        assert_eq!(sharp.time_offsets_ns, blurred.time_offsets_ns);
        let up = |p: Vector3<f64>| libm::atan2(p.z, libm::hypot(p.x, p.y));
        let (mut across, mut along) = (0.0, 0.0);
        for (a, b) in sharp.points_in_sensor_m.iter().zip(&blurred.points_in_sensor_m) {
            let [a, b] = [a, b].map(|p| Vector3::from(p.map(f64::from)));
            assert!((a.norm() - b.norm()).abs() < 1e-4, "the range is that of the direction fired along");
            let turn = libm::atan2(a.x * b.y - a.y * b.x, a.x * b.x + a.y * b.y) * libm::cos(up(a));
            across += turn * turn;
            along += (up(b) - up(a)).powi(2);
        }
        for squares in [across, along] {
            let deviation = (squares / sharp.len() as f64).sqrt();
            assert!((deviation / sigma - 1.0).abs() < 0.05, "{deviation}");
        }
    }

    #[test]
    fn impossible_sensors_are_refused() {
        for options in [
            LidarOptions { beams: 0, ..small() },
            LidarOptions { range_noise_m: -0.1, ..small() },
            LidarOptions { bearing_noise_rad: -0.1, ..small() },
            LidarOptions { rate_hz: f64::NAN, ..small() },
            LidarOptions { elevation_rad: [0.2, 0.1], ..small() },
        ] {
            assert!(Lidar::new(options).is_err());
        }
    }
}
