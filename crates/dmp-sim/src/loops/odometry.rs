//! Odometry that drifts from keyframe to keyframe.

use std::collections::BTreeMap;

use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};

use super::keyframes::Keyframes;
use super::measure::{off_by, up_and_ahead};
use super::options::LoopGraphOptions;
use crate::random::Random;

/// The smallest standard deviations claimed for a step: no odometry is better, and the information of one
/// without noise would be infinite.
const LEAST_SIGMA_M: f64 = 1e-3;
const LEAST_SIGMA_RAD: f64 = 1e-4;

/// The vertices where odometry puts them, and its edges.
///
/// A step of the length l has a normal error of shift and turn with variances that grow with l, so that a path errs
/// as much whether it is cut into many steps or few, and by a turn about the body's upright axis of bias × l. What errs
/// is behind the step, in the frame that was reached.
pub(super) fn drifted(
    keyframes: &Keyframes,
    options: &LoopGraphOptions,
) -> (BTreeMap<i64, Isometry3<f64>>, Vec<PoseEdge>) {
    let mut vertices = BTreeMap::new();
    let mut edges = Vec::new();
    let [up, _] = up_and_ahead(&options.lengths);
    let mut at = keyframes.poses.first().copied().unwrap_or_else(Isometry3::identity);
    vertices.insert(0, at);
    for (k, pair) in keyframes.poses.windows(2).enumerate() {
        let length_m = keyframes.travel_m[k + 1] - keyframes.travel_m[k];
        let sigma_m = options.step_sigma_m * length_m.sqrt();
        let sigma_rad = options.step_sigma_rad * length_m.sqrt();
        let mut random = Random::new(options.seed, &[b'l'.into(), b'o'.into(), k as u64]);
        let bias = up * (options.yaw_bias_rad_per_m * length_m);
        let error = off_by(&mut random, sigma_m, sigma_rad, bias);
        let from_from_to = pair[0].inv_mul(&pair[1]) * error;
        at *= from_from_to;
        // The product of many rotations: keep it one.
        at.rotation.renormalize();
        let (from, to) = (k as i64, k as i64 + 1);
        vertices.insert(to, at);
        let information =
            PoseGraph::information_of(sigma_m.max(LEAST_SIGMA_M), sigma_rad.max(LEAST_SIGMA_RAD));
        edges.push(PoseEdge { from, to, from_from_to, information });
    }
    (vertices, edges)
}
