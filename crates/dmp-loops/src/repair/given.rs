//! A run mended by constraints that somebody knows.

use dmp::{Config, PosedLog, Progress, Run};
use dmp_log::ScanLog;
use dmp_sensor::{PoseEdge, Trajectory};

use super::chain::Chain;
use super::consistent::factor;
use super::{RepairOptions, of_keyframes};
use crate::{LoopError, optimise};

/// The run with its poses where these constraints and its own steps put them best; constraints are between scans, called by their
/// numbers in the log, of the body. None is doubted and no map is looked at: with true ones it is the best that a repair can come to.
/// `None` where the run does not move or none of them is between two of its keyframes.
///
/// # Errors
/// When log and run do not belong together, or the graph cannot be optimised.
pub fn mend_by(
    log: &dyn ScanLog,
    run: &Run,
    config: &Config,
    constraints: &[PoseEdge],
    options: &RepairOptions,
    progress: &dyn Progress,
) -> Result<Option<Trajectory>, LoopError> {
    let posed = PosedLog::new(log, run, config, progress)?;
    let Some(chain) = Chain::new(&posed) else { return Ok(None) };
    let edges = of_keyframes(&chain, constraints);
    if edges.is_empty() {
        return Ok(None);
    }
    let error = options.step_error.times(factor(&chain, &edges, options.step_error, &options.optimise)?);
    let found = optimise(&chain.graph(error)?, &edges, &options.optimise).map_err(LoopError::Graph)?;
    chain.taken_along(&run.trajectory, &found.world_from_body).map(Some)
}
