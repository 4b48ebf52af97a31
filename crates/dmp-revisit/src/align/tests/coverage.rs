//! Whether the errors are what the covariance says.

use super::visits::{moved, pyramid, turned, visits};
use crate::align::align;

#[test]
fn errors_are_of_the_size_that_the_covariance_says() {
    let displacements = [
        ([0.0, 0.0, 0.0], 0.0),
        ([0.3, -0.2, 0.05], 0.01),
        ([1.1, 0.7, -0.15], 0.02),
        ([-1.3, 0.4, 0.2], -0.03),
    ];
    let mut parts: [Vec<f64>; 6] = Default::default();
    for seed in 1..=16 {
        let [first, second] = visits(seed);
        let target = pyramid(first);
        for (shift_m, yaw_rad) in displacements {
            // Each by some more, so that voxels halve the surfaces otherwise.
            let shift_m = shift_m.map(|m| m + 0.03 * seed as f64);
            let by = turned(yaw_rad, shift_m);
            let found = align(&target, &pyramid(moved(&by, &second)), &[]).unwrap();
            let between = found.target_from_source * by;
            let error = [between.rotation.scaled_axis(), between.translation.vector];
            for (k, part) in parts.iter_mut().enumerate() {
                // What is allowed for bent visits is not needed here, and would hide the rest.
                let allowed_m2 = if k < 3 { 0.0 } else { found.allowance_m * found.allowance_m };
                part.push(error[k / 3][k % 3].abs() / (found.covariance[(k, k)] - allowed_m2).sqrt());
            }
        }
    }
    let mut inside = 0;
    for (part, name) in parts.iter_mut().zip(["roll", "pitch", "yaw", "x", "y", "z"]) {
        part.sort_by(f64::total_cmp);
        let within = |most: f64| part.iter().filter(|&&sigmas| sigmas < most).count();
        let (middle, most) = (part[part.len() / 2], part[part.len() - 1]);
        println!(
            "{name}: {} of {} within 3σ, {} within σ; {middle:.2}σ in the middle, {most:.2}σ at most",
            within(3.0),
            part.len(),
            within(1.0),
        );
        assert!(middle > 0.1, "{name}: {middle}σ in the middle");
        inside += within(3.0);
    }
    let all: usize = parts.iter().map(Vec::len).sum();
    assert!(inside as f64 >= 0.95 * all as f64, "{inside} of {all} within 3σ");
}
