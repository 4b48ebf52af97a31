//! A recording: scans of a drive through a town, and the truth about it.

use std::collections::HashMap;

use dmp_sensor::{Scan, Trajectory};
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::company::Companion;
use crate::error::{SimError, require};
use crate::lidar::{BATCH, Lidar};
use crate::lidar_options::LidarOptions;
use crate::route::Route;
use crate::town::{Scenery, Town, TownOptions};
use crate::ways::{Drive, DriveOptions, require_speed};

/// A place is revisited when it was passed within this distance, metres …
const REVISIT_M: f64 = 5.0;
/// … after at least this much other travel.
const AWAY_M: f64 = 30.0;
/// So many cars stand bumper to bumper on the longest streets, and each ray looks at all of them.
const MOST_CARS: usize = 10_000;
/// Height of a sensor that is carried, metres; on a car it is that of [`DriveOptions::default`].
const CARRIED_M: f64 = 1.2;

/// A whole recording: a sensor on a drive through a town that is large enough for it.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingOptions {
    /// Seed of the town, the drive and the noise.
    pub seed: u64,
    /// Number of scans.
    pub scans: usize,
    /// Where it goes.
    pub route: Route,
    /// Speed on a straight street, metres per second.
    pub speed_m_s: f64,
    /// Number of moving cars; a campus has none.
    pub traffic: usize,
    /// The sensor; its seed is that of the recording.
    pub lidar: LidarOptions,
}

impl RecordingOptions {
    fn drive(&self) -> DriveOptions {
        let duration_s = self.scans as f64 / self.lidar.rate_hz;
        let (seed, route, speed_m_s) = (self.seed, self.route, self.speed_m_s);
        let common = DriveOptions::default();
        let height_m = if route == Route::Campus { CARRIED_M } else { common.height_m };
        DriveOptions { seed, route, speed_m_s, duration_s, height_m, ..common }
    }

    /// The town around this recording's route, or the campus of a walk: pass it to [`Recording::new`].
    ///
    /// # Errors
    /// When a number is outside its range.
    pub fn town(&self) -> Result<Town, SimError> {
        self.town_of(Scenery::Varied)
    }

    /// As [`town`](Self::town), with other things along the streets; a campus stays what it is.
    ///
    /// # Errors
    /// When a number is outside its range.
    pub fn town_of(&self, scenery: Scenery) -> Result<Town, SimError> {
        require(self.scans >= 1, "the number of scans", "1 or more", 0.0)?;
        require_speed(self.speed_m_s)?;
        let drive = self.drive();
        let travel_m = drive.speed_m_s * drive.duration_s;
        require(travel_m <= 1e6, "the travel in m", "up to 1000000", travel_m)?;
        let traffic = self.traffic as f64;
        require(self.traffic <= MOST_CARS, "the number of cars that drive", "up to 10000", traffic)?;
        if self.route == Route::Campus {
            require(self.traffic == 0, "the number of cars that drive over a campus", "0", traffic)?;
            return Ok(Town::campus(self.seed));
        }
        let town = TownOptions { seed: self.seed, moving_cars: self.traffic, ..TownOptions::of(scenery)? };
        let travel_m = drive.travel_m(&town);
        Town::new(TownOptions { blocks: self.route.blocks(travel_m, town.block_m), ..town })
    }
}

/// The scans of a drive through a town, and the truth about it.
#[derive(Debug, Clone)]
pub struct Recording<'a> {
    town: &'a Town,
    drive: Drive<'a>,
    lidar: Lidar,
    companions: Vec<Companion>,
    scans: usize,
}

impl<'a> Recording<'a> {
    /// Plans a drive of the sensor through `town`.
    ///
    /// # Errors
    /// When a number is outside its range.
    pub fn new(town: &'a Town, options: &RecordingOptions) -> Result<Self, SimError> {
        let lidar = Lidar::new(LidarOptions { seed: options.seed, ..options.lidar.clone() })?;
        let (drive, companions) = (Drive::new(town, options.drive())?, Vec::new());
        Ok(Self { town, drive, lidar, companions, scans: options.scans })
    }

    /// The same with others on the way.
    #[must_use]
    pub fn among(self, companions: Vec<Companion>) -> Self {
        Self { companions, ..self }
    }

    /// The drive.
    pub fn drive(&self) -> &Drive<'a> {
        &self.drive
    }

    /// Number of scans.
    #[expect(clippy::len_without_is_empty, reason = "a recording has at least one scan")]
    pub fn len(&self) -> usize {
        self.scans
    }

    /// All scans in order, measured on all threads, a few at a time.
    pub fn scans(&self) -> impl Iterator<Item = Scan> {
        self.scans_with_truth().map(|(scan, _)| scan)
    }

    /// The same, with whether each return is of something that moves.
    pub fn scans_with_truth(&self) -> impl Iterator<Item = (Scan, Vec<bool>)> {
        (0..self.scans).step_by(BATCH).flat_map(|first| {
            let batch = first..(first + BATCH).min(self.scans);
            let scan = |index| self.lidar.scan_among(self.town, &self.drive, &self.companions, index);
            batch.into_par_iter().map(scan).collect::<Vec<_>>()
        })
    }

    /// The truth without stamps: one pose a scan, at the start of its sweep.
    ///
    /// # Errors
    /// Never: a recording has at least one scan.
    pub fn pose_per_scan(&self) -> Result<Trajectory, dmp_sensor::TrajectoryError> {
        let start_ns = self.drive.options().start_ns;
        let stamp_ns = |index| self.lidar.stamp_ns(start_ns, index);
        Trajectory::unstamped((0..self.scans).map(|n| self.drive.world_from_body_at(stamp_ns(n))).collect())
    }

    /// Path length from the first to the last scan, metres, and the share of the scans that were made
    /// within 5 m of a place passed more than 30 m of travel before.
    pub fn travel_and_revisits(&self) -> (f64, f64) {
        let start_ns = self.drive.options().start_ns;
        let place = |n| self.drive.world_from_body_at(self.lidar.stamp_ns(start_ns, n)).translation.vector;
        let places: Vec<_> = (0..self.scans).map(place).collect();
        let mut travel_m = vec![0.0];
        for pair in places.windows(2) {
            travel_m.push(travel_m[travel_m.len() - 1] + (pair[1] - pair[0]).norm());
        }
        // Places that are long enough ago, by square of the map: one looks into nine squares only.
        let square = |n: usize| [0, 1].map(|k| libm::floor(places[n][k] / REVISIT_M) as i64);
        let mut before: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
        let (mut long_ago, mut revisits) = (0, 0);
        for n in 0..places.len() {
            while travel_m[long_ago] < travel_m[n] - AWAY_M {
                before.entry(square(long_ago)).or_default().push(long_ago);
                long_ago += 1;
            }
            let [i, j] = square(n);
            let squares = (i - 1..=i + 1).flat_map(|i| (j - 1..=j + 1).map(move |j| [i, j]));
            let mut near = squares.filter_map(|square| before.get(&square)).flatten();
            revisits += usize::from(near.any(|&m| (places[m] - places[n]).norm() < REVISIT_M));
        }
        (travel_m[travel_m.len() - 1], revisits as f64 / places.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::Track;

    fn options(route: Route) -> RecordingOptions {
        let lidar = LidarOptions { azimuth_steps: 90, rate_hz: 2.0, ..LidarOptions::with_beams(8) };
        RecordingOptions { seed: 3, scans: 70, route, speed_m_s: 5.0, traffic: 5, lidar }
    }

    #[test]
    fn routes_come_back_or_do_not() {
        for (route, expected) in [
            (Route::Loop, 0.2..0.5),
            (Route::TwoLaps, 0.35..0.6),
            (Route::OutAndBack, 0.25..0.6),
            (Route::Straight, 0.3..0.6),
            (Route::OneWay, 0.0..0.01),
        ] {
            let options = RecordingOptions { scans: 110, ..options(route) };
            let town = options.town().unwrap();
            let (travel_m, revisits) = Recording::new(&town, &options).unwrap().travel_and_revisits();
            assert!((150.0..250.0).contains(&travel_m), "{route:?}: {travel_m} m");
            assert!(expected.contains(&revisits), "{route:?}: {revisits}");
        }
    }

    #[test]
    fn the_truth_covers_every_return_and_the_threads_do_not_matter() {
        let options = options(Route::Loop);
        let town = options.town().unwrap();
        let recording = Recording::new(&town, &options).unwrap();
        let truth = recording.drive().trajectory(20.0).unwrap();
        let track = Track::new(&truth, dmp_sensor::Isometry3::identity(), 100_000_000);
        let scans: Vec<Scan> = recording.scans().collect();
        assert_eq!(scans.len(), 70);
        for (n, scan) in scans.iter().enumerate() {
            let stamp_ns = scan.stamp_ns.unwrap();
            assert_eq!(*scan, recording.lidar.scan(&town, &recording.drive, n));
            for offset_ns in &scan.time_offsets_ns {
                assert!(track.world_from_sensor_at(stamp_ns + offset_ns).is_some());
            }
        }
        assert_eq!(recording.pose_per_scan().unwrap().len(), 70);
    }

    /// The FNV-1a hash of the coordinates and times of all returns.
    fn fingerprint(scans: impl Iterator<Item = Scan>) -> u64 {
        let fold = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        scans.fold(0xcbf2_9ce4_8422_2325, |hash, scan| {
            let points = scan.points_in_sensor_m.iter().flatten().flat_map(|c| c.to_le_bytes());
            let times = scan.time_offsets_ns.iter().flat_map(|t| t.to_le_bytes());
            points.chain(times).fold(hash, fold)
        })
    }

    #[test]
    fn the_usual_town_is_what_it_always_was() {
        for (route, expected) in
            [(Route::Loop, 0x4c9a_df3d_50d2_c759), (Route::OutAndBack, 0x38e8_3ce7_d86e_fbb5)]
        {
            let options = options(route);
            let town = options.town().unwrap();
            let found = fingerprint(Recording::new(&town, &options).unwrap().scans());
            assert_eq!(found, expected, "{route:?}: {found:#x}");
        }
    }

    #[test]
    fn more_cars_than_streets_hold_are_refused() {
        for traffic in [MOST_CARS + 1, usize::MAX] {
            let error = RecordingOptions { traffic, ..options(Route::Loop) }.town().unwrap_err();
            assert!(error.to_string().contains("the number of cars that drive"), "{error}");
        }
    }

    #[test]
    fn traffic_moves() {
        let still = RecordingOptions { traffic: 0, ..options(Route::Loop) };
        let busy = RecordingOptions { traffic: 12, ..options(Route::Loop) };
        let scans = |options: &RecordingOptions| -> Vec<Scan> {
            let town = options.town().unwrap();
            Recording::new(&town, options).unwrap().scans().collect()
        };
        let differing = scans(&still).iter().zip(scans(&busy)).filter(|(a, b)| **a != *b).count();
        assert!(differing > 20, "{differing} of 70 scans see a moving car");
    }
}
