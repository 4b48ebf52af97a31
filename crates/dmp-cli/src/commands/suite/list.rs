//! What is not in the cache, for other programs that score it.

use dmp_shard::ShardPlan;
use serde::Serialize;

use super::kept::{Found, Kept};
use super::options;
use super::plan::Plan;
use crate::console::{Common, Usage};
use crate::options::{Asked, input, scoring};

/// The whole list.
#[derive(Debug, Serialize)]
pub(super) struct List {
    /// Always `dmp-suite-list/1`.
    schema: &'static str,
    dmp_version: &'static str,
    /// The folder of results.
    cache: String,
    /// Logs that can be scored and are not in the cache.
    pub(super) logs: Vec<Missing>,
}

/// A log to be scored.
#[derive(Debug, Serialize)]
pub(super) struct Missing {
    name: String,
    /// Behind `dmp`.
    arguments: Vec<String>,
    /// Where what that prints belongs.
    result: String,
    /// Whether `dmp shard` takes these arguments, too.
    is_in_parts: bool,
}

/// Whether `dmp shard` takes these arguments, too.
fn is_in_parts(asked: &Asked) -> bool {
    let is_whole = asked.has(&scoring::QUICK) || !asked.all(&input::MAPS).is_empty();
    !is_whole && ShardPlan::check_settings(&asked.config()).is_ok()
}

impl List {
    /// What is to be scored. A damaged result is removed: what is found in its place later is another one.
    pub(super) fn of(plan: &Plan, kept: &mut Kept, common: &Common) -> anyhow::Result<Self> {
        let mut logs: Vec<Missing> = Vec::new();
        for log in plan.logs.iter().filter(|log| log.runs.len() >= plan.least_runs) {
            common.host.go_on()?;
            let file = kept.file_of(log, common)?;
            match kept.find(&file, log) {
                Found::Whole(_) => continue,
                Found::Damaged(_) => kept.discard(&file)?,
                Found::Failed(_) | Found::Missing => {}
            }
            let arguments = log.arguments();
            let is_in_parts = is_in_parts(&options::parsed(&arguments).map_err(Usage)?);
            let result = std::path::absolute(&file)?.display().to_string();
            // Logs that are the same, with the same runs and settings, have one result.
            if logs.iter().all(|other| other.result != result) {
                let arguments = std::iter::once("score".to_owned()).chain(arguments).collect();
                logs.push(Missing { name: log.name.clone(), arguments, result, is_in_parts });
            }
        }
        kept.save_index()?;
        let cache = std::path::absolute(kept.folder())?.display().to_string();
        Ok(Self { schema: "dmp-suite-list/1", dmp_version: env!("CARGO_PKG_VERSION"), cache, logs })
    }
}
