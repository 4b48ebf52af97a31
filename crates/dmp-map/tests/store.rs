//! A damaged store is named and refused, never read.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::path::{Path, PathBuf};

use dmp_disk::DiskError;
use dmp_map::{Durability, FuseBuffers, Lattice, MapError, MapFuser, Store};

fn small_store(folder: &Path) -> PathBuf {
    let fuser = MapFuser::new(Lattice::new(0.5).unwrap(), usize::MAX, folder).unwrap();
    let points: Vec<[f64; 3]> = (0..4000)
        .map(|i| {
            [29.0 + f64::from(i % 70) * 0.1, 1.0 + f64::from(i / 70) * 0.1, f64::from(i * 31 % 17) * 0.01]
        })
        .collect();
    fuser.add(&points, Some(3), &mut FuseBuffers::default()).unwrap();
    let path = folder.join("small.dmpmap");
    let summary = fuser
        .finish(&path, &dmp_map::Origin::of("a patch of ground"), Durability::Durable, &|_, _| ())
        .unwrap();
    assert!(summary.tiles == 2 && summary.surfels > 100 && summary.border_copies > 5);
    assert_eq!(summary.bytes, std::fs::metadata(&path).unwrap().len());
    path
}

fn read_all(path: &Path) -> Result<u64, MapError> {
    let store = Store::open(path)?;
    let mut surfels = 0;
    let ids: Vec<_> = store.entries().map(|e| e.tile).collect();
    for id in ids {
        surfels += store.load(id)?.map_or(0, |tile| tile.surfels.len() as u64);
    }
    Ok(surfels)
}

#[test]
fn every_flipped_byte_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = small_store(folder.path());
    let good = std::fs::read(&path).unwrap();
    assert!(read_all(&path).unwrap() > 100);
    let broken = folder.path().join("broken.dmpmap");
    let mut named_tiles = 0;
    for at in 0..good.len() {
        let mut bytes = good.clone();
        bytes[at] ^= 0x40;
        std::fs::write(&broken, &bytes).unwrap();
        match read_all(&broken) {
            Ok(_) => panic!("byte {at} flipped unnoticed"),
            Err(MapError::DamagedTile { .. }) => named_tiles += 1,
            Err(e) => assert!(e.to_string().contains("broken.dmpmap"), "{e}"),
        }
    }
    assert!(named_tiles > good.len() / 2);
}

#[test]
fn every_cut_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let good = std::fs::read(small_store(folder.path())).unwrap();
    let cut = folder.path().join("cut.dmpmap");
    for length in 0..good.len() {
        std::fs::write(&cut, &good[..length]).unwrap();
        assert!(read_all(&cut).is_err(), "{length} bytes");
    }
}

/// A mapped one would end the program with a signal.
#[test]
fn a_store_that_is_cut_while_it_is_open_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = small_store(folder.path());
    let store = Store::open(&path).unwrap();
    let length = std::fs::metadata(&path).unwrap().len();
    std::fs::File::options().write(true).open(&path).unwrap().set_len(length / 8).unwrap();
    let last = store.entries().max_by_key(|entry| entry.own.offset).unwrap().tile;
    let error = store.load(last).unwrap_err();
    assert!(matches!(&error, MapError::DamagedTile { tile, .. } if *tile == last), "{error}");
    assert!(error.to_string().contains("cannot read it"), "{error}");
}

#[test]
fn other_versions_and_other_files_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let path = small_store(folder.path());
    let mut bytes = std::fs::read(&path).unwrap();
    for version in [1, 3, 9] {
        bytes[8] = version;
        std::fs::write(&path, &bytes).unwrap();
        let error = Store::open(&path).unwrap_err().to_string();
        assert!(
            error.ends_with(&format!("store version {version}, this program reads version 4")),
            "{error}"
        );
    }
    std::fs::write(&path, vec![b'x'; 500]).unwrap();
    assert!(matches!(Store::open(&path), Err(MapError::NotAStore { .. })));
    assert!(matches!(Store::open(&folder.path().join("none")), Err(MapError::Disk(DiskError::Io { .. }))));
}

#[test]
fn an_empty_map_is_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let fuser = MapFuser::new(Lattice::new(0.2).unwrap(), usize::MAX, folder.path()).unwrap();
    let path = folder.path().join("empty.dmpmap");
    fuser.finish(&path, &dmp_map::Origin::of(""), Durability::Temporary, &|_, _| ()).unwrap();
    let store = Store::open(&path).unwrap();
    assert_eq!((store.surfels(), store.bounds()), (0, None));
}

#[test]
fn a_store_that_cannot_be_written_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let fuser = MapFuser::new(Lattice::new(0.2).unwrap(), usize::MAX, folder.path()).unwrap();
    let path = folder.path().join("no/such/folder/map.dmpmap");
    let error = fuser.finish(&path, &dmp_map::Origin::of(""), Durability::Temporary, &|_, _| ()).unwrap_err();
    assert!(error.to_string().contains("map.dmpmap"), "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
