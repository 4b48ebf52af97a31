//! The reduce stage: the results of all parts become a report.

use dmp::Casting;
use dmp_report::{MapReport, Report};
use dmp_sensor::ReturnCounts;

use super::error::ShardError;
use super::merge::MergedPart;
use super::opened::{Shard, check_frames};
use super::part::Part;
use super::stage::Stage;

impl Shard<'_> {
    /// Adds up the results of all parts. The report equals that of [`evaluate`](dmp::evaluate) to the bit,
    /// except for `timing` and `memory`, which are those of this process, and for what it lacks: thickness, surfels left out,
    /// and sums by tile.
    ///
    /// # Errors
    /// When a part is missing, damaged or of another plan, or a scan is missing or duplicated.
    pub fn reduce(&self) -> Result<Report, ShardError> {
        let start = std::time::Instant::now();
        let planned = self.planned()?;
        let (fused, _) = self.fused(&planned)?;
        let mut counts = ReturnCounts::default();
        fused.iter().for_each(|(_, part)| counts.merge(&part.counts));
        let merged: Vec<(Part, MergedPart)> = self.folder.read(Stage::Merge)?;
        let cast: Vec<(Part, Casting)> = self.folder.read(Stage::Cast)?;
        check_frames(Stage::Cast, cast.iter().map(|(_, part)| part.scans()), &planned.used_scans())?;
        let drift = if planned.measures_drift() { Some(self.drifted(&planned)?) } else { None };
        let maps = (0..self.runs.len()).map(|run| map_of(&merged, run)).collect();
        let cast = cast.into_iter().map(|(_, part)| part).collect();
        let mut report = planned.report(counts, maps, cast, start.elapsed().as_secs_f64())?;
        report.add_drift(drift);
        let pieces = merged.iter().flat_map(|(_, part)| part.pieces.iter().flatten());
        report.memory.disk_bytes += pieces.map(|piece| piece.bytes).sum::<u64>();
        self.plan.content.vetted.put_into(&mut report);
        Ok(report)
    }
}

/// The report of a run's map, whose pieces have no tile in common.
fn map_of(merged: &[(Part, MergedPart)], run: usize) -> MapReport {
    let pieces = || merged.iter().filter_map(|(_, part)| (*part.pieces.get(run)?).as_ref());
    MapReport {
        surfels: pieces().map(|piece| piece.surfels).sum(),
        tiles: pieces().map(|piece| piece.tiles).sum(),
        thin_voxels: Some(pieces().map(|piece| piece.thin_voxels).sum()),
        ..MapReport::default()
    }
}
