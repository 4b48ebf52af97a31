use dmp_map::{Store, TileId};

use super::SurfaceError;

/// Hands over the centres of a map's surfels, world metres, tile by tile in the order of the tiles; copies
/// over borders are left out.
///
/// # Errors
/// When a tile is damaged; and the first error of `sink`.
pub fn surfel_centres<E: From<SurfaceError>>(
    store: &Store,
    mut sink: impl FnMut(&[[f64; 3]]) -> Result<(), E>,
) -> Result<(), E> {
    let mut tiles: Vec<TileId> = store.entries().map(|entry| entry.tile).collect();
    tiles.sort_unstable();
    let mut centres = Vec::new();
    for id in tiles {
        let Some(tile) = store.load(id).map_err(SurfaceError::Map)? else { continue };
        centres.clear();
        centres.extend(tile.surfels[..tile.own].iter().map(|surfel| -> [f64; 3] {
            std::array::from_fn(|k| tile.origin_in_world_m[k] + f64::from(surfel.centre_in_tile_m[k]))
        }));
        sink(&centres)?;
    }
    Ok(())
}
