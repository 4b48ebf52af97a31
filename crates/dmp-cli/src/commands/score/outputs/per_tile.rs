//! A table with the scores of every run in every tile.

use std::io::Write as _;
use std::path::Path;

use dmp::{Report, TileReport};

use super::rows::{RunRows, columns, scores};
use crate::files::save;

/// Writes a line for every run and tile in which returns of the run lie.
pub(super) fn write(path: &Path, report: &Report, runs: &[RunRows]) -> anyhow::Result<()> {
    let edge_m = report.config.tile_edge_m;
    save(path, |out| {
        writeln!(out, "run,column,row,x_min_m,y_min_m,edge_m,{}", columns(report.config.scales))?;
        let mut line = String::new();
        for TileReport { run, tile, sums } in &report.tiles {
            let Some(run) = runs.get(*run) else { continue };
            line.clear();
            scores(&mut line, sums, run);
            let [x_min_m, y_min_m] = [tile.x, tile.y].map(|step| f64::from(step) * edge_m);
            write!(out, "{},{},{},{x_min_m},{y_min_m},{edge_m},{line}", run.name, tile.x, tile.y)?;
        }
        Ok(())
    })
}
