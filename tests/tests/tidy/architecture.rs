//! Who may use whom.

use crate::sources::workspace;

/// What each crate may name in its `[dependencies]`: the table of `docs/architecture.md`.
const TABLE: [(&str, &[&str]); 12] = [
    ("dmp-sensor", &["nalgebra", "serde", "thiserror"]),
    (
        "dmp-log",
        &[
            "bytemuck",
            "crc32fast",
            "dmp-sensor",
            "las",
            "laz",
            "lz4",
            "mcap",
            "nalgebra",
            "png",
            "rusqlite",
            "saphyr-parser",
            "serde_json",
            "tempfile",
            "thiserror",
            "zstd",
        ],
    ),
    (
        "dmp-map",
        &[
            "bytemuck",
            "crc32fast",
            "crossbeam-channel",
            "dmp-sensor",
            "memmap2",
            "rayon",
            "rustix",
            "tempfile",
            "thiserror",
            "zstd",
        ],
    ),
    ("dmp-cast", &["bytemuck", "dmp-map", "obvhs", "rayon"]),
    ("dmp-reduce", &["libm", "serde", "thiserror"]),
    ("dmp-sim", &["dmp-log", "dmp-sensor", "libm", "nalgebra", "rayon", "thiserror"]),
    (
        "dmp",
        &[
            "crossbeam-channel",
            "dmp-cast",
            "dmp-log",
            "dmp-map",
            "dmp-reduce",
            "dmp-sensor",
            "postcard",
            "rayon",
            "serde",
            "thiserror",
        ],
    ),
    ("dmp-draw", &["base64", "dmp", "libm", "png"]),
    ("dmp-truth", &["dmp-map", "dmp-sensor", "libm", "nalgebra", "rayon", "rstar", "thiserror"]),
    (
        "dmp-loops",
        &[
            "dmp",
            "dmp-cast",
            "dmp-log",
            "dmp-map",
            "dmp-reduce",
            "dmp-sensor",
            "libm",
            "nalgebra",
            "rayon",
            "thiserror",
        ],
    ),
    (
        "dmp-study",
        &[
            "dmp",
            "dmp-draw",
            "dmp-log",
            "dmp-map",
            "dmp-sensor",
            "dmp-truth",
            "libm",
            "rayon",
            "rstar",
            "serde",
            "thiserror",
        ],
    ),
    (
        "dmp-cli",
        &[
            "anyhow",
            "clap",
            "clap_complete",
            "clap_mangen",
            "ctrlc",
            "dmp",
            "dmp-draw",
            "dmp-log",
            "dmp-loops",
            "dmp-map",
            "dmp-sensor",
            "dmp-sim",
            "dmp-study",
            "dmp-truth",
            "indicatif",
            "serde",
            "serde_json",
            "tempfile",
            "zip",
        ],
    ),
];

#[test]
fn no_crate_reaches_above_its_row() {
    let mut crates: Vec<String> = std::fs::read_dir(workspace().join("crates"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    crates.sort();
    let mut rows: Vec<&str> = TABLE.iter().map(|row| row.0).collect();
    rows.sort_unstable();
    assert_eq!(crates, rows, "every crate has a row in the table");
    for (name, allowed) in TABLE {
        let manifest =
            std::fs::read_to_string(workspace().join("crates").join(name).join("Cargo.toml")).unwrap();
        let manifest: toml::Table = manifest.parse().unwrap();
        for dependency in manifest["dependencies"].as_table().unwrap().keys() {
            assert!(allowed.contains(&dependency.as_str()), "{name} may not use {dependency}");
        }
    }
}
