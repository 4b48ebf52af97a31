//! A wrong loop closure.

use super::poses::{Poses, Travel, smooth_step};
use crate::error::SimError;
use crate::random::Random;

/// Places considered for the loop; more of them would find the same places more exactly.
const PLACES: usize = 600;
/// The places found may be nearer or farther than asked for by this share.
const TOLERANCE: f64 = 0.1;

/// Maps two places `jump_m` apart onto each other.
pub(super) fn close(poses: &mut Poses, travel: &Travel, jump_m: f64, seed: u64) -> Result<(), SimError> {
    let (first, second) = places(poses, travel, jump_m, seed)?;
    let gap = poses[first].translation.vector - poses[second].translation.vector;
    let shift = gap.normalize() * jump_m;
    let (start_m, end_m) = (travel.0[first], travel.0[second]);
    for (pose, travel_m) in poses.iter_mut().zip(&travel.0).skip(first) {
        pose.translation.vector += shift * smooth_step((travel_m - start_m) / (end_m - start_m));
    }
    Ok(())
}

/// Two places of the run about `jump_m` apart: by chance, among those with the most travel between them, since
/// a long stretch bends more gently.
fn places(poses: &Poses, travel: &Travel, jump_m: f64, seed: u64) -> Result<(usize, usize), SimError> {
    let count = poses.len().min(PLACES);
    let index = |n: usize| n * (poses.len() - 1) / (count - 1).max(1);
    let mut candidates = Vec::new();
    let (mut largest_m, mut longest_m) = (0.0, 0.0);
    for i in (0..count).map(index) {
        for j in (0..count).map(index).filter(|&j| j > i) {
            let apart_m = (poses[j].translation.vector - poses[i].translation.vector).norm();
            largest_m = f64::max(largest_m, apart_m);
            if (apart_m - jump_m).abs() <= TOLERANCE * jump_m {
                longest_m = f64::max(longest_m, travel.0[j] - travel.0[i]);
                candidates.push((i, j));
            }
        }
    }
    candidates.retain(|&(i, j)| travel.0[j] - travel.0[i] >= longest_m / 2.0);
    let choice = Random::new(seed, &[b'e'.into(), b'l'.into()]).index(candidates.len());
    candidates.get(choice).copied().ok_or(SimError::NoSuchPlaces { asked_m: jump_m, largest_m })
}
