//! The trap: a plain street seen by twenty scans, and four trajectories for it.
//!
//! Where two smooth façades run along a street, scans that lie on top of each other still fit: only a few posts
//! and the street's ends tell that something is wrong. A collapsed map of such a street is small and
//! smooth, and metrics that look at nothing but the map take it for the better one.

use std::fmt::Write as _;
use std::path::Path;

use dmp::{Config, Run};
use dmp_log::{LogOptions, McapScanWriter, McapWriterOptions, open_log};
use dmp_sensor::{Isometry3, Scan, Trajectory, Translation3, UnitQuaternion, Vector3};
use dmp_study::{Column, Study, StudyOptions, study};

use super::consistency::mix;

const SCANS: usize = 20;
const PERIOD_NS: i64 = 100_000_000;
/// Way from scan to scan.
const STEP_M: f64 = 1.4;
const BEAMS: usize = 64;
const AZIMUTH_STEPS: usize = 600;
const MAX_RANGE_M: f64 = 80.0;
/// The sensor rocks by this about its two level axes.
const ROCK_RAD: f64 = 0.005;
/// Standard deviation of a range.
const NOISE_M: f64 = 0.02;
/// Every scan lies higher than the one before by this.
const CLIMB_M: f64 = 0.02;
/// Every other scan lies to the left by this.
const SHIFT_M: f64 = 3.0;

/// The collapsed street is shorter by this factor.
const COLLAPSE: f64 = 0.02;

/// The runs, the truth first.
const RUNS: [&str; 4] = ["truth", "climbing", "doubled", "collapsed"];

/// Scores that the table shows, by their keys.
const SHOWN: [&str; 13] = [
    "dmp_sum_m2",
    "dmp_mean_m2",
    "r_cv_10_m2",
    "r_cv_2_m2",
    "r_cv_0.5_m2",
    "r_near_5_m2",
    "r_near_2_m2",
    "r_near_0.5_m2",
    "coverage",
    "ate_rmse_m",
    "mme",
    "mpv_m2",
    "mom_m2",
];

pub(super) fn run(seed: u64) -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    print!("{}", table(&spring(seed, folder.path())?));
    Ok(())
}

/// The four runs of the street, scored.
fn spring(seed: u64, folder: &Path) -> anyhow::Result<Study> {
    let path = folder.join("street.mcap");
    let mut log = McapScanWriter::create(&path, &McapWriterOptions::default())?;
    let street = Street::new(seed);
    for scan in 0..SCANS {
        log.write_scan(&street.scan(scan))?;
    }
    log.finish()?;
    let log = open_log(&path, &LogOptions::default())?;
    let named = |(name, change): (&&str, &Change)| Ok(Run::new(*name, trajectory(*change)?));
    let runs: Vec<Run> = RUNS.iter().zip(&CHANGES).map(named).collect::<anyhow::Result<_>>()?;
    let reference = &runs[0].trajectory;
    Ok(study(log.as_ref(), &runs, reference, None, &Config::default(), &StudyOptions::default(), ())?)
}

/// Where the sensor is at a scan: it drives along x and weaves a little.
fn true_pose(scan: usize) -> Isometry3<f64> {
    let phase = scan as f64 * 0.7;
    let place = Translation3::new(scan as f64 * STEP_M, 0.2 * libm::sin(phase), 1.8);
    Isometry3::from_parts(
        place,
        UnitQuaternion::from_euler_angles(
            ROCK_RAD * libm::sin(2.3 * phase),
            ROCK_RAD * libm::cos(1.7 * phase),
            0.02 * libm::cos(phase),
        ),
    )
}

/// What becomes of the true pose of a scan.
type Change = fn(scan: usize, pose: Isometry3<f64>) -> Isometry3<f64>;

/// As [`RUNS`].
const CHANGES: [Change; 4] = [
    |_, pose| pose,
    |scan, pose| Translation3::new(0.0, 0.0, CLIMB_M * scan as f64) * pose,
    |scan, pose| Translation3::new(0.0, if scan % 2 == 1 { SHIFT_M } else { 0.0 }, 0.0) * pose,
    |_, mut pose| {
        pose.translation.vector.x *= COLLAPSE;
        pose
    },
];

fn trajectory(change: Change) -> anyhow::Result<Trajectory> {
    let poses = (0..SCANS).map(|scan| (scan as i64 * PERIOD_NS, change(scan, true_pose(scan))));
    Ok(Trajectory::stamped(poses.collect())?.trajectory)
}

/// Ground at z = 0, façades beside it, and boxes.
struct Street {
    seed: u64,
    /// Lowest and highest corner.
    boxes: Vec<[[f64; 3]; 2]>,
}

impl Street {
    /// From façade to façade.
    const WIDTH_M: f64 = 14.0;

    /// Posts stand at irregular places, other ones for every seed; a house closes each end.
    fn new(seed: u64) -> Self {
        let half_m = Self::WIDTH_M / 2.0;
        let ends = [-55.0, 75.0].map(|x| [[x, -half_m, 0.0], [x + 1.0, half_m, 12.0]]);
        let mut boxes = ends.to_vec();
        for side in [-1.0, 1.0] {
            let mut x_m = -48.0;
            for k in 0.. {
                let random = |what: u64| unit(&[seed, k, what, u64::from(side > 0.0)]);
                x_m += 40.0 * (1.0 + random(0));
                if x_m > 68.0 {
                    break;
                }
                let [a, b] = [half_m - 1.0, half_m - 1.25].map(|y| side * y);
                boxes.push([[x_m, a.min(b), 0.0], [x_m + 0.25, a.max(b), 3.0 + 3.0 * random(1)]]);
            }
        }
        Self { seed, boxes }
    }

    /// What the sensor sees from its true place, all at once.
    fn scan(&self, scan: usize) -> Scan {
        let pose = true_pose(scan);
        let mut seen = Scan { stamp_ns: Some(scan as i64 * PERIOD_NS), ..Scan::default() };
        for step in 0..AZIMUTH_STEPS {
            let azimuth = std::f64::consts::TAU * step as f64 / AZIMUTH_STEPS as f64;
            for beam in 0..BEAMS {
                let elevation = (-25.0 + 40.0 * beam as f64 / (BEAMS - 1) as f64).to_radians();
                let flat = libm::cos(elevation);
                let bearing =
                    Vector3::new(flat * libm::cos(azimuth), flat * libm::sin(azimuth), libm::sin(elevation));
                let Some(range_m) = self.range_m(pose.translation.vector, pose.rotation * bearing) else {
                    continue;
                };
                // The sum of twelve even numbers is nearly normal.
                let noise: f64 =
                    (0..12).map(|k| unit(&[self.seed, scan as u64, step as u64, beam as u64, k]) - 0.5).sum();
                let point = bearing * (range_m + NOISE_M * noise);
                seen.points_in_sensor_m.push([point.x as f32, point.y as f32, point.z as f32]);
                seen.time_offsets_ns.push(0);
            }
        }
        seen
    }

    fn range_m(&self, origin: Vector3<f64>, direction: Vector3<f64>) -> Option<f64> {
        let half_m = Self::WIDTH_M / 2.0;
        let ground = (direction.z < 0.0).then(|| -origin.z / direction.z);
        let facade = (direction.y != 0.0).then(|| (half_m.copysign(direction.y) - origin.y) / direction.y);
        let facade = facade.filter(|range_m| origin.z + range_m * direction.z < 12.0);
        let boxes = self.boxes.iter().filter_map(|solid| enter_m(solid, origin, direction));
        let nearest = boxes.chain(ground).chain(facade).min_by(f64::total_cmp);
        nearest.filter(|range_m| *range_m < MAX_RANGE_M)
    }
}

/// Where a ray enters a box from outside.
fn enter_m(solid: &[[f64; 3]; 2], origin: Vector3<f64>, direction: Vector3<f64>) -> Option<f64> {
    let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
    for k in 0..3 {
        let [a, b] = [0, 1].map(|side| (solid[side][k] - origin[k]) / direction[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter > 0.0 && enter < leave).then_some(enter)
}

/// A number in [0, 1) that looks random, the same for the same words.
fn unit(words: &[u64]) -> f64 {
    let mixed = words.iter().fold(0, |state, &word| mix(state ^ word));
    (mixed >> 11) as f64 / (1u64 << 53) as f64
}

fn shown(study: &Study) -> impl Iterator<Item = &Column> {
    SHOWN.iter().filter_map(|key| study.table.column(key))
}

fn table(study: &Study) -> String {
    let mut text = format!("| score | {} | best |\n|---|--:|--:|--:|--:|---|\n", RUNS.join(" | "));
    for column in shown(study) {
        let value = |value: &Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.6}"));
        let values: Vec<String> = column.values.iter().map(value).collect();
        let unit = if column.unit.is_empty() { String::new() } else { format!(", {}", column.unit) };
        let best = best(column).map_or("–", |run| RUNS[run]);
        let _ = writeln!(text, "| {}{unit} | {} | {best} |", column.title, values.join(" | "));
    }
    for pair in &study.score.pairs {
        let scale = pair.verdict.decided_at_m().map_or(String::new(), |scale_m| format!(" at {scale_m} m"));
        let _ = write!(text, "\n- {} and {}: {}{scale}", pair.a, pair.b, pair.verdict);
    }
    text.push('\n');
    text
}

/// The run with the best value.
fn best(column: &Column) -> Option<usize> {
    let known = column.values.iter().enumerate().filter_map(|(run, value)| Some((run, (*value)?)));
    let sign = if column.lower_is_better { 1.0 } else { -1.0 };
    known.min_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1))).map(|(run, _)| run)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_collapsed_street_takes_in_the_metrics_of_the_map_and_not_the_score() {
        let folder = tempfile::tempdir().unwrap();
        let study = spring(1, folder.path()).unwrap();
        let values = |key: &str| {
            let values = &study.table.column(key).unwrap().values;
            values.iter().map(|value| value.unwrap()).collect::<Vec<f64>>()
        };
        for key in [
            "dmp_sum_m2",
            "dmp_mean_m2",
            "r_cv_2_m2",
            "r_cv_0.5_m2",
            "r_near_5_m2",
            "r_near_2_m2",
            "r_near_0.5_m2",
        ] {
            assert_eq!(best(study.table.column(key).unwrap()), Some(0), "{key}: {:?}", values(key));
        }
        assert_eq!(study.score.order[0], "truth");
        let decided = study.score.pairs.iter().filter(|pair| pair.verdict.better() == Some("truth")).count();
        assert_eq!(decided, 3, "{:?}", study.score.pairs);
        // What docs/accuracy.md says of the price of misses, too.
        for key in ["mme", "mom_m2", "r_cv_10_m2"] {
            let values = values(key);
            assert!(values[3] < values[0], "{key}: {values:?}");
        }
    }
}
