//! How far apart two runs are: against the returns of all scans, laid by each run from scan to scan, one by one.

use std::collections::BTreeMap;

use dmp::{Config, Ego, Run};
use dmp_log::ScanLog;
use dmp_sensor::{Isometry3, Point3, Scan, Trajectory, along_m};
use dmp_sim::{SlamErrors, room_estimates};

use crate::common::{drift, noise, once, open, plain, real_data, score, small_town, trajectory, write_mcap};

/// Returns that are laid out, evenly drawn from all.
const RETURNS: usize = 10_000;

/// Distances between scans, by the place that they are at.
type Distances = BTreeMap<i64, Vec<f64>>;

/// Of a log with poses of two runs for each scan.
struct Laid {
    poses: Vec<[Isometry3<f64>; 2]>,
    along_m: Vec<f64>,
    points: Vec<Point3<f64>>,
    metre_m: f64,
    is_camera: bool,
}

impl Laid {
    fn new(log: &dyn ScanLog, runs: [&Trajectory; 2], metre_m: f64) -> Self {
        let (mut reader, mut scan, count) = (log.reader().unwrap(), Scan::default(), log.frames().len());
        let (mut points, mut poses) = (Vec::new(), Vec::new());
        let returns: u64 = log.frames().iter().map(|frame| frame.returns).sum();
        let (every, mut seen) = ((returns as usize / RETURNS).max(1), 0);
        for k in 0..count {
            reader.read(k, &mut scan).unwrap();
            let near = |p: &Point3<f64>| {
                let (least_m, most_m) = if metre_m < 1.0 { (0.3, 10.0) } else { (1.5, 100.0) };
                (least_m..=most_m).contains(&p.coords.norm())
            };
            let all = scan.points_in_sensor_m.iter().map(|point| Point3::from(point.map(f64::from)));
            points.extend(all.filter(near).filter(|_| {
                seen += 1;
                seen % every == 0
            }));
            let pose = |run: &Trajectory| match scan.stamp_ns {
                Some(stamp_ns) => run.world_from_body_at(stamp_ns, i64::MAX).unwrap(),
                None => run.poses()[k],
            };
            poses.push(runs.map(pose));
        }
        let of_run = |run: usize| {
            let places: Vec<_> = poses.iter().map(|pose| Some(pose[run].translation.vector)).collect();
            along_m(&places, metre_m)
        };
        let along_m = of_run(0).iter().zip(of_run(1)).map(|(a_m, b_m)| 0.5 * (a_m + b_m)).collect();
        Self { poses, along_m, points, metre_m, is_camera: log.summary().camera.is_some() }
    }

    fn distance_m(&self, i: usize, j: usize) -> f64 {
        let put = |run: usize, p: &Point3<f64>| self.poses[i][run].inverse() * (self.poses[j][run] * p);
        let square = self.points.iter().map(|p| (put(0, p) - put(1, p)).norm_squared()).sum::<f64>();
        (square / self.points.len() as f64).sqrt()
    }

    fn place_of(&self, scan: usize) -> i64 {
        (self.along_m[scan] / (20.0 * self.metre_m)).floor() as i64
    }

    /// Each scan and those 1, 2, 4, … later.
    fn within(&self) -> Distances {
        let mut found = Distances::new();
        for i in 0..self.poses.len() {
            for step in (0..).map(|k| 1 << k).take_while(|step| i + step < self.poses.len()) {
                if step > 1 && self.along_m[i + step] - self.along_m[i] > 20.0 * self.metre_m {
                    break;
                }
                found.entry(self.place_of(i)).or_default().push(self.distance_m(i, i + step));
            }
        }
        found
    }

    /// Each scan and the nearest of each earlier visit.
    fn between(&self) -> Distances {
        let (mut keys, mut found) = (Vec::<usize>::new(), Distances::new());
        for j in 0..self.poses.len() {
            if keys.last().is_some_and(|&last| self.along_m[j] - self.along_m[last] < 0.5 * self.metre_m) {
                continue;
            }
            let mut partners: Vec<usize> = (0..2).flat_map(|run| self.visits(&keys, j, run)).collect();
            partners.sort_unstable();
            partners.dedup();
            let distances = partners.into_iter().map(|i| self.distance_m(i, j));
            found.entry(self.place_of(j)).or_default().extend(distances);
            keys.push(j);
        }
        found
    }

    fn visits(&self, keys: &[usize], j: usize, run: usize) -> Vec<usize> {
        let visit_m = 66.0 * self.metre_m;
        let apart_m = |i: &usize| {
            (self.poses[*i][run].translation.vector - self.poses[j][run].translation.vector).norm()
        };
        let sees = |i: &&usize| {
            let turn = self.poses[**i][run].rotation.angle_to(&self.poses[j][run].rotation);
            apart_m(i) <= 5.0 * self.metre_m && (!self.is_camera || turn <= std::f64::consts::FRAC_PI_4)
        };
        let earlier = keys.iter().filter(|i| self.along_m[j] - self.along_m[**i] >= visit_m);
        let near: Vec<usize> = earlier.filter(sees).copied().collect();
        let visits = near.chunk_by(|&a, &b| self.along_m[b] - self.along_m[a] < visit_m);
        let nearest =
            |visit: &[usize]| *visit.iter().min_by(|a, b| apart_m(a).total_cmp(&apart_m(b))).unwrap();
        visits.map(nearest).collect()
    }
}

/// The smallest number that this share of them does not exceed.
fn quantile(mut numbers: Vec<f64>, share: f64) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[(share * numbers.len() as f64).ceil() as usize - 1]
}

/// The report says the same, within this share.
fn check(log: &std::path::Path, runs: [Trajectory; 2], (metre_m, most_off): (f64, f64), config: &Config) {
    let laid = Laid::new(open(log).as_ref(), [&runs[0], &runs[1]], metre_m);
    let runs: Vec<Run> = ["a", "b"].into_iter().zip(runs).map(|(name, run)| Run::new(name, run)).collect();
    let report = score(log, &runs, &Config { ego: Ego::None, ..config.clone() });
    let apart = report.pairs[0].apart.unwrap();
    assert_eq!(apart.scans, laid.poses.len() as u64);
    for (found, directly) in [(apart.within, laid.within()), (apart.between.unwrap(), laid.between())] {
        let all: Vec<f64> = directly.values().flatten().copied().collect();
        assert_eq!(found.pairs, all.len() as u64);
        let places = directly.into_values().filter(|place| !place.is_empty());
        let worst_m = places.map(|place| quantile(place, 0.95)).fold(0.0, f64::max);
        let numbers = [
            (found.median_m, quantile(all.clone(), 0.5)),
            (found.most_m, quantile(all, 0.95)),
            (found.worst_m, worst_m),
        ];
        println!("{numbers:?}");
        for (found_m, direct_m) in numbers {
            assert!((found_m / direct_m - 1.0).abs() < most_off, "{found_m} {direct_m}");
        }
    }
}

fn with(truth: &Trajectory, errors: &SlamErrors) -> Trajectory {
    errors.apply(truth).unwrap()
}

#[test]
fn on_a_drive_it_is_what_the_returns_say() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("town.mcap");
    let (scans, truth) = small_town(80, 90);
    write_mcap(&log, &scans);
    check(&log, [with(&truth, &noise(0.02, 0.05)), with(&truth, &drift(1.0))], (1.0, 0.01), &plain());
}

#[test]
fn in_a_room_too() {
    let made = once("simulate room -o room --size 80x60 --frames 90 --rate 5 --quiet");
    let room = made.folder.join("room");
    let truth = trajectory(&room.join("groundtruth.txt"));
    let [good, _, odometry, ..] = room_estimates(&truth, 1).unwrap().map(|estimate| estimate.trajectory);
    check(&room, [good, odometry], (0.1, 0.01), &plain());
}

#[test]
fn on_a_real_drive_too() {
    let Some(data) = real_data("nclt_revisit") else { return };
    let truth = trajectory(&data.join("poses_lidar_odometry.txt"));
    let config = Config { voxel_m: Some(0.5), ..plain() };
    // The report knows where returns lie from fifty scans, and here the scene changes.
    check(&data, [with(&truth, &noise(0.02, 0.05)), with(&truth, &drift(1.0))], (1.0, 0.02), &config);
}
