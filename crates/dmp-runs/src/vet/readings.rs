//! Candidate misinterpretations of frames, units and clocks, beyond the range of a local fit.

use dmp_log::LogSummary;
use dmp_sensor::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::mend::{Mend, rounded, rounded_ns};
use super::poses_as::PosesAs;
use crate::asked::{Run, Settings};

/// Typical clock differences, seconds: parts of a second, delays, leap seconds (GPS and UTC since 2017, TAI
/// and UTC, TAI and GPS).
const SHIFTS_S: [f64; 14] = [0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 10.0, 18.0, 19.0, 36.0, 37.0];
/// No vehicle with a LiDAR is this fast; a trajectory in millimetres or centimetres is.
const TOO_FAST_M_PER_S: f64 = 100.0;

/// Another interpretation of the user's input: what is to be done to the run. The poses are made when it is tried: there are
/// dozens of readings, and a long run has its poses by the million.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading {
    pub(super) mend: Mend,
    /// Whether it moves the scans along the path: then a stretch in which the vehicle barely moves proves
    /// nothing.
    pub(super) is_shift: bool,
}

/// All interpretations to try; `speed_m_per_s` is the speed of the run as given.
pub(super) fn all(run: &Run, settings: &Settings, log: &LogSummary, speed_m_per_s: f64) -> Vec<Reading> {
    let given = settings.body_from_sensor(run);
    let mut all = Vec::new();
    let mut turned = |body_from_sensor: Isometry3<f64>| {
        all.push(Reading { mend: Mend::Extrinsic(rounded(&body_from_sensor)), is_shift: false });
    };
    if given != Isometry3::identity() {
        turned(given.inverse());
        turned(Isometry3::identity());
    }
    let camera_from_lidar = camera_from_lidar();
    turned(camera_from_lidar * given);
    turned(given * camera_from_lidar.inverse());
    // The sensor turned by half a turn about x, and by quarter turns about z. What turns the poses is a `PosesAs`.
    turned(given * rotation(0.0, 1.0, 0.0, 0.0));
    turned(given * rotation(1.0, 0.0, 0.0, 1.0));
    turned(given * rotation(1.0, 0.0, 0.0, -1.0));
    turned(given * rotation(0.0, 0.0, 0.0, 1.0));
    let as_given = |poses_as: &PosesAs| match poses_as {
        PosesAs::Millimetres | PosesAs::Centimetres => speed_m_per_s > TOO_FAST_M_PER_S,
        PosesAs::Inverted | PosesAs::Wxyz | PosesAs::Kilometres => true,
    };
    let as_given = PosesAs::ALL.into_iter().filter(as_given);
    all.extend(as_given.map(|poses_as| Reading { mend: Mend::PosesAs(poses_as), is_shift: false }));
    if run.trajectory.stamps_ns().is_some() && log.span_ns.is_some() {
        let now_ns = settings.time_offset_ns(run);
        // One pose, or one keyframe, early or late.
        let step_ns = rounded_ns(run.trajectory.usual_step_ns());
        let shifts_ns = SHIFTS_S.into_iter().map(|shift_s| (shift_s * 1e9) as i64).chain([step_ns]);
        for shift_ns in shifts_ns.flat_map(|shift_ns| [-shift_ns, shift_ns]) {
            let offset_ns = now_ns.saturating_add(shift_ns);
            all.push(Reading { mend: Mend::TimeOffset(offset_ns), is_shift: true });
        }
    }
    all
}

/// From x forward, y left, z up to x right, y down, z forward.
fn camera_from_lidar() -> Isometry3<f64> {
    rotation(0.5, 0.5, -0.5, 0.5)
}

fn rotation(w: f64, i: f64, j: f64, k: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    Isometry3::from_parts(Translation3::identity(), turn)
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
}
