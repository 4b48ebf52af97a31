//! Casts blocks of rays into a map.

use std::sync::Arc;

use dmp_disk::{BudgetCache, NextUse};
use dmp_map::{MapError, Store, TileExtent, TileId, TileSource};

use crate::casting::{CastBuffers, Casting, Grouping};
use crate::journey::{Tiles, travel};
use crate::lanes::{Job, Simd};
use crate::path::Path;
use crate::query::{Answer, CastSettings, Hit, HitDisc, Query};
use crate::within::CastTile;

/// The tiles of one or more maps in memory, ready for casting, under one byte budget.
#[derive(Debug)]
pub struct TileCache(BudgetCache<(usize, TileId), CastTile>);

impl TileCache {
    /// Holds about `budget_bytes` of tiles.
    pub fn new(budget_bytes: usize) -> Self {
        Self(BudgetCache::new(budget_bytes))
    }

    /// The same with a function that predicts when a tile, given by its map's number and its id, is next needed.
    pub fn foreseeing(budget_bytes: usize, next_use: Box<NextUse<(usize, TileId)>>) -> Self {
        Self(BudgetCache::foreseeing(budget_bytes, next_use))
    }

    /// Number of tile loads so far.
    pub fn loads(&self) -> u64 {
        self.0.loads()
    }
}

/// Casts rays into a map, with the tiles it needs in memory under a byte budget.
#[derive(Debug)]
pub struct Caster<M = Store> {
    map: M,
    settings: CastSettings,
    tiles: Arc<TileCache>,
    /// The number of this map in the cache.
    number: usize,
    path: Path,
    grouping: Grouping,
}

impl<M: TileSource> Caster<M> {
    /// A caster into `map` that keeps at most about `budget_bytes` of tiles in memory.
    pub fn new(map: M, settings: CastSettings, budget_bytes: usize) -> Self {
        Self::sharing(map, settings, &Arc::new(TileCache::new(budget_bytes)), 0)
    }

    /// A caster that shares its tiles' memory with others, whose maps have other numbers.
    pub fn sharing(map: M, settings: CastSettings, tiles: &Arc<TileCache>, number: usize) -> Self {
        let (tiles, path) = (Arc::clone(tiles), Path::best());
        Self { map, settings, tiles, number, path, grouping: Grouping::Auto }
    }

    /// Loads a tile ahead of use.
    ///
    /// # Errors
    /// When it is damaged; the rays that need it report the same error.
    pub fn prefetch(&self, tile: TileId) -> Result<(), MapError> {
        self.load(tile).map(drop)
    }

    /// The same with another instruction path and another grouping of rays: for measurements, since no answer depends
    /// on either.
    #[must_use]
    pub fn with(self, path: Path, grouping: Grouping) -> Self {
        Self { path, grouping, ..self }
    }

    /// The map it casts into.
    pub fn map(&self) -> &M {
        &self.map
    }

    /// Number of tile loads so far, by all casters that share its memory.
    pub fn tile_loads(&self) -> u64 {
        self.tiles.0.loads()
    }

    /// Answers every query, in order; `answers` is overwritten. The answers do not depend on the division of rays into
    /// blocks.
    ///
    /// # Errors
    /// When a tile that a ray needs is damaged.
    pub fn cast(
        &self,
        queries: &[Query],
        answers: &mut Vec<Answer>,
        buffers: &mut CastBuffers,
    ) -> Result<(), MapError> {
        self.cast_block(queries, answers, None, buffers, false)
    }

    /// The same for the returns last cast with `buffers`, into this map or another, but posed by another trajectory. It
    /// reuses the order of rays found then. For other returns the answers are correct too, but slow.
    ///
    /// # Errors
    /// As [`Caster::cast`].
    pub fn cast_reposed(
        &self,
        queries: &[Query],
        answers: &mut Vec<Answer>,
        buffers: &mut CastBuffers,
    ) -> Result<(), MapError> {
        self.cast_block(queries, answers, None, buffers, true)
    }

    /// The same, and for each query the disc that its ray crosses at one of the ranges of its answer, its normal turned towards
    /// the ray's origin (normal · direction ≤ 0); `None` for a miss. `discs` is overwritten too.
    ///
    /// # Errors
    /// As [`Caster::cast`].
    pub fn cast_with_discs(
        &self,
        queries: &[Query],
        answers: &mut Vec<Answer>,
        (hit, discs): (Hit, &mut Vec<Option<HitDisc>>),
        buffers: &mut CastBuffers,
    ) -> Result<(), MapError> {
        discs.clear();
        discs.resize(queries.len(), None);
        self.cast_block(queries, answers, Some((hit, discs)), buffers, false)
    }

    fn cast_block(
        &self,
        queries: &[Query],
        answers: &mut Vec<Answer>,
        discs: Option<(Hit, &mut [Option<HitDisc>])>,
        buffers: &mut CastBuffers,
        reposed: bool,
    ) -> Result<(), MapError> {
        self.path.run(CastBlock { caster: self, queries, answers, discs, buffers, reposed })
    }
}

impl<M: TileSource> Tiles for Caster<M> {
    type Tile = CastTile;

    fn edge_m(&self) -> f64 {
        self.map.tile_edge_m()
    }

    fn bounds(&self) -> Option<[TileId; 2]> {
        self.map.tile_bounds()
    }

    fn extent(&self, tile: TileId) -> Option<TileExtent> {
        self.map.tile_extent(tile)
    }

    fn load(&self, tile: TileId) -> Result<Arc<CastTile>, MapError> {
        let radius_m = self.map.disc_radius_m() as f32;
        self.tiles.0.get((self.number, tile), || {
            let loaded = self.map.load_tile(tile)?;
            Ok(loaded.map_or_else(CastTile::default, |tile| CastTile::build(&tile, radius_m)))
        })
    }
}

struct CastBlock<'a, M> {
    caster: &'a Caster<M>,
    queries: &'a [Query],
    answers: &'a mut Vec<Answer>,
    /// One per query.
    discs: Option<(Hit, &'a mut [Option<HitDisc>])>,
    buffers: &'a mut CastBuffers,
    /// Whether the buffers have the order of the same returns.
    reposed: bool,
}

impl<M: TileSource> Job for CastBlock<'_, M> {
    type Output = Result<(), MapError>;

    #[inline(always)]
    fn on<S: Simd>(self, simd: S) -> Self::Output {
        let Self { caster, queries, answers, discs, buffers, reposed } = self;
        let CastBuffers { journey, lists } = buffers;
        let Caster { settings, grouping, .. } = *caster;
        // If there are tiles, every ray arrives and writes its answer.
        if caster.map.tile_bounds().is_none() {
            answers.clear();
        }
        answers.resize(queries.len(), Answer::default());
        let radius_m = caster.map.disc_radius_m() as f32;
        match grouping {
            Grouping::Single => journey.order.as_given(queries),
            _ if reposed => journey.order.of_last(queries, radius_m),
            _ => journey.order.by_direction(queries, radius_m),
        }
        let mut casting = Casting { grouping, wanted: settings.wanted, answers, discs, lists };
        travel(simd, caster, &settings, queries, journey, &mut casting)
    }
}
