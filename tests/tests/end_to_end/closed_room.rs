//! A room whose walls are known in closed form, driven through by the whole pipeline.

use dmp::{Config, Ego, Run};
use dmp_sensor::{Isometry3, Scan, Trajectory, Vector3};

use crate::common::{score, write_mcap};

const HALF_M: [f64; 3] = [11.0, 8.0, 3.0];

/// Range to the walls of the room from inside, along a unit direction.
fn range_m(origin: Vector3<f64>, direction: Vector3<f64>) -> f64 {
    (0..3)
        .map(|k| (HALF_M[k] * direction[k].signum() - origin[k]) / direction[k])
        .fold(f64::INFINITY, f64::min)
}

/// A sensor without noise, turning in place at each of a few places.
fn drive(scans: usize) -> (Vec<Scan>, Trajectory) {
    let poses: Vec<(i64, Isometry3<f64>)> = (0..scans)
        .map(|k| {
            let along = k as f64 / scans as f64;
            let place = Vector3::new(8.0 * along - 4.0, (6.3 * along).sin(), 0.2);
            (k as i64 * 100_000_000, Isometry3::new(place, Vector3::new(0.0, 0.05, 2.0 * along)))
        })
        .collect();
    let scan = |(stamp_ns, pose): &(i64, Isometry3<f64>)| {
        let bearings = (0..64).flat_map(|beam| {
            (0..720).map(move |step| {
                let (up, turn) =
                    (f64::from(beam) * 0.02 - 0.64, f64::from(step) * std::f64::consts::TAU / 720.0);
                Vector3::new(up.cos() * turn.cos(), up.cos() * turn.sin(), up.sin())
            })
        });
        let point = |bearing: Vector3<f64>| {
            let z = range_m(pose.translation.vector, pose.rotation * bearing);
            [(bearing.x * z) as f32, (bearing.y * z) as f32, (bearing.z * z) as f32]
        };
        Scan {
            stamp_ns: Some(*stamp_ns),
            points_in_sensor_m: bearings.map(point).collect(),
            time_offsets_ns: vec![],
        }
    };
    let scans = poses.iter().map(scan).collect();
    (scans, Trajectory::stamped(poses).unwrap().trajectory)
}

#[test]
fn a_perfect_run_in_a_perfect_room_has_almost_no_residual() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.mcap");
    let (scans, truth) = drive(30);
    write_mcap(&path, &scans);
    let mut shifted = truth.poses().to_vec();
    // Half of the scans 0.3 m to the side: doubled walls.
    shifted.iter_mut().skip(15).for_each(|pose| pose.translation.vector.y += 0.3);
    let stamps_ns = truth.stamps_ns().unwrap().iter().copied();
    let doubled = Trajectory::stamped(stamps_ns.zip(shifted).collect()).unwrap().trajectory;
    let runs = [Run::new("truth", truth), Run::new("doubled", doubled)];
    let config = Config { ego: Ego::None, ..Config::default() };
    let report = score(&path, &runs, &config);
    let of_truth = &report.runs[0];
    // Corners, where a voxel sees two walls and its disc stands for both, leave what there is.
    let root_mean_m = of_truth.r_near_m2[2].unwrap().sqrt();
    assert!(root_mean_m < 0.02, "{root_mean_m}");
    assert!(of_truth.miss_rate.unwrap() < 0.01 && of_truth.coverage.unwrap() > 0.95, "{of_truth:?}");
    assert_eq!(report.order, ["truth", "doubled"]);
    assert_eq!(report.pairs[0].verdict.better(), Some("truth"), "{:?}", report.pairs[0]);
}
