//! `dmp map verify`: whether a map is whole.

use std::io::Write as _;

use dmp_draw::text;
use dmp_map::{Store, Tile, TileEntry, TileId};

use crate::console::{Common, Exit, Progress, say};
use crate::options::{Asked, Out, Spec, tools};

pub(super) static SPEC: Spec = Spec {
    name: "verify",
    about: "Read every byte of a map and check it: checksums, counts, bounds",
    more: "Names every damaged tile; the exit code is then 3.",
    after: "Example:\n  dmp map verify maps/truth.dmpmap",
    options: &[&[&tools::MAP]],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let path = asked.need(&tools::MAP)?;
    let map = Store::open(&path)?;
    let mut tiles: Vec<TileId> = map.entries().map(|entry| entry.tile).collect();
    tiles.sort_unstable();
    let progress = Progress::new(common);
    progress.start("checking", "tiles", tiles.len() as u64);
    let (mut damaged, mut surfels) = (0u64, 0u64);
    for &id in &tiles {
        common.host.go_on()?;
        let wrong = match map.load(id) {
            Ok(Some(tile)) => {
                surfels += tile.own as u64;
                map.entry(id)
                    .and_then(|entry| wrong_with(&map, entry, &tile))
                    .map(|wrong| format!("{}: tile {id}: {wrong}", path.display()))
            }
            Ok(None) => Some(format!("{}: tile {id} is not there", path.display())),
            Err(error) => Some(error.to_string()),
        };
        progress.done(1);
        if let Some(wrong) = wrong {
            damaged += 1;
            progress.suspend(|| say!(common.host, "error: {wrong}"));
        }
    }
    drop(progress);
    if damaged > 0 {
        writeln!(out, "{} of {} damaged", text::count(damaged), text::counted(tiles.len() as u64, "tile"))?;
        return Ok(Exit::InputDamaged);
    }
    let (tiles, surfels) = (text::counted(tiles.len() as u64, "tile"), text::counted(surfels, "surfel"));
    writeln!(out, "{}: {tiles}, {surfels}: sound", path.display())?;
    Ok(Exit::Done)
}

/// What of a tile's surfels is not as the directory says, though the checksums are right.
fn wrong_with(map: &Store, entry: &TileEntry, tile: &Tile) -> Option<String> {
    if tile.surfels.len() as u64 != entry.surfels() {
        return Some(format!(
            "{} surfels, {} in the directory",
            text::count(tile.surfels.len() as u64),
            text::count(entry.surfels())
        ));
    }
    let (edge_m, radius_m) = (map.lattice().tile_edge_m() as f32, map.lattice().disc_radius_m() as f32);
    let extent = entry.extent;
    for (index, surfel) in tile.surfels.iter().enumerate() {
        let [x, y, z] = surfel.centre_in_tile_m;
        // Copies of neighbours' discs have their centres outside; rounding moves a centre by less than a millimetre.
        let out_m = if index < tile.own { 1e-3 } else { radius_m + 2e-3 };
        let inside = |c: f32| (-out_m..=edge_m + out_m).contains(&c);
        let z_m = tile.base_z_m() + f64::from(z);
        let norm2: f32 = surfel.normal.iter().map(|n| n * n).sum();
        let in_extent = (extent.z_range_m[0]..=extent.z_range_m[1]).contains(&z_m)
            && surfel.third_lowest >= extent.min_third_lowest
            && surfel.third_highest <= extent.max_third_highest;
        if !(inside(x) && inside(y) && in_extent && (norm2 - 1.0).abs() < 1e-3) {
            return Some(format!("surfel {index} at ({x}, {y}, {z}) m is out of bounds"));
        }
    }
    None
}
