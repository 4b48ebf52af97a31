//! The project's own caster in all the ways that are measured.

use std::collections::HashMap;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context as _, anyhow, bail, ensure};
use dmp_cast::{Answer, CastBuffers, CastSettings, Caster, Grouping, Path, Query, Wanted};
use dmp_map::{LooseSurfels, MapError, Tile, TileExtent, TileId, TileSource};

use super::files::Work;

/// Rays that are cast at once, as by `dmp score`.
const BLOCK_RAYS: usize = 32_768;
/// Edge of the tiles, metres, as in a map on disk.
const TILE_EDGE_M: f64 = 32.0;
/// How far behind the measured range a bounded cast looks, metres; the same for the others.
pub(super) const BOUND_M: f64 = 5.0;

/// What is cast with what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mode {
    pub(super) path: Path,
    pub(super) grouping: Grouping,
    pub(super) kind: CasterKind,
    /// All rays twice, on two threads.
    pub(super) twice: bool,
}

/// What casters differ in; the rest can be changed on one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct CasterKind {
    /// All three answers, not z1 alone.
    pub(super) three: bool,
    /// Up to [`BOUND_M`] behind the measured range.
    pub(super) bounded: bool,
    /// One tree instead of tiles.
    pub(super) one_tree: bool,
}

/// A limit to packets, see [`Grouping::UpTo`].
pub(super) const UP_TO: &str = "packets-up-to-";

/// `PATH-single`, `PATH-packets` or `PATH-packets-up-to-N`, then `-three`, `-bounded`, `-one-tree`, `-twice` where they are wanted.
impl FromStr for Mode {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        let mut rest = name;
        let mut ends = |suffix: &str| {
            let before = rest.strip_suffix(suffix);
            rest = before.unwrap_or(rest);
            before.is_some()
        };
        let [twice, one_tree, bounded, three] = ["-twice", "-one-tree", "-bounded", "-three"].map(&mut ends);
        let (path, grouping) = rest.split_once('-').with_context(|| format!("{name}: unknown mode"))?;
        let path = Path::all().into_iter().find(|known| known.name() == path);
        let path = path.with_context(|| format!("{name}: this processor has no such instructions"))?;
        let grouping = match grouping {
            "single" => Grouping::Single,
            "packets" => Grouping::Auto,
            _ if grouping.starts_with(UP_TO) => Grouping::UpTo(grouping[UP_TO.len()..].parse()?),
            _ => bail!("{name}: unknown mode"),
        };
        Ok(Self { path, grouping, kind: CasterKind { three, bounded, one_tree }, twice })
    }
}

/// A map that several casters share.
#[derive(Debug, Clone)]
struct SharedMap(Arc<LooseSurfels>);

impl TileSource for SharedMap {
    fn tile_edge_m(&self) -> f64 {
        self.0.tile_edge_m()
    }

    fn disc_radius_m(&self) -> f64 {
        self.0.disc_radius_m()
    }

    fn tile_bounds(&self) -> Option<[TileId; 2]> {
        self.0.tile_bounds()
    }

    #[inline]
    fn tile_extent(&self, tile: TileId) -> Option<TileExtent> {
        self.0.tile_extent(tile)
    }

    fn load_tile(&self, tile: TileId) -> Result<Option<Tile>, MapError> {
        self.0.load_tile(tile)
    }
}

/// A map and the rays that are cast into it.
#[derive(Debug)]
struct MapAndRays {
    map: SharedMap,
    queries: Vec<Query>,
    /// What was added to every coordinate of the files, metres.
    shift_m: [f64; 3],
}

impl MapAndRays {
    fn new(work: &Work, one_tree: bool) -> anyhow::Result<Self> {
        let (mut edge_m, mut shift_m) = (TILE_EDGE_M, [0.0; 3]);
        if one_tree {
            // The one tile begins just before the map.
            let [low, high] = work.bounds_m();
            let margin_m = work.radius_m() + 1.0;
            shift_m = [margin_m - low[0], margin_m - low[1], 0.0];
            edge_m = (high[0] - low[0]).max(high[1] - low[1]) + 2.0 * margin_m;
        }
        let map = LooseSurfels::new(edge_m, work.radius_m(), work.world_surfels(shift_m))?;
        Ok(Self { map: SharedMap(Arc::new(map)), queries: work.queries(shift_m), shift_m })
    }
}

/// Of one thread.
type Buffers = (CastBuffers, Vec<Answer>);

/// The casters and their work.
#[derive(Debug)]
pub(super) struct Own {
    work: Work,
    tiled: MapAndRays,
    one_tree: Option<MapAndRays>,
    casters: HashMap<CasterKind, Caster<SharedMap>>,
    horizon_m: f64,
    buffers: [Buffers; 2],
    tile_bytes: usize,
}

impl Own {
    pub(super) fn new(work: Work) -> anyhow::Result<Self> {
        let tiled = MapAndRays::new(&work, false)?;
        Ok(Self {
            horizon_m: work.horizon_m(),
            work,
            tiled,
            one_tree: None,
            casters: HashMap::new(),
            buffers: Default::default(),
            tile_bytes: 0,
        })
    }

    pub(super) fn rays(&self) -> usize {
        self.tiled.queries.len()
    }

    pub(super) fn surfels(&self) -> usize {
        self.work.surfels.len()
    }

    pub(super) fn tiles(&self) -> usize {
        self.tiled.map.0.tiles().count()
    }

    /// Bytes of all tiles' trees at the last [`Own::build_s`].
    pub(super) fn tile_bytes(&self) -> usize {
        self.tile_bytes
    }

    /// Goes over to some of the rays, without segments.
    pub(super) fn change_rays(&mut self, path: &std::path::Path) -> anyhow::Result<()> {
        self.work.change_rays(path)?;
        for place in [Some(&mut self.tiled), self.one_tree.as_mut()].into_iter().flatten() {
            place.queries = self.work.queries(place.shift_m);
        }
        Ok(())
    }

    fn settings(&self, kind: CasterKind) -> CastSettings {
        CastSettings {
            horizon_m: self.horizon_m,
            beyond_m: if kind.bounded { BOUND_M } else { f64::INFINITY },
            wanted: if kind.three { Wanted::Three } else { Wanted::First },
            ..CastSettings::default()
        }
    }

    /// Casts all rays once; seconds of the casting.
    pub(super) fn cast_s(&mut self, mode: Mode) -> anyhow::Result<f64> {
        self.cast(mode, |_| ())
    }

    /// Casts all rays once; ranges of z1, zn and zc of each, metres, NaN for a miss.
    pub(super) fn ranges(&mut self, mode: Mode) -> anyhow::Result<[Vec<f64>; 3]> {
        let mut ranges = [(); 3].map(|()| Vec::with_capacity(self.rays()));
        let once = Mode { twice: false, ..mode };
        self.cast(once, |answers| {
            for answer in answers {
                let of_ray = [answer.first_m, answer.nearest_m, answer.independent_m];
                ranges.iter_mut().zip(of_ray).for_each(|(all, one)| all.push(one.unwrap_or(f64::NAN)));
            }
        })?;
        Ok(ranges)
    }

    fn cast(&mut self, mode: Mode, take: impl FnMut(&[Answer])) -> anyhow::Result<f64> {
        if mode.kind.one_tree && self.one_tree.is_none() {
            self.one_tree = Some(MapAndRays::new(&self.work, true)?);
        }
        let place = self.one_tree.as_ref().filter(|_| mode.kind.one_tree).unwrap_or(&self.tiled);
        let settings = self.settings(mode.kind);
        let caster = self.casters.remove(&mode.kind);
        let caster = caster.unwrap_or_else(|| Caster::new(place.map.clone(), settings, usize::MAX));
        let caster = caster.with(mode.path, mode.grouping);
        let blocks: Vec<&[Query]> = place.queries.chunks(BLOCK_RAYS).collect();
        let [one, other] = &mut self.buffers;
        let start = Instant::now();
        if mode.twice {
            // Not in step: the second begins with the rays in the middle.
            let (first, second) = blocks.split_at(blocks.len() / 2);
            let of_other = std::thread::scope(|scope| {
                let rotated = second.iter().chain(first);
                let thread = scope.spawn(|| cast_blocks(&caster, rotated, other, |_| ()));
                cast_blocks(&caster, blocks.iter(), one, take)?;
                Ok::<_, MapError>(thread.join())
            })?;
            of_other.map_err(|_| anyhow!("the second thread ended early"))??;
        } else {
            cast_blocks(&caster, blocks.iter(), one, take)?;
        }
        let taken_s = start.elapsed().as_secs_f64();
        self.casters.insert(mode.kind, caster);
        Ok(taken_s)
    }

    /// Builds the trees of all tiles, which a new caster does for a ray straight down through each; seconds.
    pub(super) fn build_s(&mut self) -> anyhow::Result<f64> {
        let map = &self.tiled.map;
        let edge_m = map.tile_edge_m();
        let down = |tile: &Tile| {
            let highest_m = map.tile_extent(tile.id)?.z_range_m[1];
            let middle = |k: i32| (f64::from(k) + 0.5) * edge_m;
            Some(Query {
                origin_in_world_m: [middle(tile.id.x), middle(tile.id.y), highest_m + 1.0],
                direction_in_world: [0.0, 0.0, -1.0],
                measured_m: 1.0,
                segment: None,
            })
        };
        let queries: Vec<Query> = map.0.tiles().filter_map(down).collect();
        let settings = self.settings(CasterKind { three: false, bounded: false, one_tree: false });
        let caster = Caster::new(map.clone(), settings, usize::MAX).with(Path::best(), Grouping::Single);
        let (buffers, answers) = &mut self.buffers[0];
        let start = Instant::now();
        caster.cast(&queries, answers, buffers)?;
        let taken_s = start.elapsed().as_secs_f64();
        let loads = caster.tile_loads();
        ensure!(loads == self.tiles() as u64, "{loads} of {} tiles were built", self.tiles());
        self.tile_bytes = caster.tile_bytes();
        Ok(taken_s)
    }
}

fn cast_blocks<'a>(
    caster: &Caster<SharedMap>,
    mut blocks: impl Iterator<Item = &'a &'a [Query]>,
    (buffers, answers): &mut Buffers,
    mut take: impl FnMut(&[Answer]),
) -> Result<(), MapError> {
    blocks.try_for_each(|block| {
        caster.cast(block, answers, buffers)?;
        take(answers);
        Ok(())
    })
}

#[cfg(test)]
mod tests;
