//! The project's own caster in the modes that are measured.

use std::collections::HashMap;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context as _, bail};
use dmp_cast::{CastBuffers, CastSettings, Caster, Grouping, Path, Query, Wanted};
use dmp_map::{LooseSurfels, MapError, Tile, TileExtent, TileId, TileSource};

use super::files::Work;

/// Rays that are cast at once, as by `dmp score`.
const BLOCK_RAYS: usize = 32_768;
/// Edge of the tiles, metres, as in a map on disk.
const TILE_EDGE_M: f64 = 32.0;
/// How far behind the measured range a bounded cast searches, metres.
pub(super) const BOUND_M: f64 = 5.0;

/// How rays are cast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mode {
    pub(super) path: Path,
    pub(super) grouping: Grouping,
    /// All three answers, not z1 alone.
    pub(super) three: bool,
    /// Up to [`BOUND_M`] behind the measured range.
    pub(super) bounded: bool,
}

/// `PATH-single` or `PATH-packets`, then `-three` and `-bounded`.
impl FromStr for Mode {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        let strip = |name: &str, suffix: &str| {
            let before = name.strip_suffix(suffix);
            (before.unwrap_or(name).to_owned(), before.is_some())
        };
        let (rest, bounded) = strip(name, "-bounded");
        let (rest, three) = strip(&rest, "-three");
        let (path, grouping) = rest.split_once('-').with_context(|| format!("{name}: unknown mode"))?;
        let path = Path::all().into_iter().find(|known| known.name() == path);
        let path = path.with_context(|| format!("{name}: this processor has no such instructions"))?;
        let grouping = match grouping {
            "single" => Grouping::Single,
            "packets" => Grouping::Auto,
            _ => bail!("{name}: unknown mode"),
        };
        Ok(Self { path, grouping, three, bounded })
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

/// A map, rays, and a caster for each kind of question.
#[derive(Debug)]
pub(super) struct Own {
    map: SharedMap,
    queries: Vec<Query>,
    horizon_m: f64,
    /// By `three` and `bounded`; the rest of a mode can be changed on one.
    casters: HashMap<(bool, bool), Caster<SharedMap>>,
    buffers: CastBuffers,
}

impl Own {
    pub(super) fn new(work: &Work) -> anyhow::Result<Self> {
        let map = LooseSurfels::new(TILE_EDGE_M, work.radius_m(), work.world_surfels())?;
        Ok(Self {
            map: SharedMap(Arc::new(map)),
            queries: work.queries(),
            horizon_m: work.horizon_m(),
            casters: HashMap::new(),
            buffers: CastBuffers::default(),
        })
    }

    pub(super) fn tiles(&self) -> usize {
        self.map.0.tiles().count()
    }

    /// Casts all rays once: the seconds of the casting; ranges of z1, zn and zc, metres, NaN for a miss.
    pub(super) fn cast(&mut self, mode: Mode) -> anyhow::Result<(f64, [Vec<f64>; 3])> {
        let settings = CastSettings {
            horizon_m: self.horizon_m,
            beyond_m: if mode.bounded { BOUND_M } else { f64::INFINITY },
            wanted: if mode.three { Wanted::Three } else { Wanted::First },
            ..CastSettings::default()
        };
        let kind = (mode.three, mode.bounded);
        let caster = self.casters.remove(&kind);
        let caster = caster.unwrap_or_else(|| Caster::new(self.map.clone(), settings, usize::MAX));
        let caster = caster.with(mode.path, mode.grouping);
        let mut answers = Vec::new();
        let mut ranges = [(); 3].map(|()| Vec::with_capacity(self.queries.len()));
        let mut taken_s = 0.0;
        for block in self.queries.chunks(BLOCK_RAYS) {
            let start = Instant::now();
            caster.cast(block, &mut answers, &mut self.buffers)?;
            taken_s += start.elapsed().as_secs_f64();
            for answer in &answers {
                let of_ray = [answer.first_m, answer.nearest_m, answer.independent_m];
                ranges.iter_mut().zip(of_ray).for_each(|(all, one)| all.push(one.unwrap_or(f64::NAN)));
            }
        }
        self.casters.insert(kind, caster);
        Ok((taken_s, ranges))
    }
}

#[cfg(test)]
mod tests {
    use super::super::exact::Agreement;
    use super::super::files::Record;
    use super::*;

    /// A wall of discs 10 m to the north of the rays, over four tiles. Every other disc was seen in segment 9 alone, the
    /// others in 1.
    fn work() -> Work {
        const FAR_M: f32 = 65536.0;
        let steps = |from: i32, to: i32| (from..to).map(|k| k as f32 * 0.25);
        let surfels: Vec<Record> = steps(-160, 160)
            .flat_map(|x| steps(0, 16).map(move |z| [FAR_M + x, 10.0, z, 0.0, -1.0, 0.0, 0.25]))
            .collect();
        let ray = |k: i32| {
            let angle = f64::from(k) * 1e-3;
            let range_m = 10.0 / angle.cos() + if k % 2 == 0 { 0.3 } else { -7.0 };
            [FAR_M, 0.0, 0.9, angle.sin() as f32, angle.cos() as f32, 0.0, range_m as f32]
        };
        let rays: Vec<Record> = (-1000..1000).map(ray).collect();
        let support = (0..surfels.len()).map(|k| [if k % 2 == 0 { 9 } else { 1 }; 2]).collect();
        Work { segments: vec![9; rays.len()], surfels, rays, support }
    }

    /// By the definitions, over all discs: first, nearest, first independent.
    fn by_definition(work: &Work, bound_m: f64) -> [Vec<f64>; 3] {
        let mut ranges = [(); 3].map(|()| Vec::new());
        let surfels: Vec<_> = work.world_surfels().collect();
        for query in work.queries() {
            let mut best = [f64::NAN; 3];
            for surfel in &surfels {
                let dot = |a: [f64; 3]| -> f64 { (0..3).map(|k| a[k] * f64::from(surfel.normal[k])).sum() };
                let to = |k: usize| surfel.centre_in_world_m[k] - query.ray.origin_in_world[k];
                let cos = dot(query.ray.direction_in_world);
                let range_m = dot([to(0), to(1), to(2)]) / cos;
                let off = |k: usize| range_m * query.ray.direction_in_world[k] - to(k);
                let is_in = (0..3).map(|k| off(k) * off(k)).sum::<f64>() <= work.radius_m() * work.radius_m();
                if cos.abs() < 0.01 || !is_in || range_m < 0.0 || range_m > query.ray.range_m + bound_m {
                    continue;
                }
                best[0] = best[0].min(range_m);
                if (range_m - query.ray.range_m).abs() <= 5.0 {
                    best[1] = range_m;
                }
                if surfel.third_lowest < 8 {
                    best[2] = best[2].min(range_m);
                }
            }
            ranges.iter_mut().zip(best).for_each(|(all, one)| all.push(one));
        }
        ranges
    }

    #[test]
    fn every_mode_finds_what_the_definitions_say() {
        let work = work();
        let expected = [f64::INFINITY, BOUND_M].map(|bound_m| by_definition(&work, bound_m));
        assert!(expected[0][1].iter().any(|m| m.is_nan()) && expected[1][0].iter().any(|m| m.is_nan()));
        let mut own = Own::new(&work).unwrap();
        assert!(own.tiles() >= 3);
        for path in Path::all() {
            for grouping in [Grouping::Single, Grouping::Auto] {
                for (three, bounded) in [(false, false), (false, true), (true, false), (true, true)] {
                    let mode = Mode { path, grouping, three, bounded };
                    let (seconds, ranges) = own.cast(mode).unwrap();
                    for k in 0..if three { 3 } else { 1 } {
                        let agreement = Agreement::of(&ranges[k], &expected[usize::from(bounded)][k]);
                        assert!(agreement.is_exact() && seconds > 0.0, "{mode:?} z{k}: {agreement:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn modes_have_names() {
        let mode: Mode = "portable-packets-three-bounded".parse().unwrap();
        let expected = (Grouping::Auto, true, true);
        assert_eq!((mode.path.name(), (mode.grouping, mode.three, mode.bounded)), ("portable", expected));
        for wrong in ["", "single", "portable-", "portable-many", "portable-single-fast", "mmx-single"] {
            assert!(wrong.parse::<Mode>().is_err(), "{wrong}");
        }
    }
}
