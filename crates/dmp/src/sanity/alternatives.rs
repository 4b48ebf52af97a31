//! What users get wrong about frames and clocks.

use dmp_log::LogSummary;
use dmp_sensor::{Isometry3, Quaternion, Trajectory, Translation3, UnitQuaternion};

/// Seconds by which clocks and conventions differ: half a scan and a scan of a usual LiDAR, delays, a second,
/// and GPS against UTC since 2017.
const SHIFTS_S: [f64; 5] = [0.05, 0.1, 0.5, 1.0, 18.0];

/// Another reading of what the user gave.
#[derive(Debug, Clone)]
pub(super) struct Alternative {
    /// What is different, as the end of "with ...".
    pub(super) with: String,
    /// What to look at.
    pub(super) ask: &'static str,
    pub(super) body_from_sensor: Isometry3<f64>,
    pub(super) shift_ns: i64,
    pub(super) inverted: bool,
}

/// All readings that are tried; those of times only where poses are found by stamp.
pub(super) fn all(given: Isometry3<f64>, stamped: bool, log: &LogSummary) -> Vec<Alternative> {
    let plain =
        Alternative { with: String::new(), ask: "", body_from_sensor: given, shift_ns: 0, inverted: false };
    let mut all = Vec::new();
    let mut turned = |with: &str, body_from_sensor: Isometry3<f64>| {
        let ask = "is --extrinsic wrong (it is body_from_sensor)?";
        all.push(Alternative { with: with.to_owned(), ask, body_from_sensor, ..plain.clone() });
    };
    if given != Isometry3::identity() {
        turned("the extrinsic the other way round", given.inverse());
        turned("no extrinsic", Isometry3::identity());
    }
    let camera_from_lidar = camera_from_lidar();
    turned("poses taken for those of a camera (x right, y down, z forward)", camera_from_lidar * given);
    turned(
        "the sensor's axes taken for those of a camera (x right, y down, z forward)",
        given * camera_from_lidar.inverse(),
    );
    turned("the sensor upside down (turned by 180° about its x axis)", given * rotation(0.0, 1.0, 0.0, 0.0));
    turned("the sensor turned by 90° about its z axis", given * rotation(1.0, 0.0, 0.0, 1.0));
    turned("the sensor turned by -90° about its z axis", given * rotation(1.0, 0.0, 0.0, -1.0));
    turned("the sensor turned by 180° about its z axis", given * rotation(0.0, 0.0, 0.0, 1.0));
    let with = "the poses inverted".to_owned();
    let ask = "does the trajectory hold sensor_from_world instead of world_from_sensor?";
    all.push(Alternative { with, ask, inverted: true, ..plain.clone() });
    if stamped {
        let mut shifts_ns: Vec<i64> = SHIFTS_S.iter().map(|s| (s * 1e9) as i64).collect();
        if let Some(period_ns) = log.period_ns.filter(|period_ns| !shifts_ns.contains(period_ns)) {
            shifts_ns.push(period_ns);
        }
        for shift_ns in shifts_ns.into_iter().flat_map(|shift_ns| [-shift_ns, shift_ns]) {
            let with = format!("the times shifted by {} s", shift_ns as f64 / 1e9);
            all.push(Alternative { with, ask: "is --time-offset wrong?", shift_ns, ..plain.clone() });
        }
    }
    all
}

/// x right, y down, z forward, of x forward, y left, z up.
fn camera_from_lidar() -> Isometry3<f64> {
    rotation(0.5, 0.5, -0.5, 0.5)
}

fn rotation(w: f64, i: f64, j: f64, k: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    Isometry3::from_parts(Translation3::identity(), turn)
}

/// Every pose the other way round; `None` where that makes no trajectory.
pub(super) fn inverted(trajectory: &Trajectory) -> Option<Trajectory> {
    let poses = trajectory.poses().iter().map(Isometry3::inverse);
    match trajectory.stamps_ns() {
        Some(stamps) => {
            Some(Trajectory::stamped(stamps.iter().copied().zip(poses).collect()).ok()?.trajectory)
        }
        None => Trajectory::unstamped(poses.collect()).ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::Vector3;

    #[test]
    fn a_camera_looks_along_z_with_x_to_its_right() {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| camera_from_lidar() * axis);
        let expected = [Vector3::z(), -Vector3::x(), -Vector3::y()];
        assert!(
            axes.iter().zip(expected).all(|(axis, expected)| (axis - expected).norm() < 1e-15),
            "{axes:?}"
        );
    }

    #[test]
    fn inverses_undo_poses() {
        let pose = Isometry3::from_parts(Vector3::new(1.0, 2.0, 3.0).into(), camera_from_lidar().rotation);
        let stamped = Trajectory::stamped(vec![(1, pose), (2, pose.inverse())]).unwrap().trajectory;
        let turned = inverted(&stamped).unwrap();
        assert_eq!(turned.stamps_ns(), Some(&[1, 2][..]));
        for (a, b) in turned.poses().iter().zip(stamped.poses()) {
            assert!((a * b).translation.vector.norm() < 1e-15 && (a * b).rotation.angle() < 1e-7);
        }
        let unstamped = Trajectory::unstamped(vec![pose]).unwrap();
        assert_eq!(inverted(&unstamped).unwrap().poses()[0], pose.inverse());
    }
}
