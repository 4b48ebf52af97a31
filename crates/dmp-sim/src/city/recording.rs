//! A recording of a drive through a city.

use dmp_sensor::{Isometry3, Scan};
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::city::blocks::Blocks;
use crate::city::plan::Plan;
use crate::city::scanner::Scanner;
use crate::city::way::CityDrive;
use crate::error::{SimError, require};
use crate::lidar::{BATCH, Lidar};
use crate::lidar_options::LidarOptions;
use crate::ways::{START_NS, pose_stamps_ns, require_speed};

/// A recording of a drive through a city without end.
#[derive(Debug, Clone, PartialEq)]
pub struct CityOptions {
    /// Seed of the city, the drive and the noise.
    pub seed: u64,
    /// Length of the drive, metres.
    pub travel_m: f64,
    /// Share of the path that is driven twice. Short drives have no room for a round and get less.
    /// With 0 the road never comes within 250 m of where it was, except in its last 400 m.
    pub revisit_share: f64,
    /// Speed on a straight street, metres per second; curves are slower.
    pub speed_m_s: f64,
    /// The sensor; its seed is that of the recording.
    pub lidar: LidarOptions,
}

/// The scans of a drive through a city, and the truth about it.
///
/// The city has no end: its streets, blocks and hills follow from the seed and their place, and only those in
/// reach of the sensor are held. Memory grows with the length of the drive only by about 100 bytes a
/// corner of the road. It has houses, halls, parks and squares, trees, poles and parked cars; nothing moves.
#[derive(Debug, Clone)]
pub struct CityRecording {
    plan: Plan,
    drive: CityDrive,
    scanner: Scanner,
    speed_m_s: f64,
    travel_m: f64,
}

impl CityRecording {
    /// Plans the drive.
    ///
    /// # Errors
    /// When a number is outside its range.
    pub fn new(options: &CityOptions) -> Result<Self, SimError> {
        let CityOptions { seed, travel_m, revisit_share, speed_m_s, .. } = *options;
        require((50.0..=1e6).contains(&travel_m), "the travel in m", "from 50 to 1000000", travel_m)?;
        let share = (0.0..=0.9).contains(&revisit_share);
        require(share, "the share of the path that is revisited", "from 0 to 0.9", revisit_share)?;
        require_speed(speed_m_s)?;
        let lidar = Lidar::new(LidarOptions { seed, ..options.lidar.clone() })?;
        let plan = Plan { seed };
        let drive = CityDrive::new(plan, travel_m, revisit_share, speed_m_s);
        Ok(Self { plan, drive, scanner: Scanner::new(lidar), speed_m_s, travel_m })
    }

    /// Number of scans.
    #[expect(clippy::len_without_is_empty, reason = "a recording has at least one scan")]
    pub fn len(&self) -> usize {
        (self.drive.duration_s * self.scanner.lidar.options().rate_hz).floor().max(1.0) as usize
    }

    /// All scans in order, measured on all threads, a few at a time.
    pub fn scans(&self) -> impl Iterator<Item = Scan> {
        let mut blocks = Blocks::new(self.plan);
        let reach_m = self.scanner.reach_m(self.speed_m_s);
        (0..self.len()).step_by(BATCH).flat_map(move |first| {
            let batch = first..(first + BATCH).min(self.len());
            let places = batch.clone().map(|index| self.drive.place(self.scanner.stamp_ns(index)));
            blocks.keep_around(places, reach_m);
            let blocks = &blocks;
            let measured = batch.into_par_iter();
            let measured = measured.map(|index| self.scanner.scan(&self.drive, blocks, reach_m, index));
            measured.collect::<Vec<Scan>>()
        })
    }

    /// The true poses, `world_from_sensor`, `rate_hz` of them a second, from just before the first scan to just
    /// after the last.
    ///
    /// # Errors
    /// When the rate is below 1 Hz or above 10 kHz.
    pub fn poses(
        &self,
        rate_hz: f64,
    ) -> Result<impl ExactSizeIterator<Item = (i64, Isometry3<f64>)>, SimError> {
        let stamps_ns = pose_stamps_ns(START_NS, self.drive.duration_s, rate_hz)?;
        Ok(stamps_ns.map(|stamp_ns| (stamp_ns, self.drive.world_from_body_at(stamp_ns))))
    }

    /// Path length, metres, and the share of it that is driven twice or more.
    pub fn travel_and_revisits(&self) -> (f64, f64) {
        (self.travel_m, self.drive.revisited)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options() -> CityOptions {
        let lidar = LidarOptions { azimuth_steps: 60, ..LidarOptions::with_beams(16) };
        CityOptions { seed: 3, travel_m: 120.0, revisit_share: 0.3, speed_m_s: 10.0, lidar }
    }

    #[test]
    fn the_same_scans_on_any_number_of_threads() {
        let recording = CityRecording::new(&options()).unwrap();
        let with = |threads| -> Vec<Scan> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| recording.scans().collect())
        };
        let one = with(1);
        assert!(one.len() == recording.len() && one.len() > 100, "{} scans", one.len());
        assert!(one == with(3));
        let other = CityRecording::new(&CityOptions { seed: 4, ..options() }).unwrap();
        assert_ne!(other.scans().next(), one.into_iter().next());
    }

    #[test]
    fn the_truth_covers_every_return() {
        let recording = CityRecording::new(&options()).unwrap();
        let poses: Vec<_> = recording.poses(20.0).unwrap().collect();
        assert!(poses.is_sorted_by_key(|(stamp_ns, _)| *stamp_ns));
        let (first_ns, last_ns) = (poses[0].0, poses[poses.len() - 1].0);
        for scan in recording.scans() {
            let stamp_ns = scan.stamp_ns.unwrap();
            assert!(
                stamp_ns > first_ns && scan.time_offsets_ns.iter().all(|offset| stamp_ns + offset <= last_ns)
            );
        }
    }

    #[test]
    fn impossible_recordings_are_refused() {
        for options in [
            CityOptions { travel_m: 0.0, ..options() },
            CityOptions { travel_m: f64::NAN, ..options() },
            CityOptions { travel_m: 1e7, ..options() },
            CityOptions { revisit_share: 1.0, ..options() },
            CityOptions { speed_m_s: 0.0, ..options() },
            CityOptions { lidar: LidarOptions { beams: 0, ..options().lidar }, ..options() },
        ] {
            assert!(matches!(CityRecording::new(&options), Err(SimError::OutOfRange { .. })));
        }
    }
}
