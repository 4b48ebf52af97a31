//! Rows 3, 20, 21 and 22: maps and stores that are not what they say.

use std::fs;

use std::process::Stdio;

use dmp_log::FolderFormat;

use super::{refused_limited, scored, town, write_folder};
use crate::common::{dmp, dmp_command, refused, text};

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
        ("map.ply", ply.as_str(), "1,000,000,000,000"),
        ("map.pcd", pcd, "800,000,000,000"),
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

/// Eleven bytes of 255 are what a decoder of the arithmetic code takes for an escape, again and again.
#[test]
fn row_20_ones_in_laz_end_in_a_line_or_in_other_points() {
    let (folder, scans) = town();
    let path = folder.path();
    scored(path, "score town.mcap -t truth.tum --save-maps maps", 0);
    assert_eq!(dmp(path, "map export maps/truth.dmpmap -o whole.laz").status.code(), Some(0));
    write_folder(&path.join("log"), &scans[..4], FolderFormat::Laz);
    let (map, scan) = (fs::read(path.join("whole.laz")).unwrap(), path.join("log/scans/000001.laz"));
    let whole = fs::read(&scan).unwrap();
    let ones = |bytes: &[u8], at: usize| {
        let mut bytes = bytes.to_vec();
        let end = bytes.len().min(at + 11);
        bytes[at..end].fill(0xff);
        bytes
    };
    for part in 1..12 {
        fs::write(path.join("map.laz"), ones(&map, map.len() * part / 12)).unwrap();
        fs::write(&scan, ones(&whole, whole.len() * part / 12)).unwrap();
        for arguments in [
            "info log",
            "score log -t truth.tum --json",
            "score town.mcap -t truth.tum --map map.laz --json",
            "map build map.laz -o built.dmpmap",
            "truth smd map.laz whole.laz --json",
        ] {
            let output = dmp(path, &format!("{arguments} --quiet"));
            let (code, told) = (output.status.code(), text(&output.stderr));
            assert!(matches!(code, Some(0 | 1 | 3)), "{arguments}, part {part}: {code:?}\n{told}");
            assert!(code != Some(1) || told.lines().count() == 1, "{arguments}, part {part}\n{told}");
        }
    }
}

/// A store on a disk that fails under it is an error, not a signal.
#[cfg(target_os = "linux")]
#[test]
fn row_22_a_map_cut_short_while_it_is_read_is_an_error() {
    let (folder, _) = town();
    let path = folder.path();
    scored(path, "score town.mcap -t truth.tum --save-maps maps", 0);
    let whole = fs::read(path.join("maps/truth.dmpmap")).unwrap();
    let map = path.join("map.dmpmap");
    let mut cut = 0;
    for arguments in [
        "map verify map.dmpmap",
        "map export map.dmpmap -o map.ply",
        "score town.mcap -t truth.tum --map map.dmpmap",
    ]
    .repeat(4)
    {
        fs::write(&map, &whole).unwrap();
        let mut child = dmp_command(path, arguments);
        let mut child = child.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let handles = format!("/proc/{}/fd", child.id());
        let is_open = || {
            let handles = fs::read_dir(&handles).into_iter().flatten().flatten();
            handles
                .filter_map(|handle| fs::read_link(handle.path()).ok())
                .any(|file| file.ends_with("map.dmpmap"))
        };
        while child.try_wait().unwrap().is_none() && !is_open() {}
        fs::File::options().write(true).open(&map).unwrap().set_len(64).unwrap();
        let output = child.wait_with_output().unwrap();
        let (code, told) = (output.status.code(), text(&output.stderr));
        // Perhaps all was read before.
        assert!(matches!(code, Some(0 | 1 | 3)), "{arguments}: {code:?}\n{told}");
        assert!(code == Some(0) || told.contains("map.dmpmap"), "{arguments}\n{told}");
        cut += usize::from(code != Some(0));
    }
    assert!(cut > 0, "every map was read before it was cut short");
}
