//! Whether the units in which depth images were read fit the poses, where these units were only guessed.

use super::look::{Look, is_better_share};
use super::poses_as::enlarged;
use crate::asked::{EvaluateError, Run};

/// Other units that are usual, as parts of the guessed ones: 1000 and 5000 a metre are both.
const OTHERS: [f64; 2] = [0.2, 5.0];

/// Refuses a guess that other units beat: the scans of every run meet more often with them. Where the camera hardly moves, any
/// units do, and the guess stays.
///
/// # Errors
/// When other units fit better, and when the scans cannot be placed.
pub(super) fn check(look: &Look<'_>, runs: &[Run]) -> Result<(), EvaluateError> {
    let summary = look.heads.summary();
    let Some(guessed) = summary.depth_units_per_m.filter(|_| summary.are_depth_units_guessed) else {
        return Ok(());
    };
    // Depths that are too small by a factor fit poses that are made smaller by it.
    let as_read = share(look, runs, 1.0)?;
    for part in OTHERS {
        let other = share(look, runs, part)?;
        if is_better_share(other, as_read) {
            return Err(EvaluateError::DepthUnits {
                path: summary.path.clone(),
                units_per_m: [guessed, guessed * part],
                together: [as_read, other],
            });
        }
    }
    Ok(())
}

/// The largest share of returns that meet those of nearby scans, of any run, its path made so much larger.
fn share(look: &Look<'_>, runs: &[Run], factor: f64) -> Result<f64, EvaluateError> {
    let mut most = 0.0_f64;
    for run in runs {
        let Some(trajectory) = enlarged(&run.trajectory, factor) else { continue };
        let run = Run { trajectory, ..run.clone() };
        most = most.max(look.share(&run)?.unwrap_or(0.0));
    }
    Ok(most)
}
