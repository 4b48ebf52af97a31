//! What is not in the cache, for other programs that score it.

use std::io::Write;

use serde::Serialize;

use super::kept::{Found, Kept};
use super::plan::Plan;
use crate::common::Common;

/// The whole list.
#[derive(Debug, Serialize)]
struct List {
    /// Always `dmp-suite-list/1`.
    schema: &'static str,
    dmp_version: &'static str,
    /// The folder of results.
    cache: String,
    /// Logs that can be scored and are not in the cache.
    logs: Vec<Missing>,
}

/// A log to be scored.
#[derive(Debug, Serialize)]
struct Missing {
    name: String,
    /// Behind `dmp`.
    arguments: Vec<String>,
    /// Where what that prints belongs.
    result: String,
}

pub(super) fn print(
    out: &mut impl Write,
    plan: &Plan,
    kept: &mut Kept,
    common: &Common,
) -> anyhow::Result<()> {
    let mut logs = Vec::new();
    for log in plan.logs.iter().filter(|log| log.runs.len() > 1) {
        let file = kept.file_of(log, common)?;
        if !matches!(kept.find(&file, log), Found::Whole(_)) {
            logs.push(Missing {
                name: log.name.clone(),
                arguments: std::iter::once("score".to_owned()).chain(log.arguments()).collect(),
                result: std::path::absolute(&file)?.display().to_string(),
            });
        }
    }
    kept.save_index()?;
    let cache = std::path::absolute(kept.folder())?.display().to_string();
    let list = List { schema: "dmp-suite-list/1", dmp_version: env!("CARGO_PKG_VERSION"), cache, logs };
    serde_json::to_writer_pretty(&mut *out, &list).map_err(std::io::Error::from)?;
    writeln!(out)?;
    Ok(())
}
