//! What stays inside which crate, and what each file has.

use crate::sources::{code_lines, crate_folders, rust_files, workspace};

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
        let of_the_system = file.ends_with("dmp/src/means/peak.rs");
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
            "dmp-lengths",
            "dmp-sensor",
            "dmp-disk",
            "dmp-map",
            "dmp-cast",
            "dmp-reduce",
            "dmp-sim",
            "dmp-truth",
            "dmp-loops",
            "dmp",
        ]
        .contains(&name.as_str());
        assert!(!scored || !banned.iter().any(|w| line.contains(w)), "{}: {line}", file.display());
    }
}

#[test]
fn every_file_says_first_what_it_is_for() {
    let mut folders = crate_folders();
    folders.push(workspace().join("xtask"));
    let files = folders.iter().flat_map(|folder| rust_files(&folder.join("src")));
    let silent: Vec<String> = files
        .filter(|file| file.file_name().is_some_and(|name| name != "tests.rs"))
        .filter(|file| !std::fs::read_to_string(file).unwrap().starts_with("//!"))
        .map(|file| file.strip_prefix(workspace()).unwrap().display().to_string())
        .collect();
    assert!(silent.is_empty(), "{} files without a `//!` header:\n{}", silent.len(), silent.join("\n"));
}
