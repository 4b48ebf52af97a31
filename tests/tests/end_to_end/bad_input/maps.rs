//! Rows 3 and 21: maps and stores that are not what they say.

use std::fs;

use super::{refused_limited, scored, town};
use crate::common::refused;

#[cfg(unix)]
#[test]
fn row_03_claims_of_map_heads_are_not_believed() {
    let (folder, _) = town();
    let path = folder.path();
    let properties = "property float x\nproperty float y\nproperty float z\nend_header\n";
    let ply = format!("ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000\n{properties}");
    let pcd = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4000000000\nHEIGHT 200\n\
               POINTS 800000000000\nDATA binary\n";
    let mesh = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\n{}",
        properties.replace(
            "end_header",
            "element face 4000000000\nproperty list uchar int vertex_indices\nend_header"
        )
    );
    let body = [0_u8; 36];
    for (name, head, claim) in [
        ("map.ply", ply.as_str(), "1000000000000"),
        ("map.pcd", pcd, "800000000000"),
        ("mesh.ply", &mesh, "face"),
    ] {
        fs::write(path.join(name), [head.as_bytes(), &body].concat()).unwrap();
        let arguments = format!("score town.mcap -t truth.tum --threads 1 --map {name}");
        refused_limited(path, "ulimit -v 1500000", &arguments, &[name, claim]);
    }
}

#[test]
fn row_21_a_store_that_is_not_whole_is_refused() {
    let (folder, _) = town();
    let path = folder.path();
    scored(path, "score town.mcap -t truth.tum --save-maps maps", 0);
    let whole = fs::read(path.join("maps/truth.dmpmap")).unwrap();
    let map = path.join("map.dmpmap");
    let arguments = "score town.mcap -t truth.tum --map map.dmpmap";
    fs::write(&map, &whole).unwrap();
    let used = scored(path, arguments, 0);
    assert_eq!(used["inputs"]["runs"][0]["map"], "map.dmpmap");

    let mut newer = whole.clone();
    newer[8] += 1;
    fs::write(&map, &newer).unwrap();
    refused(path, arguments, 1, &["map.dmpmap", "version 3"]);
    for length in [0, 7, 40, whole.len() / 2, whole.len() - 1] {
        fs::write(&map, &whole[..length]).unwrap();
        refused(path, arguments, 1, &["map.dmpmap"]);
    }
    // Tiles stand behind the header, the directory and the footer behind them.
    for at in [80, whole.len() / 4, whole.len() / 2] {
        let mut flipped = whole.clone();
        flipped[at] ^= 0x10;
        fs::write(&map, &flipped).unwrap();
        refused(path, arguments, 1, &["map.dmpmap", "tile "]);
    }
    for at in [10, whole.len() - 60, whole.len() - 10] {
        let mut flipped = whole.clone();
        flipped[at] ^= 0x10;
        fs::write(&map, &flipped).unwrap();
        refused(path, arguments, 1, &["map.dmpmap"]);
    }
}
