//! Sums of parts of the points, merged in parts of the map, are the map of all points.

use std::collections::BTreeMap;
use std::path::Path;

use dmp_map::{
    Durability, FuseBuffers, Lattice, MapError, MapFuser, Origin, Store, SumsFile, SumsList, Tile, TileId,
    TileSpan, join_stores, merge_sums,
};

/// A tilted floor and a wall over several tiles, some points of it, seen in several segments.
fn points(part: usize, parts: usize) -> impl Iterator<Item = (i32, [f64; 3])> {
    (0..900_000_usize).filter(move |k| k % parts == part).map(|k| {
        let (x, y) = ((k % 1000) as f64 * 0.1 - 50.0, (k / 1000) as f64 * 0.1 - 30.0);
        let point = if k % 5 == 0 { [x, 0.03 * x, (y + 31.0) * 0.3] } else { [x, y, 0.05 * x - 0.02 * y] };
        ((k / 100_000) as i32, point)
    })
}

fn fuser(part: usize, parts: usize, budget_bytes: usize, folder: &Path) -> Result<MapFuser, MapError> {
    let fuser = MapFuser::new(Lattice::new(0.3)?, budget_bytes, folder)?;
    let mut buffers = FuseBuffers::default();
    let points: Vec<_> = points(part, parts).collect();
    for of_scan in points.chunk_by(|a, b| a.0 == b.0) {
        let in_world: Vec<[f64; 3]> = of_scan.iter().map(|(_, point)| *point).collect();
        fuser.add(&in_world, Some(of_scan[0].0), &mut buffers)?;
    }
    Ok(fuser)
}

fn sums(parts: usize, budget_bytes: usize, folder: &Path) -> Result<Vec<SumsFile>, MapError> {
    let write = |part: usize| {
        let path = folder.join(format!("{part}-of-{parts}.sums"));
        SumsFile::listed(&path, fuser(part, parts, budget_bytes, folder)?.write_sums(&path)?)
    };
    (0..parts).map(write).collect()
}

fn tiles_of(store: &Store) -> Result<BTreeMap<TileId, Tile>, MapError> {
    let tiles = store.entries().map(|entry| Ok((entry.tile, store.load(entry.tile)?)));
    let tiles = tiles.collect::<Result<Vec<_>, MapError>>()?;
    Ok(tiles.into_iter().filter_map(|(id, tile)| Some((id, tile?))).collect())
}

#[test]
fn parts_of_the_points_and_of_the_tiles_are_the_map() -> Result<(), MapError> {
    let folder = tempfile::tempdir().unwrap();
    let (lattice, origin) = (Lattice::new(0.3)?, Origin::of("town"));
    let path = folder.path().join("whole.dmpmap");
    let whole = fuser(0, 1, 1 << 30, folder.path())?;
    let summary = whole.finish(&path, &origin, Durability::Temporary, &|_, _| ())?;
    let whole = Store::open(&path)?;
    let expected = tiles_of(&whole)?;
    let middle: Vec<TileId> = expected.keys().copied().collect();
    assert!(middle.len() > 9 && summary.border_copies > 100);
    for parts in [1, 3, 7] {
        // Little memory: tiles are put aside before they are written.
        let files = sums(parts, if parts == 3 { 1 << 12 } else { 1 << 26 }, folder.path())?;
        let cuts: Vec<Option<TileId>> = match parts {
            1 => vec![None, None],
            // Also where a tile has nothing, and within a row.
            _ => vec![None, Some(middle[2]), Some(TileId { y: middle[5].y, x: 1000 }), Some(middle[9]), None],
        };
        let mut of_spans = Vec::new();
        let mut surfels = 0;
        for (k, ends) in cuts.windows(2).enumerate() {
            let span = TileSpan { from: ends[0], to: ends[1] };
            let path = folder.path().join(format!("{k}.dmpmap"));
            let to = (path.as_path(), &origin, Durability::Temporary);
            let of_span = merge_sums(lattice, &files, span, 1 << 16, to, &|_, _| ())?;
            surfels += of_span.surfels;
            of_spans.push(Store::open(&path)?);
            assert!(of_spans[k].entries().all(|entry| span.contains(entry.tile)));
        }
        assert_eq!(surfels, summary.surfels);
        let path = folder.path().join("joined.dmpmap");
        let joined = join_stores(lattice, &of_spans, (&path, &origin, Durability::Temporary))?;
        assert_eq!((joined.surfels, joined.border_copies), (summary.surfels, summary.border_copies));
        let joined = Store::open(&path)?;
        assert!(tiles_of(&joined)? == expected, "{parts} parts");
        for entry in whole.entries() {
            assert_eq!(joined.entry(entry.tile).map(|joined| joined.extent), Some(entry.extent));
        }
        // The same tiles twice.
        let twice = [Store::open(&path)?, joined];
        let error = join_stores(lattice, &twice, (&path, &origin, Durability::Temporary)).unwrap_err();
        assert!(error.to_string().contains("is in another store too"), "{error}");
    }
    Ok(())
}

#[test]
fn a_file_that_changed_is_never_merged() -> Result<(), MapError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sums");
    let list = fuser(0, 1, 1 << 30, folder.path())?.write_sums(&path)?;
    let bytes = std::fs::read(&path).unwrap();
    let merge = |list: SumsList| -> Result<(), MapError> {
        let files = [SumsFile::listed(&path, list)?];
        let out = folder.path().join("a.dmpmap");
        let to = (out.as_path(), &Origin::of(""), Durability::Temporary);
        merge_sums(Lattice::new(0.3)?, &files, TileSpan::default(), 1 << 20, to, &|_, _| ()).map(drop)
    };
    merge(list.clone())?;
    for (at, mask) in [(0, 1), (bytes.len() / 2, 0x80), (bytes.len() - 1, 4)] {
        let mut flipped = bytes.clone();
        flipped[at] ^= mask;
        std::fs::write(&path, flipped).unwrap();
        let error = merge(list.clone()).unwrap_err().to_string();
        assert!(error.contains("a.sums: damaged in its voxel sums: tile"), "{error}");
    }
    std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
    assert!(merge(list.clone()).unwrap_err().to_string().contains("cannot read"));
    let mut unsorted = list;
    unsorted.blocks.reverse();
    std::fs::write(&path, bytes).unwrap();
    assert!(merge(unsorted).unwrap_err().to_string().contains("blocks are inconsistent"));
    Ok(())
}
