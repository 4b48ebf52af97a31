//! Errors of the run's shape that need no chance.

use dmp_sensor::{UnitQuaternion, Vector3};

use super::poses::{Poses, Travel, smooth_step};

pub(super) fn scale(poses: &mut Poses, factor: f64) {
    let Some(first) = poses.first().map(|pose| pose.translation.vector) else { return };
    for pose in poses {
        pose.translation.vector = first + (pose.translation.vector - first) * factor;
    }
}

pub(super) fn bend(poses: &mut Poses, travel: &Travel, height_m: f64) {
    let total_m = travel.total_m();
    let tilts: Vec<_> = (0..poses.len()).map(|k| tilt(poses, travel, k, height_m)).collect();
    for ((pose, travel_m), tilt) in poses.iter_mut().zip(&travel.0).zip(tilts) {
        let u = travel_m / total_m;
        pose.translation.vector.z += height_m * 4.0 * u * (1.0 - u);
        pose.rotation = tilt * pose.rotation;
    }
}

/// The rotation that lifts the direction of travel at pose `k` as the bend does.
fn tilt(poses: &Poses, travel: &Travel, k: usize, height_m: f64) -> UnitQuaternion<f64> {
    // Over a metre to either side: single steps may be too short to have a direction.
    let before = travel.0.partition_point(|&m| m < travel.0[k] - 1.0).min(k.saturating_sub(1));
    let after = travel.0.partition_point(|&m| m <= travel.0[k] + 1.0).clamp(k, poses.len() - 1);
    let ahead = poses[after].translation.vector - poses[before].translation.vector;
    let level = libm::hypot(ahead.x, ahead.y);
    if level < 0.1 {
        return UnitQuaternion::identity();
    }
    let slope = height_m * 4.0 * (1.0 - 2.0 * travel.0[k] / travel.total_m()) / travel.total_m();
    // About the horizontal axis to the right of the travel, which lifts what is ahead.
    let right = Vector3::new(ahead.y / level, -ahead.x / level, 0.0);
    UnitQuaternion::from_scaled_axis(right * libm::atan(slope))
}

pub(super) fn collapse(poses: &mut Poses, travel: &Travel, share: f64) {
    let total_m = travel.total_m();
    let lost_m = share * total_m;
    let ramp_m = (lost_m * 0.2).min(total_m - lost_m);
    let [start_m, end_m] = [(total_m - lost_m) / 2.0, f64::midpoint(total_m, lost_m)];
    // Ramps lie half inside and half outside the stretch: what is lost is exactly its length.
    let ramp = |at_m: f64, edge_m: f64| smooth_step((at_m - edge_m) / ramp_m + 0.5);
    let mut shift = Vector3::zeros();
    for k in 0..poses.len() - 1 {
        let middle_m = travel.middle_m(k);
        let lost = ramp(middle_m, start_m) - ramp(middle_m, end_m);
        // Both ends of the step are still shifted by what was lost before it, or not at all.
        let true_next = poses[k + 1].translation.vector;
        let true_here = poses[k].translation.vector + shift;
        shift += (true_next - true_here) * lost;
        poses[k + 1].translation.vector = true_next - shift;
    }
}
