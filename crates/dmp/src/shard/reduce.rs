//! The reduce stage: the results of all parts become a report.

use dmp_sensor::ReturnCounts;

use super::cast::scored_frames;
use super::error::ShardError;
use super::merge::MergedPart;
use super::opened::{Shard, check_frames};
use super::part::Part;
use super::stage::Stage;
use crate::evaluation::FuseTotals;
use crate::heads::Heads;
use crate::report::{Findings, MapReport, MapSummary, PassTimes, Report};
use crate::work::{Casting, MapFacts};

impl Shard<'_> {
    /// Adds up the results of all parts. The report equals that of [`evaluate`](crate::evaluate) to the bit,
    /// except for `timing` and `memory`, which are those of this process, and sums by tile, which it lacks.
    ///
    /// # Errors
    /// When a part is missing, damaged or of another plan, or a scan is missing or duplicated.
    pub fn reduce(&self) -> Result<Report, ShardError> {
        let start = std::time::Instant::now();
        let mut planned = self.planned()?;
        let (fused, _) = self.fused(&planned)?;
        let mut counts = ReturnCounts::default();
        fused.iter().for_each(|(_, part)| counts.merge(&part.counts));
        planned.fused = FuseTotals { counts: Some(counts), scratch_bytes: 0 };
        let merged: Vec<(Part, MergedPart)> = self.folder.read(Stage::Merge)?;
        let cast: Vec<(Part, Casting)> = self.folder.read(Stage::Cast)?;
        check_frames(Stage::Cast, cast.iter().map(|(_, part)| &part.done), &scored_frames(&planned))?;
        let mut scored = planned.put_together(cast.into_iter().map(|(_, part)| part).collect())?;
        planned.account(&mut scored)?;
        let drift = if planned.measures_drift() { Some(self.drifted(&planned)?) } else { None };

        let total_s = start.elapsed().as_secs_f64();
        let threads = planned.means.threads;
        let runs = planned.runs.iter().enumerate().map(|(number, run)| run.like(map_of(&merged, number)));
        let runs: Vec<_> = runs.collect();
        let findings = Findings {
            heads: Heads::Log(self.log),
            damage: &self.log.summary().damage,
            settings: &planned.settings,
            means: &planned.means,
            plan: &planned.plan,
            runs: &runs,
            fused: planned.fused,
            scored: &scored,
            timing: PassTimes { total_s, threads, ..PassTimes::default() },
        };
        let mut report = findings.report();
        report.drift = drift;
        let pieces = merged.iter().flat_map(|(_, part)| part.pieces.iter().flatten());
        report.memory.disk_bytes += pieces.map(|piece| piece.bytes).sum::<u64>();
        self.plan.content.vetted.put_into(&mut report);
        Ok(report)
    }
}

/// The report's summary of a run's map, whose pieces have no tile in common.
fn map_of(merged: &[(Part, MergedPart)], run: usize) -> MapSummary {
    let pieces = || merged.iter().filter_map(|(_, part)| (*part.pieces.get(run)?).as_ref());
    let thin_voxels = Some(pieces().map(|piece| piece.thin_voxels).sum());
    let report = MapReport {
        surfels: pieces().map(|piece| piece.surfels).sum(),
        tiles: pieces().map(|piece| piece.tiles).sum(),
        thin_voxels,
        ..MapReport::default()
    };
    MapSummary { report, facts: MapFacts { fused: true, thin_voxels, ..MapFacts::default() } }
}
