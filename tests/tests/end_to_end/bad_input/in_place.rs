//! Row 25: outputs in the place of inputs, of each other, and of what is no file.

use std::fs;
use std::path::Path;

use super::{names_in, scored, town};
use crate::common::{dmp, refused, text};

/// Every option that writes, in the place of everything that is read.
#[test]
fn row_25_outputs_never_take_the_place_of_inputs() {
    let (folder, _) = town();
    let path = folder.path();
    let saved = dmp(path, "score town.mcap -t truth.tum --json --quiet");
    fs::write(path.join("result.json"), &saved.stdout).unwrap();
    assert_eq!(dmp(path, "map build town.mcap -t truth.tum -o truth.dmpmap --quiet").status.code(), Some(0));
    // Nobody comes to read them.
    fs::create_dir(path.join("graph")).unwrap();
    for name in ["graph.g2o", "candidates.g2o", "labels.csv"] {
        fs::write(path.join("graph").join(name), name).unwrap();
    }
    assert_eq!(dmp(path, "convert log town.mcap -o scans --to pcd --quiet").status.code(), Some(0));
    fs::hard_link(path.join("truth.tum"), path.join("hard.html")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("truth.tum", path.join("soft.csv")).unwrap();
    #[cfg(not(unix))]
    fs::hard_link(path.join("truth.tum"), path.join("soft.csv")).unwrap();
    let score = "score town.mcap -t truth.tum -t drift.tum";
    let gate = "--fail-above R_near_5=4.9";
    let graph = "loops graph/graph.g2o --candidates graph/candidates.g2o --truth graph/labels.csv";
    let before = contents(path);
    for arguments in [
        "map build town.mcap -t truth.tum -o town.mcap".to_owned(),
        "map build town.mcap -t truth.tum -o truth.tum".into(),
        "map build scans -t truth.tum -o scans/scans/000003.pcd".into(),
        "map export truth.dmpmap -o truth.dmpmap".into(),
        "convert log town.mcap -o town.mcap".into(),
        "convert trajectory truth.tum -o ./truth.tum --to tum".into(),
        "simulate errors truth.tum --scale 1.1 -o truth.tum".into(),
        "simulate city --km 1 -o x.mcap --truth x.mcap".into(),
        "simulate town -o x.mcap --truth ./x.mcap".into(),
        format!("{score} {gate} --junit truth.tum"),
        format!("{score} {gate} --junit town.mcap"),
        format!("score town.mcap -t truth.tum --like result.json {gate} --junit result.json"),
        format!("{score} --report hard.html"),
        format!("{score} --per-frame soft.csv"),
        format!("{score} --per-tile soft.csv"),
        format!("{score} --per-tile x.csv --per-frame ./x.csv"),
        format!("{score} --report x.html {gate} --junit x.html"),
        "score town.mcap -t town=truth.tum --residuals town.mcap".into(),
        "score town.mcap -t truth=truth.tum --map truth.dmpmap --save-maps .".into(),
        format!("compare result.json result.json {gate} --junit result.json"),
        format!("{graph} --svg graph/labels.csv"),
        format!("{graph} --accept --save-graph graph/graph.g2o"),
        "truth ape truth.tum drift.tum --save_results drift.tum".into(),
    ] {
        refused(path, &arguments, 2, &["output"]);
        assert!(contents(path) == before, "{arguments}");
    }
}

/// What is no file takes what is written, and stays what it is.
#[cfg(unix)]
#[test]
fn row_25_what_is_no_file_is_written_through() {
    use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
    let (folder, _) = town();
    let path = folder.path();
    let null = || fs::metadata("/dev/null").unwrap();
    let of_null = (null().permissions().mode(), fs::read_link("/dev/null").is_ok());
    for arguments in [
        "score town.mcap -t truth.tum --fail-above R_near_5=4.9 --junit /dev/null --quiet",
        "map build town.mcap -t truth.tum -o /dev/null --quiet",
        "simulate errors truth.tum --scale 1.1 -o /dev/null --quiet",
        "convert trajectory truth.tum --to kitti -o /dev/null --quiet",
    ] {
        let output = dmp(path, arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", text(&output.stderr));
        assert!(null().file_type().is_char_device(), "{arguments}");
        assert_eq!((null().permissions().mode(), fs::read_link("/dev/null").is_ok()), of_null);
    }
    let convert = "convert trajectory truth.tum --to tum --quiet -o";
    scored_quietly(path, &format!("{convert} copy.tum"));
    let printed = dmp(path, &format!("{convert} /dev/stdout"));
    assert!(text(&printed.stdout).starts_with(&fs::read_to_string(path.join("copy.tum")).unwrap()));
    // A link stays, what it leads to keeps its permissions, what a killed program left is swept.
    std::os::unix::fs::symlink("kept.tum", path.join("link.tum")).unwrap();
    fs::write(path.join("kept.tum"), "before").unwrap();
    fs::set_permissions(path.join("kept.tum"), fs::Permissions::from_mode(0o604)).unwrap();
    fs::write(path.join(".kept.tum.abc123.dmp-tmp"), "half").unwrap();
    scored_quietly(path, "simulate errors truth.tum --scale 1.1 -o link.tum --quiet");
    assert!(fs::symlink_metadata(path.join("link.tum")).unwrap().is_symlink());
    let kept = fs::metadata(path.join("kept.tum")).unwrap();
    assert!(kept.len() > 100 && kept.permissions().mode() & 0o777 == 0o604);
    assert!(!names_in(path).iter().any(|name| name.ends_with(".dmp-tmp")));
    assert_eq!(scored(path, "score town.mcap -t truth.tum -t drift.tum", 0)["order"][0], "truth");
}

#[cfg(unix)]
fn scored_quietly(folder: &Path, arguments: &str) {
    let output = dmp(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {}", text(&output.stderr));
}

/// Every file below a folder, and what is in it.
pub(super) fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        if entry.path().is_dir() {
            found.extend(contents(&entry.path()));
        } else {
            found.push((entry.path().display().to_string(), fs::read(entry.path()).unwrap()));
        }
    }
    found.sort();
    found
}
