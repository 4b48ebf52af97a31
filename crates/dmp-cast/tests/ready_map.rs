//! The cast-ready form: the same bits as from the archive, and nothing of a damaged file.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::fs;
use std::path::{Path, PathBuf};

use dmp_cast::{
    Answer, CastBuffers, CastSettings, CastSource, Caster, Grouping, Path as Way, Query, ReadyMap,
};
use dmp_map::{Durability, FuseScratch, Lattice, MapError, MapFuser, Store, TileId};
use proptest::prelude::*;

const VOXEL_M: f64 = 0.5;
const HEADER_BYTES: usize = 64;
const FOOTER_BYTES: usize = 40;

struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A map of discs strewn within `reach_m` of a corner of tiles, in both forms.
fn maps(folder: &Path, voxels: usize, reach_m: f64) -> [PathBuf; 2] {
    let mut random = Random(voxels as u64);
    let fuser = MapFuser::new(Lattice::new(VOXEL_M).unwrap(), usize::MAX, folder).unwrap();
    for _ in 0..voxels {
        let corner =
            [reach_m, reach_m, 3.0].map(|reach| (random.between(-reach, reach) / VOXEL_M).floor() * VOXEL_M);
        let points: Vec<[f64; 3]> =
            (0..6).map(|_| corner.map(|c| c + random.between(0.01, VOXEL_M - 0.01))).collect();
        let segment = random.between(0.0, 30.0) as i32;
        fuser.add(&points, Some(segment), &mut FuseScratch::default()).unwrap();
    }
    let [archive, ready] = ["map.dmpmap", "map.dmpcast"].map(|name| folder.join(name));
    fuser.finish(&archive, &dmp_map::Origin::of("strewn"), Durability::Scratch, &|_, _| ()).unwrap();
    let store = Store::open(&archive).unwrap();
    let summary = ReadyMap::write(&store, &ready, Durability::Durable, &|_, _| ()).unwrap();
    assert_eq!(summary.bytes, fs::metadata(&ready).unwrap().len());
    assert_eq!((summary.surfels, summary.tiles), (store.surfels(), store.entries().count() as u64));
    [archive, ready]
}

fn queries(count: usize, reach_m: f64) -> Vec<Query> {
    let mut random = Random(17);
    let query = |_| {
        let (heading, up) = (random.between(0.0, 6.3), random.between(-0.3, 0.3));
        Query {
            origin_in_world_m: [reach_m, reach_m, 2.0].map(|reach| random.between(-reach, reach)),
            direction_in_world: [heading.cos() * up.cos(), heading.sin() * up.cos(), up.sin()],
            measured_m: random.between(1.5, 60.0),
            segment: Some(random.between(0.0, 31.0) as i32),
        }
    };
    (0..count).map(query).collect()
}

fn cast(caster: &Caster<impl CastSource>, queries: &[Query]) -> Result<Vec<Answer>, MapError> {
    let mut answers = Vec::new();
    caster.cast(queries, &mut answers, &mut CastBuffers::default())?;
    Ok(answers)
}

/// The answers from the map at `path`, of either form.
fn answers(path: &Path, queries: &[Query]) -> Result<Vec<Answer>, MapError> {
    let settings = CastSettings::default();
    if path.extension().is_some_and(|extension| extension == "dmpcast") {
        cast(&Caster::new(ReadyMap::open(path)?, settings, usize::MAX), queries)
    } else {
        cast(&Caster::new(Store::open(path)?, settings, usize::MAX), queries)
    }
}

#[test]
fn both_forms_give_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, ready] = maps(folder.path(), 20_000, 40.0);
    let queries = queries(4000, 40.0);
    let expected = answers(&archive, &queries).unwrap();
    let found = |what: fn(&Answer) -> bool| expected.iter().filter(|answer| what(answer)).count();
    let [first, independent] = [found(|a| a.first_m.is_some()), found(|a| a.independent_m.is_some())];
    assert!(first > 2000 && independent > 1000, "{first} {independent}");
    for (path, grouping, budget_bytes) in Way::all().into_iter().flat_map(|path| {
        [(path, Grouping::Auto, usize::MAX), (path, Grouping::Single, 0), (path, Grouping::Packets, 0)]
    }) {
        let map = ReadyMap::open(&ready).unwrap();
        assert_eq!((map.file().origin().text.as_str(), map.edge_m()), ("strewn", 32.0));
        let caster = Caster::new(map, CastSettings::default(), budget_bytes).with(path, grouping);
        assert!(cast(&caster, &queries).unwrap() == expected, "{} {grouping:?}", path.name());
    }
}

#[test]
fn an_empty_map_is_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, ready] = maps(folder.path(), 0, 1.0);
    for path in [archive, ready] {
        assert!(answers(&path, &queries(9, 5.0)).unwrap().iter().all(|answer| answer.first_m.is_none()));
    }
}

#[test]
fn the_forms_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let [archive, ready] = maps(folder.path(), 50, 3.0);
    let error = Store::open(&ready).unwrap_err();
    assert!(
        error
            .to_string()
            .ends_with("map.dmpcast: a map in the cast-ready form, where one in the archive form is needed")
    );
    assert!(matches!(ReadyMap::open(&archive), Err(MapError::OtherForm { .. })));
}

#[test]
fn no_damaged_byte_and_no_cut_is_cast_into() {
    let folder = tempfile::tempdir().unwrap();
    for path in maps(folder.path(), 30, 2.0) {
        let queries = queries(200, 3.0);
        let good = fs::read(&path).unwrap();
        let store_end = good.len() - FOOTER_BYTES - directory(&good).len();
        assert!(answers(&path, &queries).unwrap().iter().any(|answer| answer.first_m.is_some()));
        let broken = path.with_file_name("broken").with_extension(path.extension().unwrap());
        for at in 0..good.len() {
            let mut bytes = good.clone();
            bytes[at] ^= 0x40;
            fs::write(&broken, &bytes).unwrap();
            match answers(&broken, &queries) {
                Ok(_) => panic!("{}: byte {at} flipped unnoticed", path.display()),
                Err(error) => {
                    let in_a_tile = (HEADER_BYTES..store_end).contains(&at);
                    let names_it = matches!(error, MapError::DamagedTile { .. });
                    assert_eq!(names_it, in_a_tile, "byte {at} of {store_end}: {error}");
                    assert!(error.to_string().contains("broken.dmp"), "{error}");
                }
            }
        }
        for length in 0..good.len() {
            fs::write(&broken, &good[..length]).unwrap();
            assert!(answers(&broken, &queries).is_err(), "{length} bytes");
        }
    }
}

/// Bytes of the directory.
fn directory(bytes: &[u8]) -> std::ops::Range<usize> {
    let footer = bytes.len() - FOOTER_BYTES;
    let start = u64::from_le_bytes(bytes[footer..footer + 8].try_into().unwrap()) as usize;
    start..footer
}

fn put_crc(bytes: &mut [u8], of: std::ops::Range<usize>, at: usize) {
    let mut crc = !0u32;
    for byte in &bytes[of] {
        crc ^= u32::from(*byte);
        (0..8).for_each(|_| crc = crc >> 1 ^ (0xedb8_8320 & (crc & 1).wrapping_neg()));
    }
    bytes[at..at + 4].copy_from_slice(&(!crc).to_le_bytes());
}

/// Makes every checksum right again, so that what is wrong must be seen.
fn forge(mut bytes: Vec<u8>, path: &Path) {
    let directory = directory(&bytes);
    let text = u32::from_le_bytes(bytes[directory.start..directory.start + 4].try_into().unwrap()) as usize;
    for entry in (directory.start + 4 + text + 56..directory.end).step_by(84) {
        for blob in [entry + 36, entry + 60] {
            let start = u64::from_le_bytes(bytes[blob..blob + 8].try_into().unwrap()) as usize;
            let length = u32::from_le_bytes(bytes[blob + 8..blob + 12].try_into().unwrap()) as usize;
            if start + length <= directory.start {
                put_crc(&mut bytes, start..start + length, blob + 20);
            }
        }
    }
    let footer = directory.end;
    put_crc(&mut bytes, directory, footer + 16);
    put_crc(&mut bytes, footer..footer + 28, footer + 28);
    fs::write(path, bytes).unwrap();
}

#[test]
fn trees_that_leave_their_tile_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [_, ready] = maps(folder.path(), 3000, 20.0);
    let good = fs::read(&ready).unwrap();
    let forged = folder.path().join("forged.dmpcast");
    let queries = queries(500, 20.0);
    forge(good.clone(), &forged);
    assert!(answers(&forged, &queries).is_ok(), "the forger's checksums are right");
    let map = ReadyMap::open(&ready).unwrap();
    let entry = *map.file().entry(TileId { x: 0, y: 0 }).unwrap();
    assert!(entry.own.rows > 4);
    let nodes = entry.own.offset as usize;
    // Six rows of bounds and two of support stand before the children, and after those the bits of leaves.
    let child = |node: usize, place: usize| nodes + node * 320 + 8 * 32 + 4 * place;
    let put = |at: usize, value: u32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        forge(bytes, &forged);
        answers(&forged, &queries).map(|_| ()).unwrap_err().to_string()
    };
    for (node, value) in [(0, 0), (0, entry.own.rows), (0, u32::MAX), (2, 1)] {
        let error = put(child(node, 0), value);
        assert!(error.contains("tile (0, 0)") && error.contains(&format!("child {value} of")), "{error}");
    }
    // All children of all nodes are leaves now: those behind the last do not exist.
    let mut bytes = good.clone();
    for node in 0..entry.own.rows as usize {
        for place in 0..8 {
            let at = child(node, place);
            bytes[at..at + 4].copy_from_slice(&entry.borders.rows.to_le_bytes());
        }
        let at = child(node, 8);
        bytes[at..at + 4].copy_from_slice(&255u32.to_le_bytes());
    }
    forge(bytes, &forged);
    assert!(answers(&forged, &queries).unwrap_err().to_string().contains("tile (0, 0)"));
    // More rows than bytes, in the directory.
    let rows_at = directory(&good).start + 4 + "strewn".len() + 56 + 36 + 16;
    let error = put(rows_at, 1 << 20);
    assert!(error.contains("directory") && error.contains("1048576 nodes"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn forged_bytes_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), of_nodes in any::<bool>(),
    ) {
        thread_local! {
            static MAP: (tempfile::TempDir, [PathBuf; 2]) = {
                let folder = tempfile::tempdir().unwrap();
                let paths = maps(folder.path(), 400, 6.0);
                (folder, paths)
            };
        }
        MAP.with(|(folder, [_, ready])| {
            let mut bytes = fs::read(ready).unwrap();
            let end = directory(&bytes).start;
            for (index, value) in changes {
                // Nodes are one part in five.
                let at = HEADER_BYTES + index.index(if of_nodes { 960 } else { end - HEADER_BYTES });
                bytes[at] = value;
            }
            let forged = folder.path().join("forged.dmpcast");
            forge(bytes, &forged);
            // Whatever comes out of it: no crossing of nothing, and an end.
            if let Ok(answers) = answers(&forged, &queries(300, 8.0)) {
                assert_eq!(answers.len(), 300);
            }
        });
    }
}
