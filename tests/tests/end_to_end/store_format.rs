//! A committed map against what a script that knows nothing but `docs/store-format.md` found in it.

use dmp_map::{PlacesLeftOut, Store, TileId};
use serde_json::Value;

use crate::common::workspace;

#[test]
fn a_committed_map_is_read_as_a_script_reads_it() {
    let folder = workspace().join("tests/conformance/store");
    let known = std::fs::read_to_string(folder.join("small.json")).unwrap();
    let known: Value = serde_json::from_str(&known).unwrap();
    let store = Store::open(&folder.join("small.dmpmap")).unwrap();
    assert_eq!(store.origin().text.as_str(), known["provenance"]);
    let (place, rotation) =
        (store.own_from_world().translation.vector, store.own_from_world().rotation.coords);
    let known_frame: Vec<f64> =
        known["own_from_world"].as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect();
    for (found, known) in place.iter().chain(rotation.iter()).zip(&known_frame) {
        // The JSON reader rounds the last bit of a full f64 as it likes.
        assert!((found / known - 1.0).abs() < 1e-15, "{found} {known}");
    }
    assert_eq!(store.lattice().voxel_m() * 8192.0, known["voxel_units"].as_f64().unwrap());
    let tiles = known["tiles"].as_array().unwrap();
    assert_eq!(store.entries().count(), tiles.len());
    let (mut own, mut copies, mut all_left_out, mut without_support) = (0, 0, 0, 0);
    for known in tiles {
        let number = |name: &str| known[name].as_i64().unwrap();
        let id = TileId { y: number("y") as i32, x: number("x") as i32 };
        let (entry, tile) = (store.entry(id).unwrap(), store.load(id).unwrap().unwrap());
        let numbers = |name: &str| -> Vec<f64> {
            known[name].as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect()
        };
        assert_eq!(tile.origin_in_world_m[..], numbers("origin_in_world_m"));
        // The JSON reader rounds the last bit of a full f64 as it likes.
        let apart = |k: usize| (entry.extent.z_range_m[k] / numbers("z_range_m")[k] - 1.0).abs();
        assert!(apart(0).max(apart(1)) < 1e-15, "{:?}", entry.extent);
        assert_eq!(i64::from(entry.extent.min_third_lowest), number("min_third_lowest"));
        assert_eq!(i64::from(entry.extent.max_third_highest), number("max_third_highest"));
        assert_eq!(tile.own as i64, number("own"));
        let surfels = known["surfels"].as_array().unwrap();
        assert_eq!(tile.surfels.len(), surfels.len());
        for (surfel, known) in tile.surfels.iter().zip(surfels) {
            let known: Vec<f64> = known.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect();
            // As the script says them: a float32 in full, to be read as f64 and converted.
            let numbers: Vec<f32> = known[..6].iter().map(|&n| n as f32).collect();
            let found: Vec<f32> = surfel.centre_in_tile_m.iter().chain(&surfel.normal).copied().collect();
            assert_eq!(found, numbers);
            assert_eq!([surfel.third_lowest, surfel.third_highest].map(f64::from)[..], known[6..]);
            without_support += usize::from(surfel.third_lowest == i32::MAX);
        }
        let known_left_out = known["left_out"].as_array().unwrap();
        let left_out = PlacesLeftOut::of(&store, 1 << 20);
        let centre = |surfel: &Value| -> [f64; 3] {
            std::array::from_fn(|k| tile.origin_in_world_m[k] + surfel[k].as_f64().unwrap())
        };
        let mut found = Vec::new();
        left_out.find(&store, known_left_out.iter().map(centre), &mut found).unwrap();
        assert_eq!(found, vec![true; entry.left_out.surfels as usize]);
        let above = surfels.iter().map(|surfel| centre(surfel).map(|c| c + 9.0));
        left_out.find(&store, above, &mut found).unwrap();
        assert!(found.iter().all(|out| !out));
        all_left_out += found.len();
        own += tile.own;
        copies += tile.surfels.len() - tile.own;
    }
    assert!(
        tiles.len() > 3 && own > 50 && copies > 3 && all_left_out > 50 && without_support > 0,
        "{own} {copies} {without_support}"
    );
}
