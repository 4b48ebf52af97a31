//! The pictures of the page, drawn of what was gathered.

use std::mem;

use dmp_draw::{DiscInWorld, Painter, Pictures, SampledReturn};
use dmp_map::{OwnDisc, Store, TileId};

use super::gathered::Gathered;
use crate::console::Hosted;

/// Draws everything.
pub(super) fn draw(mut gathered: Gathered, maps: &[&Store], host: &Hosted) -> anyhow::Result<Pictures> {
    let (index_of, returns) = (gathered.index_of(), gathered.returns());
    let (frames, order) = (mem::take(&mut gathered.frames), mem::take(&mut gathered.order));
    let bases = &gathered.bases;
    let mut painter = Painter::new(gathered.scales, frames, gathered.start_ns, bases.clone(), order, returns);
    for (run, window, extent_m) in painter.windows() {
        draw_discs(&mut painter, maps[run], run, window, extent_m)?;
    }
    for run in painter.clouds() {
        host.go_on()?;
        draw_map(&mut painter, maps[run], run)?;
    }
    let mut of_runs = Vec::new();
    gathered.each(host, |number, returns, _| {
        let Some(&index) = index_of.get(&number) else { return Ok(()) };
        for sampled in returns.chunks_exact(bases.len()) {
            of_runs.clear();
            of_runs.extend(sampled.iter().map(SampledReturn::of_bytes));
            painter.sampled(index, &of_runs);
        }
        Ok(())
    })?;
    Ok(painter.finish())
}

/// Draws the surfels of all tiles that a window touches.
fn draw_discs(
    painter: &mut Painter,
    map: &Store,
    run: usize,
    window: usize,
    [low_m, high_m]: [[f64; 2]; 2],
) -> anyhow::Result<()> {
    let radius_m = map.lattice().disc_radius_m();
    let mut tiles: Vec<TileId> = map
        .entries()
        .filter(|entry| {
            let [low, high] = map.box_in_own_m(entry);
            (0..2).all(|axis| low[axis] <= high_m[axis] && high[axis] >= low_m[axis])
        })
        .map(|entry| entry.tile)
        .collect();
    tiles.sort_unstable();
    for tile in tiles {
        for OwnDisc { centre_in_own_m, normal_in_own } in map.discs_in_own(tile)? {
            let disc = DiscInWorld { centre_in_world_m: centre_in_own_m, normal: normal_in_own, radius_m };
            painter.disc(run, window, &disc);
        }
    }
    Ok(())
}

/// Draws a sample of the surfels of a whole map.
fn draw_map(painter: &mut Painter, map: &Store, run: usize) -> anyhow::Result<()> {
    let (radius_m, of_all) = (map.lattice().disc_radius_m(), map.surfels());
    let mut tiles: Vec<TileId> = map.entries().map(|entry| entry.tile).collect();
    tiles.sort_unstable();
    let mut number = 0;
    for tile in tiles {
        for OwnDisc { centre_in_own_m, normal_in_own } in map.discs_in_own(tile)? {
            let disc = DiscInWorld { centre_in_world_m: centre_in_own_m, normal: normal_in_own, radius_m };
            painter.surfel(run, (number, of_all), &disc);
            number += 1;
        }
    }
    Ok(())
}
