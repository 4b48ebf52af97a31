//! What a camera with structured light, such as the Kinect, makes of what it sees: Nguyen, Izadi & Lovell,
//! "Modeling Kinect sensor noise for improved 3D reconstruction and tracking" (3DIMPVT 2012), with the holes that
//! such images have.

use std::f64::consts::FRAC_PI_2;

use dmp_sensor::{DepthNoise, PinholeCamera};

use super::view::Seen;
use crate::random::Random;

/// The projector is so far from the camera along the image's rows, metres.
const BASELINE_M: f64 = 0.075;
/// Focal length of the sensor itself, pixels, whatever the size of the images, and the resolution of its
/// disparities.
const SENSOR_FOCAL_PX: f64 = 525.0;
const DISPARITY_STEP_PX: f64 = 0.125;
/// Nearest and farthest depth that is measured, metres, and the cosine of the steepest incidence (80°).
const DEPTHS_M: [f64; 2] = [0.45, 7.0];
const LEAST_COS: f64 = 0.173_648_177_666_930_35;
/// Standard deviation of where a pixel looks, pixels. It shows at edges only: elsewhere it is part of the noise of
/// depths.
const LATERAL_PX: f64 = 0.8;
/// Surfaces farther apart than this share of their depth are two, with an edge between them.
const EDGE: f64 = 0.04;
/// Share of the readings that get lost at grazing incidence beside those of the surface: this · (1 − cos θ)⁴.
const LOST_GRAZING: f64 = 0.6;
/// Edge of the patches in which readings get lost, pixels of the sensor.
const PATCH_PX: f64 = 4.0;

/// Standard deviation of a depth, metres: that of a surface seen squarely and what grazing adds.
pub(super) fn sigma_m(depth_m: f64, cos_incidence: f64) -> f64 {
    let angle = libm::acos(cos_incidence);
    let steepness = angle / (FRAC_PI_2 - angle).max(1e-3);
    DepthNoise::KINECT.sigma_m(depth_m) + 0.0001 / depth_m.sqrt() * steepness * steepness
}

/// The depths that a camera measures of what its pixels see, row by row, metres; 0 where it measures nothing. A
/// function of the seed and the index of the image.
pub(super) fn measured(seen: &[Seen], camera: &PinholeCamera, seed: u64, image: u64) -> Vec<f64> {
    let width = camera.size_px()[0] as usize;
    let focal_px = camera.focal_px()[0].abs();
    let mut depths_m = vec![0.0; seen.len()];
    let mut lit = Vec::new();
    let patch = ((PATCH_PX * focal_px / SENSOR_FOCAL_PX) as usize).max(1);
    for (row, line) in depths_m.chunks_exact_mut(width).enumerate() {
        let mut random = Random::new(seed, &[b'r'.into(), b'n'.into(), image, row as u64]);
        let here = &seen[row * width..(row + 1) * width];
        shadowed(here, focal_px, &mut lit);
        for (column, depth_m) in line.iter_mut().enumerate() {
            let at = if beside_edge(seen, width, row, column) {
                jittered(&mut random, seen.len() / width, width, row, column)
            } else {
                row * width + column
            };
            let Seen { depth_m: truly_m, cos_incidence, lost } = seen[at];
            let mut of_patch = Random::new(
                seed,
                &[b'r'.into(), b'h'.into(), image, (row / patch) as u64, (column / patch) as u64],
            );
            let in_reach = (DEPTHS_M[0]..=DEPTHS_M[1]).contains(&truly_m) && cos_incidence > LEAST_COS;
            if in_reach && lit[column] && !of_patch.chance(lost + grazing(cos_incidence)) {
                *depth_m = with_noise(truly_m, sigma_m(truly_m, cos_incidence), &mut random);
            }
        }
    }
    depths_m
}

fn grazing(cos_incidence: f64) -> f64 {
    let away = (1.0 - cos_incidence) * (1.0 - cos_incidence);
    LOST_GRAZING * away * away
}

/// A depth with noise, through a disparity that is rounded. Rounding is part of the noise.
fn with_noise(depth_m: f64, sigma_m: f64, random: &mut Random) -> f64 {
    let disparity_px = SENSOR_FOCAL_PX * BASELINE_M / depth_m;
    let sigma_px = sigma_m * disparity_px / depth_m;
    let rounding_px2 = DISPARITY_STEP_PX * DISPARITY_STEP_PX / 12.0;
    let drawn_px = (sigma_px * sigma_px - rounding_px2).max(0.0).sqrt();
    let noisy_px = disparity_px + drawn_px * random.normal();
    let rounded_px = libm::round(noisy_px / DISPARITY_STEP_PX) * DISPARITY_STEP_PX;
    if rounded_px > 0.0 { SENSOR_FOCAL_PX * BASELINE_M / rounded_px } else { 0.0 }
}

/// Whether surfaces at different depths are seen within two pixels.
fn beside_edge(seen: &[Seen], width: usize, row: usize, column: usize) -> bool {
    let (height, depth_m) = (seen.len() / width, seen[row * width + column].depth_m);
    let columns = [column.saturating_sub(2), (column + 2).min(width - 1)];
    let rows = [row.saturating_sub(2), (row + 2).min(height - 1)];
    let near = columns.map(|column| row * width + column).into_iter();
    let mut near = near.chain(rows.map(|row| row * width + column));
    near.any(|pixel| (seen[pixel].depth_m - depth_m).abs() > EDGE * depth_m)
}

/// A pixel about one, as the camera looks.
fn jittered(random: &mut Random, height: usize, width: usize, row: usize, column: usize) -> usize {
    let mut off = |at: usize, count: usize| {
        let at = libm::round(at as f64 + LATERAL_PX * random.normal());
        at.clamp(0.0, (count - 1) as f64) as usize
    };
    off(row, height) * width + off(column, width)
}

/// Which pixels of a row the projector reaches: those that nothing nearer hides from it. A surface at the column u
/// with the disparity d lies at the column u + d of the projector, which stands on the side of small columns.
fn shadowed(line: &[Seen], focal_px: f64, lit: &mut Vec<bool>) {
    let disparity_px = |seen: &Seen| focal_px * BASELINE_M / seen.depth_m;
    let most_px = focal_px * BASELINE_M / DEPTHS_M[0] * 2.0;
    let mut nearest_px = vec![0.0_f64; line.len() + most_px as usize + 2];
    let column = |u: usize, d: f64| (u as f64 + d.min(most_px)) as usize;
    for (u, seen) in line.iter().enumerate() {
        let d = disparity_px(seen);
        for at in &mut nearest_px[column(u, d)..=column(u, d) + 1] {
            *at = at.max(d);
        }
    }
    lit.clear();
    // Slanted surfaces have neighbours that are nearer, by less than a pixel for most.
    let tolerance = |d: f64| 1.5 + 0.02 * d;
    lit.extend(line.iter().enumerate().map(|(u, seen)| {
        let d = disparity_px(seen);
        nearest_px[column(u, d)] <= d + tolerance(d)
    }));
}
