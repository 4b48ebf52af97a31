use std::sync::Arc;

use dmp_map::{BudgetCache, MapError, Store, TileExtent, TileId, TileSource};

use crate::casting::{CastBuffers, Casting, Grouping};
use crate::journey::{Tiles, travel};
use crate::lanes::{Job, Simd};
use crate::path::Path;
use crate::query::{Answer, CastSettings, Query};
use crate::tile::CastTile;

/// Casts rays into a map, with the tiles it needs in memory under a byte budget.
#[derive(Debug)]
pub struct Caster<M = Store> {
    map: M,
    settings: CastSettings,
    tiles: BudgetCache<TileId, CastTile>,
    path: Path,
    grouping: Grouping,
}

impl<M: TileSource> Caster<M> {
    /// A caster into `map` that keeps at most about `budget_bytes` of tiles in memory.
    pub fn new(map: M, settings: CastSettings, budget_bytes: usize) -> Self {
        let (tiles, path) = (BudgetCache::new(budget_bytes), Path::best());
        Self { map, settings, tiles, path, grouping: Grouping::Auto }
    }

    /// The same on another path of instructions and with rays grouped another way: for measurements, since no
    /// answer depends on either.
    #[must_use]
    pub fn with(self, path: Path, grouping: Grouping) -> Self {
        Self { path, grouping, ..self }
    }

    /// The map it casts into.
    pub fn map(&self) -> &M {
        &self.map
    }

    /// How often a tile was loaded so far.
    pub fn tile_loads(&self) -> u64 {
        self.tiles.loads()
    }

    /// Bytes of the tiles in memory.
    pub fn tile_bytes(&self) -> usize {
        self.tiles.bytes()
    }

    /// Answers every query, in order; `answers` is overwritten. The answers do not depend on how rays
    /// are grouped into blocks.
    ///
    /// # Errors
    /// When a tile that a ray needs is damaged.
    pub fn cast(
        &self,
        queries: &[Query],
        answers: &mut Vec<Answer>,
        buffers: &mut CastBuffers,
    ) -> Result<(), MapError> {
        self.path.run(CastBlock { caster: self, queries, answers, buffers })
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
        self.tiles.get(tile, || {
            let loaded = self.map.load_tile(tile)?;
            Ok(loaded.map_or_else(CastTile::default, |tile| CastTile::new(&tile, radius_m)))
        })
    }
}

struct CastBlock<'a, M> {
    caster: &'a Caster<M>,
    queries: &'a [Query],
    answers: &'a mut Vec<Answer>,
    buffers: &'a mut CastBuffers,
}

impl<M: TileSource> Job for CastBlock<'_, M> {
    type Output = Result<(), MapError>;

    #[inline(always)]
    fn on<S: Simd>(self, simd: S) -> Self::Output {
        let Self { caster, queries, answers, buffers: CastBuffers { journey, lists } } = self;
        let Caster { settings, grouping, .. } = *caster;
        answers.clear();
        answers.resize(queries.len(), Answer::default());
        match grouping {
            Grouping::Single => journey.order.as_given(queries),
            _ => journey.order.by_direction(queries),
        }
        let mut casting = Casting { grouping, wanted: settings.wanted, answers, lists };
        travel(simd, caster, &settings, queries, journey, &mut casting)
    }
}
