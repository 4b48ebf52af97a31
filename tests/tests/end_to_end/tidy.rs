//! The rules of the house: who may use whom, and what stays inside which crate.

use std::path::{Path, PathBuf};

use crate::common::workspace;

/// What each crate may name in its `[dependencies]`: the table of `docs/architecture.md`.
const TABLE: [(&str, &[&str]); 13] = [
    ("dmp-lengths", &["serde"]),
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
    ("dmp-disk", &["bytemuck", "crc32fast", "rustix", "tempfile", "thiserror"]),
    (
        "dmp-map",
        &[
            "bytemuck",
            "crc32fast",
            "dmp-disk",
            "dmp-sensor",
            "memmap2",
            "rayon",
            "tempfile",
            "thiserror",
            "zstd",
        ],
    ),
    ("dmp-cast", &["bytemuck", "dmp-map", "obvhs", "rayon"]),
    ("dmp-reduce", &["dmp-lengths", "libm", "serde", "thiserror"]),
    ("dmp-sim", &["dmp-lengths", "dmp-sensor", "libm", "nalgebra", "rayon", "thiserror"]),
    (
        "dmp",
        &[
            "crossbeam-channel",
            "dmp-cast",
            "dmp-disk",
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
    ("dmp-truth", &["dmp-disk", "dmp-map", "dmp-sensor", "libm", "nalgebra", "rayon", "rstar", "thiserror"]),
    (
        "dmp-loops",
        &[
            "dmp",
            "dmp-cast",
            "dmp-disk",
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

pub(crate) fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

/// Every line of code (not of tests at a file's end, nor comments) in the `src` of the crates.
fn code_lines() -> Vec<(String, PathBuf, String)> {
    let mut lines = Vec::new();
    for (name, _) in TABLE {
        for file in rust_files(&workspace().join("crates").join(name).join("src")) {
            // A file of tests.
            if file.file_name().is_some_and(|name| name == "tests.rs") {
                continue;
            }
            let text = std::fs::read_to_string(&file).unwrap();
            let file_lines: Vec<&str> = text.lines().collect();
            // A module of tests ends a file; a test's helper that is only declared does not.
            let opens = |pair: &[&str]| pair[0].trim() == "#[cfg(test)]" && pair[1].ends_with('{');
            let tests = file_lines.windows(2).position(opens).unwrap_or(file_lines.len());
            let code = file_lines[..tests].iter();
            let code = code.filter(|line| !line.trim_start().starts_with("//"));
            lines.extend(code.map(|line| (name.to_owned(), file.clone(), (*line).to_owned())));
        }
    }
    assert!(lines.len() > 3000, "the crates were to be found");
    lines
}

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

#[test]
fn foreign_types_stay_inside_their_crate() {
    for (name, file, line) in code_lines() {
        for (foreign, home) in [
            ("obvhs", "dmp-cast"),
            ("mcap", "dmp-log"),
            ("las", "dmp-log"),
            ("rusqlite", "dmp-log"),
            ("memmap2", "dmp-map"),
        ] {
            let used = line.contains(&format!("{foreign}::")) && !line.contains(&format!("_{foreign}::"));
            assert!(!used || name == home, "{}: {line}", file.display());
        }
    }
}

#[test]
fn files_are_opened_in_few_crates_only() {
    for (name, file, line) in code_lines() {
        let opens = ["File::open", "File::create", "OpenOptions", "fs::read", "fs::write"]
            .iter()
            .any(|w| line.contains(w));
        // The system's own view of this process is not a file of anybody's.
        let of_the_system = file.ends_with("dmp/src/memory.rs");
        assert!(
            !opens || ["dmp-log", "dmp-disk", "dmp-map", "dmp-cli"].contains(&name.as_str()) || of_the_system,
            "{}: {line}",
            file.display()
        );
    }
}

#[test]
fn sines_come_from_one_library() {
    // A C library's sine may differ in the last bit from another's; scores must not.
    let banned = [
        ".sin()",
        ".cos()",
        ".tan()",
        ".asin()",
        ".acos()",
        ".atan()",
        ".atan2(",
        ".sin_cos()",
        ".exp()",
        ".ln()",
        ".powf(",
        ".cbrt()",
        ".hypot(",
        ".exp2(",
        ".log10(",
        ".log2(",
        ".ln_1p(",
        ".powi(",
        "f64::sin",
        "f64::cos",
    ];
    for (name, file, line) in code_lines() {
        let scored = [
            "dmp-sensor",
            "dmp-map",
            "dmp-cast",
            "dmp-reduce",
            "dmp-sim",
            "dmp-truth",
            "dmp-study",
            "dmp-loops",
            "dmp",
        ]
        .contains(&name.as_str());
        assert!(!scored || !banned.iter().any(|w| line.contains(w)), "{}: {line}", file.display());
    }
}

#[test]
fn unsafe_code_is_where_it_may_be() {
    for (_, file, line) in code_lines() {
        let used = line.contains("unsafe {") || line.contains("unsafe fn") || line.contains("unsafe impl");
        let may = file.ends_with("dmp-map/src/store/read.rs")
            || file.parent().is_some_and(|folder| folder.ends_with("dmp-cast/src/lanes"));
        assert!(!used || may, "{}: {line}", file.display());
    }
}
