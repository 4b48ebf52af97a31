//! The merge stage: sums of voxels become surfels, some tiles at a time.

use std::collections::BTreeMap;
use std::path::PathBuf;

use dmp::{EvaluateError, PlannedScore, Stage as Doing, so_far};
use dmp_map::{Durability, Lattice, Origin, SumsFile, TileId, TileSpan, merge_sums};
use serde::{Deserialize, Serialize};

use super::error::ShardError;
use super::folder::stem_of;
use super::fuse::{FusedPart, sums_name};
use super::opened::{Shard, check_frames};
use super::part::Part;
use super::stage::Stage;

/// Tiles of the maps of all runs, ordered by run and tile: a part has consecutive ones.
pub(super) type RunTileVoxels = BTreeMap<(usize, TileId), u64>;

/// The result of a part: for every run the piece of its map, if any.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct MergedPart {
    pub(super) pieces: Vec<Option<MapPiece>>,
}

/// Some tiles of a map.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct MapPiece {
    /// Row and column of the first tile, and of the first one after the piece.
    from: Option<(i32, i32)>,
    to: Option<(i32, i32)>,
    pub(super) tiles: u64,
    pub(super) surfels: u64,
    pub(super) thin_voxels: u64,
    pub(super) bytes: u64,
}

impl MapPiece {
    pub(super) fn span(&self) -> TileSpan {
        let tile = |(y, x): (i32, i32)| TileId { y, x };
        TileSpan { from: self.from.map(tile), to: self.to.map(tile) }
    }
}

/// The name of the file with a piece of a run's map.
pub(super) fn piece_name(part: Part, file_stem: &str) -> String {
    format!("{}.{file_stem}.dmpmap", stem_of(Stage::Merge, part))
}

/// For every run the tiles of a part, balanced by the voxels to merge; `None` for a run without any.
pub(super) fn spans_of(voxels: &RunTileVoxels, runs: usize, part: Part) -> Vec<Option<TileSpan>> {
    let keys: Vec<&(usize, TileId)> = voxels.keys().collect();
    let share = part.share(&voxels.values().copied().collect::<Vec<_>>());
    let (first, end) = (keys.get(share.start), keys.get(share.end));
    let span = |run: usize| {
        if share.is_empty() {
            return None;
        }
        // A run's first piece begins at the edge of the world: discs reach into tiles that have nothing else.
        let is_first = |tile: TileId| {
            voxels.range((run, TileId { y: i32::MIN, x: i32::MIN })..).next().map(|(key, _)| key.1)
                == Some(tile)
        };
        let from = match first {
            Some(&&(of, _)) if of > run => return None,
            Some(&&(of, tile)) if of == run => Some(tile).filter(|&tile| !is_first(tile)),
            _ => None,
        };
        let to = match end {
            Some(&&(of, _)) if of < run => return None,
            Some(&&(of, tile)) if of == run && is_first(tile) => return None,
            Some(&&(of, tile)) if of == run => Some(tile),
            _ => None,
        };
        Some(TileSpan { from, to })
    };
    (0..runs).map(span).collect()
}

impl Shard<'_> {
    /// Adds up the sums of all fused parts in some tiles, computes surfels and writes these pieces of the
    /// maps. Returns the receipt file that marks the part as done.
    ///
    /// # Errors
    /// When a fused part is missing, damaged or of another plan, or nothing can be written.
    pub fn merge(&self, part: Part) -> Result<PathBuf, ShardError> {
        let planned = self.planned()?;
        let (fused, voxels) = self.fused(&planned)?;
        let lattice = planned.lattice()?;
        let spans = spans_of(&voxels, self.runs.len(), part);
        let map_bytes = planned.map_bytes() / 2;
        let pieces = (0..).zip(planned.runs()).zip(&spans).map(|((number, run), span)| {
            let Some(span) = *span else { return Ok(None) };
            let files = fused.iter().map(|(of, fused)| {
                let path = self.folder.file(&sums_name(*of, run.file_stem));
                SumsFile::listed(&path, fused.sums.get(number).cloned().unwrap_or_default())
            });
            let files = files.collect::<Result<Vec<_>, _>>()?;
            let path = self.folder.file(&piece_name(part, run.file_stem));
            let origin = Origin { text: self.piece_text(part, run.name), own_from_world: run.own_from_world };
            let piece = self.write_piece((lattice, &files), span, map_bytes, (&planned, &path, &origin));
            piece.map(Some).map_err(|error| match error {
                ShardError::Map(error) => ShardError::Evaluate(EvaluateError::map_of(run.name)(error)),
                error => error,
            })
        });
        let merged = MergedPart { pieces: pieces.collect::<Result<_, ShardError>>()? };
        self.folder.write(Stage::Merge, part, &merged)
    }

    fn write_piece(
        &self,
        (lattice, files): (Lattice, &[SumsFile]),
        span: TileSpan,
        map_bytes: usize,
        (planned, path, origin): (&PlannedScore<'_>, &std::path::Path, &Origin),
    ) -> Result<MapPiece, ShardError> {
        let on_tile = so_far(self.watch.progress, Doing::Surfels);
        let to = (path, origin, Durability::Durable);
        let merge = || merge_sums(lattice, files, span, map_bytes, to, &on_tile);
        let summary = planned.install(merge)?;
        let place = |tile: TileId| (tile.y, tile.x);
        Ok(MapPiece {
            from: span.from.map(place),
            to: span.to.map(place),
            tiles: summary.tiles,
            surfels: summary.surfels,
            thin_voxels: summary.thin_voxels,
            bytes: summary.bytes,
        })
    }

    /// The description in the header of a piece of a map.
    pub(super) fn piece_text(&self, part: Part, run: &str) -> String {
        format!("dmp {}; plan {}; merge {part}; run {run}", env!("CARGO_PKG_VERSION"), self.plan.hash())
    }

    /// The results of the fuse stage, checked to have every scan of the plan once; and the number of voxels
    /// to merge.
    pub(super) fn fused(
        &self,
        planned: &PlannedScore<'_>,
    ) -> Result<(Vec<(Part, FusedPart)>, RunTileVoxels), ShardError> {
        let fused: Vec<(Part, FusedPart)> = self.folder.read(Stage::Fuse)?;
        check_frames(Stage::Fuse, fused.iter().map(|(_, part)| &part.frames), &planned.used_scans())?;
        let mut voxels = RunTileVoxels::new();
        for (run, list) in fused.iter().flat_map(|(_, part)| part.sums.iter().enumerate()) {
            for block in &list.blocks {
                *voxels.entry((run, block.tile())).or_default() += block.voxels();
            }
        }
        Ok((fused, voxels))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_of_every_run_is_in_one_part() {
        let tile = |k: i32| TileId { y: k / 4, x: 3 * (k % 4) };
        let voxels: RunTileVoxels = (0..3)
            .flat_map(|run| (0..10).map(move |k| ((run, tile(k)), (7 * k as u64 + run as u64) % 5 * 100)))
            .collect();
        for of in [1, 2, 5, 40] {
            let spans: Vec<_> =
                (1..=of).map(|number| spans_of(&voxels, 3, Part::new(number, of).unwrap())).collect();
            for run in 0..3 {
                // Also around its tiles, where it has no voxels of its own.
                for y in -3..6 {
                    for x in -3..14 {
                        let tile = TileId { y, x };
                        let parts =
                            spans.iter().filter(|spans| spans[run].is_some_and(|span| span.contains(tile)));
                        assert_eq!(parts.count(), 1, "{of} parts, run {run}, tile {tile}");
                    }
                }
            }
        }
        assert_eq!(spans_of(&RunTileVoxels::new(), 2, Part::ALL), [None, None]);
    }
}
