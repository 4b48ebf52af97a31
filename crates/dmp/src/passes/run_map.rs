//! The finished map of a run.

use dmp_map::{Store, Thickness, TileEntry};
use dmp_runs::EvaluateError;

use crate::passes::evaluation::Evaluation;

/// Memory of a surfel while the tree of its tile is built, bytes.
const BUILT_BYTES: usize = 350;

/// The facts about a map beside its surfels.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct MapFacts {
    /// Whether its surfels have the segments that observed them.
    pub(crate) fused: bool,
    /// Occupied voxels without a surfel; `None` for a given store.
    pub(crate) thin_voxels: Option<u64>,
    /// Of a map that was fused from the scans.
    pub(crate) thickness: Option<Thickness>,
    /// Points of a given cloud, or triangles of a mesh, that are not finite.
    pub(crate) points_dropped: u64,
    /// Conversions of a given map, in words.
    pub(crate) notes: Vec<String>,
    /// What was left out; `None` for a given map.
    pub(crate) trails: Option<TrailFacts>,
}

/// What was left out of a run's map.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
pub(crate) struct TrailFacts {
    /// Surfels and tiles before.
    pub(crate) surfels: u64,
    pub(crate) tiles: u64,
    /// Number of surfels that the rays contradict.
    pub(crate) contradicted: u64,
}

impl TrailFacts {
    pub(crate) fn of(fused: &Store, thinned: &Store) -> Self {
        let surfels = fused.surfels();
        let (tiles, contradicted) = (fused.entries().count() as u64, surfels - thinned.surfels());
        Self { surfels, tiles, contradicted }
    }
}

/// The map of one run, ready for casting.
#[derive(Debug)]
pub(crate) struct RunMap {
    pub(crate) store: Store,
    pub(crate) facts: MapFacts,
}

/// Bytes of the tiles of a map.
pub(crate) fn tile_bytes(map: &Store) -> u64 {
    map.entries().flat_map(TileEntry::blobs).map(|blob| u64::from(blob.bytes)).sum()
}

impl Evaluation<'_, RunMap> {
    /// Whether the memory holds the densest tile while its tree is built.
    ///
    /// # Errors
    /// When that takes more than half of it.
    pub(crate) fn holds_the_densest_tile(&self) -> Result<(), EvaluateError> {
        let entries = self.runs.iter().flat_map(|run| run.map.store.entries());
        let densest = entries.map(|tile| tile.own.surfels).max().unwrap_or(0);
        let (asked, needed) = (self.means.memory_bytes, 2 * densest as usize * BUILT_BYTES);
        if needed > asked {
            return Err(EvaluateError::TooLittleForTile { asked, needed, surfels: densest.into() });
        }
        Ok(())
    }
}
