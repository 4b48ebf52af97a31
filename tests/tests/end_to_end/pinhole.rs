//! A depth camera in front of surfaces that are known in closed form: a plane, a box.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;

use dmp::{Config, MapSource, Report, Run, ScoredReturns, Sink, Watch, evaluate};
use dmp_log::{DepthFolderWriter, LogOptions, open_log};
use dmp_sensor::{Distortion, Isometry3, PinholeCamera, Trajectory, Vector3};

use crate::common::{ends, has, json, misused, plain, refused, text, write as write_text};

const UNITS_PER_M: f64 = 10_000.0;

fn camera(size_px: [u32; 2], lens: Distortion) -> PinholeCamera {
    let focal_px = 525.0 * f64::from(size_px[0]) / 640.0;
    let centre_px = size_px.map(|px| (f64::from(px) - 1.0) / 2.0);
    PinholeCamera::new(size_px, [focal_px; 2], centre_px, lens).unwrap()
}

/// `freiburg1` of TUM RGB-D.
const LENS: Distortion = Distortion { radial: [0.2624, -0.9531, 1.1633], tangential: [-0.0054, 0.0026] };

/// Writes what a camera sees of a world in which rays from a place in a direction have these lengths.
fn write(
    folder: &Path,
    camera: &PinholeCamera,
    poses: &[(i64, Isometry3<f64>)],
    range_m: impl Fn(Vector3<f64>, Vector3<f64>) -> f64,
) {
    let mut images = DepthFolderWriter::create(folder, camera, UNITS_PER_M).unwrap();
    let bearings = camera.bearings();
    for (stamp_ns, world_from_camera) in poses {
        let depths: Vec<u16> = (0..bearings.len())
            .map(|pixel| {
                let [x, y] = bearings.slopes(pixel);
                // As long as its depth is 1.
                let along = Vector3::new(x, y, 1.0);
                let direction = world_from_camera.rotation * along.normalize();
                let depth_m = range_m(world_from_camera.translation.vector, direction) / along.norm();
                (depth_m * UNITS_PER_M).round() as u16
            })
            .collect();
        images.write_image(*stamp_ns, &depths).unwrap();
    }
    images.finish().unwrap();
}

fn trajectory(poses: Vec<(i64, Isometry3<f64>)>) -> Trajectory {
    Trajectory::stamped(poses).unwrap().trajectory
}

/// Measured range, z − z1, and the same in depth.
type Seen = (f64, Option<f64>, Option<f64>);

/// Every residual of the first run.
#[derive(Default)]
struct Residuals(Mutex<Vec<Seen>>);

impl Sink for Residuals {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        let run = returns.runs[0].unwrap();
        let of_return = run.rays.iter().zip(run.residuals);
        let seen = of_return.map(|(ray, r)| (ray.range_m, r.first_m, r.depth.map(|depth| depth.first_m)));
        self.0.lock().unwrap().extend(seen);
    }
}

fn scored(log: &Path, runs: &[Run], config: &Config) -> (Report, Vec<Seen>) {
    let log = open_log(log, &LogOptions::default()).unwrap();
    let seen = Residuals::default();
    let report = evaluate(log.as_ref(), runs, config, Watch::sink(&seen)).unwrap();
    (report, seen.0.into_inner().unwrap())
}

#[test]
fn a_plane_that_is_nearer_than_it_was_measured_is_off_by_so_much_in_depth_everywhere() {
    for (lens, name) in [(Distortion::NONE, "straight"), (LENS, "distorted")] {
        let folder = tempfile::tempdir().unwrap();
        let (log, plane) = (folder.path().join(name), folder.path().join("plane.ply"));
        let camera = camera([96, 72], lens);
        // The plane z = 2 m, seen along z; the estimate has stepped 25 mm towards it.
        let poses: Vec<_> = (0..4).map(|k| (1 + 100_000_000 * k, Isometry3::identity())).collect();
        write(&log, &camera, &poses, |_, direction| 2.0 / direction.z);
        let stepped = poses.iter().map(|(ns, _)| (*ns, Isometry3::translation(0.0, 0.0, 0.025))).collect();
        let grid = (-400..=400).flat_map(|x| (-400..=400).map(move |y| [x, y].map(|c| f64::from(c) * 0.005)));
        let points: Vec<[f64; 3]> = grid.map(|[x, y]| [x, y, 2.0]).collect();
        let mut ply = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
            points.len()
        );
        points.iter().for_each(|[x, y, z]| writeln!(ply, "{x} {y} {z}").unwrap());
        std::fs::write(&plane, ply).unwrap();
        let run = Run { map: MapSource::Given(plane), ..Run::new("stepped", trajectory(stepped)) };
        let config = Config { voxel_m: Some(0.02), ..plain() };
        let (report, seen) = scored(&log, &[run], &config);

        assert_eq!(seen.len(), 4 * 96 * 72);
        let mut range_squares = 0.0;
        for (range_m, range, depth) in &seen {
            // Measured 2 m of depth, predicted 1.975: by the same share nearer along every ray.
            let (range, depth) = (range.unwrap(), depth.unwrap());
            // The points of the plane are rounded by 0.06 mm along each axis of a world that lies askew to it, and few of
            // them tilt a surfel.
            assert!((depth - 0.025).abs() < 2e-4, "{depth}");
            assert!((range - 0.025 * range_m / 2.0).abs() < 3e-4, "{range} of {range_m}");
            range_squares += (0.025 * range_m / 2.0).powi(2);
        }
        let run = &report.runs[0];
        let close = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-3;
        assert!(close(run.dmp_depth_mean_m2.unwrap(), 0.025 * 0.025), "{run:?}");
        assert!(close(run.dmp_depth_sum_m2.unwrap(), seen.len() as f64 * 0.025 * 0.025), "{run:?}");
        assert!(close(run.dmp_sum_m2, range_squares), "{run:?}");
        // All depths are 2 m, where a Kinect's noise is 0.0012 + 0.0019 · 1.6² m.
        let sigma_m = 0.0012 + 0.0019 * 1.6 * 1.6;
        let expected = -0.5 * seen.len() as f64 * (0.025_f64 / sigma_m).powi(2);
        assert!(close(run.log_likelihood_raw, expected), "{} {expected}", run.log_likelihood_raw);
        assert_eq!((report.config.sigma_m, report.config.depth_noise.unwrap().least_m), (None, 0.0012));
    }
}

/// Half the edges of a box around the camera, metres.
const HALF_M: [f64; 3] = [2.1, 1.6, 1.25];

fn to_the_walls_m(origin: Vector3<f64>, direction: Vector3<f64>) -> f64 {
    let to_wall = |k: usize| (HALF_M[k] * direction[k].signum() - origin[k]) / direction[k];
    (0..3).map(to_wall).fold(f64::INFINITY, f64::min)
}

#[test]
fn in_a_box_without_noise_a_true_run_predicts_what_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("box");
    // Twice round, looking outwards and a little up and down: z of the camera lies level, y down.
    let level = Isometry3::new(Vector3::zeros(), Vector3::new(-std::f64::consts::FRAC_PI_2, 0.0, 0.0));
    let pose = |k: i64| {
        let turn = 4.0 * std::f64::consts::PI * k as f64 / 120.0;
        let place = Vector3::new(0.5 * (2.0 * turn).sin(), 0.4 * turn.cos(), 0.1 * (3.0 * turn).sin());
        let nod = Isometry3::new(Vector3::zeros(), Vector3::new(0.3 * (5.0 * turn).sin(), 0.0, 0.0));
        Isometry3::new(place, Vector3::new(0.0, 0.0, turn)) * level * nod
    };
    let poses: Vec<_> = (0..120).map(|k| (33_000_000 * k, pose(k))).collect();
    write(&log, &camera([160, 120], LENS), &poses, to_the_walls_m);
    let mut slid = poses.clone();
    slid.iter_mut().skip(60).for_each(|(_, pose)| pose.translation.vector.x += 0.05);
    let runs = [Run::new("truth", trajectory(poses)), Run::new("slid", trajectory(slid))];
    let (report, seen) = scored(&log, &runs, &plain());

    let near = seen.iter().filter(|(_, first, _)| first.is_some_and(|m| m.abs() < 0.003)).count();
    // In the corners a voxel sees two walls.
    assert!(near as f64 > 0.97 * seen.len() as f64, "{near} of {}", seen.len());
    let not_longer = |(_, range, depth): &Seen| match (range, depth) {
        (Some(range), Some(depth)) => depth.abs() <= range.abs() && depth.signum() == range.signum(),
        (range, depth) => range.is_none() && depth.is_none(),
    };
    assert!(seen.iter().all(not_longer));
    let truth = &report.runs[0];
    assert!(truth.r_cv_m2[3].unwrap().sqrt() < 0.005 && truth.coverage.unwrap() > 0.95, "{truth:?}");
    assert!(truth.dmp_depth_sum_m2.unwrap() < truth.dmp_sum_m2, "{truth:?}");
    assert_eq!(report.order, ["truth", "slid"]);
    assert_eq!(report.pairs[0].verdict.better(), Some("truth"), "{:?}", report.pairs[0]);
    assert_eq!(report.inputs.runs[0].segments.length_scans, Some(8));
    let scales: Vec<f64> = report.pairs[0].scales.iter().map(|scale| scale.scale_m).collect();
    assert_eq!(scales, [1.0, 0.2, 0.05, 0.02]);
}

#[test]
fn what_is_not_for_rooms_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let poses: Vec<_> = (0..12).map(|k| (33_000_000 * k, Isometry3::identity())).collect();
    write(&folder.path().join("box"), &camera([32, 24], Distortion::NONE), &poses, to_the_walls_m);
    let lines: Vec<String> = (0..12).map(|k| format!("{:.3} 0 0 0 0 0 0 1", 0.033 * f64::from(k))).collect();
    write_text(folder.path(), "run.txt", &lines.join("\n"));
    for (options, words) in [("--voxel 0.005", "0.005"), ("--max-range 0.2", "ranges 0.3 to 0.2 m")] {
        refused(folder.path(), &format!("score box -t run.txt {options}"), 2, &[words]);
    }
    misused(folder.path(), "score box -t run.txt --segment 2hours", &["`2hours` is no length of a segment"]);
    // What is nearer than a drive's smallest range is kept in a room.
    let score = "score box -t run.txt -q";
    let whole = json(folder.path(), &format!("{score} --max-range 1.4"));
    write_text(folder.path(), "whole.json", &whole.to_string());
    assert!(whole["config"]["scales"] == "room" && whole["config"]["max_range_m"] == 1.4, "{whole}");
    // A gate asks for a truncation that there is.
    for (gate, words) in [
        ("R_near_5<1m", "the result has none at 5 m, but at 0.5, 0.2, 0.05 m"),
        ("R_near_0.05>1mm", "R_near 0.05 m is "),
    ] {
        let gated = ends(folder.path(), &format!("compare whole.json --expect {gate}"), 4);
        has(&text(&gated.stderr), &[words]);
    }
}
