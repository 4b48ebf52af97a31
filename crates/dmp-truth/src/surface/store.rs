//! The points of a stored map.

use dmp_map::{Store, TileId};

use super::SurfaceError;

/// Hands over the centres of a map's surfels, metres in the frame of its maker, tile by tile in the order of the tiles; copies
/// over borders are excluded.
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
        centres.clear();
        centres.extend(store.discs_in_own(id).map_err(SurfaceError::Map)?.map(|disc| disc.centre_in_own_m));
        if centres.is_empty() {
            continue;
        }
        sink(&centres)?;
    }
    Ok(())
}
