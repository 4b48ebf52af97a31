//! Row 25: outputs beside inputs and in them, where other outputs lie, and where results are printed.

use std::fs::{self, File};
use std::path::Path;
use std::process::Stdio;

use dmp_log::FolderFormat;

use super::in_place::contents;
use super::{names_in, town, write_folder};
use crate::common::{dmp, dmp_command, refused, text};

const GATE: &str = "--fail-above R_near_5=4.9";

/// What is read without being named, and what would be read the next time.
#[test]
fn row_25_outputs_are_not_read_as_parts_of_inputs() {
    let (folder, scans) = town();
    let path = folder.path();
    for (name, format) in [("drive", FolderFormat::Bin), ("survey", FolderFormat::Laz)] {
        write_folder(&path.join(name), &scans, format);
    }
    for name in ["bag", "bagd", "rgbd", "rgbd/depth", "kitti"] {
        fs::create_dir(path.join(name)).unwrap();
    }
    fs::copy(path.join("town.mcap"), path.join("bag/town.mcap")).unwrap();
    // Nobody comes to read these.
    for name in
        ["bagd/bag.db3", "bagd/metadata.yaml", "rgbd/depth/1.png", "rgbd/depth.txt", "rgbd/camera.json"]
    {
        fs::write(path.join(name), name).unwrap();
    }
    let convert = "convert trajectory truth.tum --to kitti --quiet -o kitti/poses.txt";
    assert_eq!(dmp(path, convert).status.code(), Some(0));
    fs::hard_link(path.join("drive/times.txt"), path.join("hard.html")).unwrap();
    fs::create_dir(path.join("plots")).unwrap();
    fs::hard_link(path.join("drift.tum"), path.join("plots/time-offset.svg")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("bag/town.mcap", path.join("soft.html")).unwrap();
    #[cfg(not(unix))]
    fs::hard_link(path.join("bag/town.mcap"), path.join("soft.html")).unwrap();
    let before = contents(path);
    let (scans, bags) = (format!("drive/scans -t truth.tum {GATE}"), format!("-t truth.tum {GATE}"));
    for arguments in [
        // Beside what is named, and above it.
        "simulate errors kitti/poses.txt --scale 1.1 -o kitti/times.txt".to_owned(),
        "simulate errors kitti/poses.txt --scale 1.1 -o calib.txt".into(),
        format!("score {scans} --junit drive/times.txt"),
        format!("score {scans} --report hard.html"),
        format!("score {scans} --junit drive/calib.txt"),
        format!("score {scans} --junit drive/times/000003.f32"),
        format!("score rgbd/depth {bags} --junit rgbd/camera.json"),
        format!("score rgbd/depth {bags} --junit rgbd/depth.txt"),
        format!("score bag {bags} --report soft.html"),
        format!("score bagd/bag.db3 {bags} --junit bagd/metadata.yaml"),
        format!("score bagd/bag.db3 {bags} --junit bagd/bag.db3-journal"),
        "calibrate town.mcap -t drift.tum --plots plots".into(),
        // New ones.
        "score survey -t truth.tum --residuals survey/scans/out.laz".into(),
        "score survey -t truth.tum --residuals survey/out.laz".into(),
        "map build drive -t truth.tum -o drive/scans/zz.bin".into(),
        format!("score drive {bags} --junit drive/calib.txt"),
        format!("score drive {bags} --junit drive/scans/timestamps.txt"),
        "convert log bag -o bag/again.mcap".into(),
        format!("score rgbd {bags} --junit rgbd/depth/2.png"),
    ] {
        refused(path, &arguments, 2, &["output"]);
        assert!(contents(path) == before, "{arguments}");
    }
    // What no reader looks at can lie there.
    let report = "score drive -t truth.tum --report drive/report.html --per-frame drive/scores.csv --quiet";
    assert_eq!(dmp(path, report).status.code(), Some(0));
    assert!(path.join("drive/report.html").exists());
}

#[test]
fn row_25_outputs_do_not_meet() {
    let (folder, _) = town();
    let path = folder.path();
    #[cfg(unix)]
    for name in ["a.csv", "b.csv", "log.mcap", "log.tum"] {
        std::os::unix::fs::symlink("nowhere", path.join(name)).unwrap();
    }
    let before = names_in(path);
    let score = "score town.mcap -t truth.tum";
    let mut meet = vec![
        "convert trajectory truth.tum --to kitti -o times.txt".to_owned(),
        "convert trajectory truth.tum --to redwood -o ./times.txt".into(),
        "simulate town -o new/ --truth new/times.txt".into(),
        "simulate city --km 1 -o new --truth ./new/scans/000000.bin".into(),
        format!("{score} -t @/drift.tum --residuals r.laz --per-frame r.drift.laz"),
        format!("{score} --save-maps . --per-frame truth.dmpmap"),
    ];
    if cfg!(unix) {
        meet.push(format!("{score} --per-frame a.csv --per-tile b.csv"));
        meet.push("simulate town -o log.mcap --truth log.tum".into());
    }
    for arguments in meet {
        refused(path, &arguments, 2, &["output"]);
        assert_eq!(names_in(path), before, "{arguments}");
    }
    let beside = dmp(path, "simulate town -o new/ --truth new/truth.tum --scans 2 --azimuth-steps 20");
    assert_eq!(beside.status.code(), Some(0), "{}", text(&beside.stderr));
}

/// The command with standard output at the end of a file; what it says.
#[cfg(unix)]
fn printed_into(folder: &Path, file: &str, arguments: &str) -> (Option<i32>, String) {
    let out = File::options().append(true).create(true).open(folder.join(file)).unwrap();
    let mut command = dmp_command(folder, arguments);
    let output = command.stdout(out).stderr(Stdio::piped()).output().unwrap();
    (output.status.code(), text(&output.stderr))
}

#[cfg(unix)]
#[test]
fn row_25_what_is_printed_meets_no_file() {
    let (folder, scans) = town();
    let path = folder.path();
    write_folder(&path.join("drive"), &scans, FolderFormat::Bin);
    let before = contents(path);
    let score = "score town.mcap -t truth.tum --json --quiet";
    for (file, arguments) in [
        ("truth.tum", score.to_owned()),
        ("drive/times.txt", "score drive -t truth.tum --quiet".into()),
        ("drive/scans/000001.bin", "score drive -t truth.tum --quiet".into()),
        ("f.csv", format!("{score} --per-frame f.csv")),
        ("f.csv", format!("{score} {GATE} --junit /dev/stdout")),
    ] {
        let (code, told) = printed_into(path, file, &arguments);
        assert!(code == Some(2) && told.lines().count() == 1 && told.contains("output"), "{told}");
        let _ = fs::remove_file(path.join("f.csv"));
        assert!(contents(path) == before, "{arguments}");
    }
    assert_eq!(printed_into(path, "drive/out.json", "score drive -t truth.tum --json --quiet").0, Some(0));

    // What is written to standard output is there alone, behind what was there.
    let scale = "simulate errors truth.tum --scale 1.1 -o";
    assert_eq!(dmp(path, &format!("{scale} scaled.tum --quiet")).status.code(), Some(0));
    let scaled = fs::read_to_string(path.join("scaled.tum")).unwrap();
    assert_eq!(text(&dmp(path, &format!("{scale} /dev/stdout --quiet")).stdout), scaled);
    fs::write(path.join("all.txt"), "before\n").unwrap();
    let (code, told) = printed_into(path, "all.txt", &format!("{scale} /dev/stdout"));
    assert!(code == Some(0) && told.contains("poses, ATE"), "{told}");
    assert_eq!(fs::read_to_string(path.join("all.txt")).unwrap(), format!("before\n{scaled}"));
    let out = File::create(path.join("map")).unwrap();
    let mut build = dmp_command(path, "map build town.mcap -t truth.tum -o /dev/stdout --quiet");
    assert!(build.stdout(out).status().unwrap().success());
    assert_eq!(dmp(path, "map verify map").status.code(), Some(0));
}

/// A file that no option names is not replaced.
#[test]
fn row_25_files_that_nobody_named_are_kept() {
    let (folder, _) = town();
    let path = folder.path();
    fs::create_dir(path.join("pages")).unwrap();
    for name in ["pages/dmp-score.1", "new.truth.tum", "times.txt", "labels.csv"] {
        fs::write(path.join(name), "what was there before").unwrap();
    }
    let before = contents(path);
    let long_drive = concat!(env!("CARGO_MANIFEST_DIR"), "/../data-samples/drift.tum");
    let loops = format!("simulate loops {long_drive} -o .");
    for (arguments, name) in [
        ("man -o pages", "pages/dmp-score.1"),
        ("simulate town -o new.mcap --scans 2", "new.truth.tum"),
        ("simulate city -o new.mcap --km 1", "new.truth.tum"),
        ("convert trajectory truth.tum --to kitti -o poses.txt", "times.txt"),
        (loops.as_str(), "labels.csv"),
    ] {
        refused(path, arguments, 2, &[name, "is there already"]);
        assert!(contents(path) == before, "{arguments}");
    }
    // Pages of another version are replaced, and what is named is.
    fs::write(path.join("pages/dmp-score.1"), ".TH \"dmp-score\" 1 \"\" \"dmp 0.0.1\"\n").unwrap();
    let named = "simulate town -o new.mcap --truth new.truth.tum --scans 2 --azimuth-steps 9";
    // The very same may be written again, as after a kill; `--to kitti` is no folder.
    fs::create_dir(path.join("kitti")).unwrap();
    let again = "convert trajectory truth.tum --to kitti -o kitti/poses.txt";
    let beside = "simulate town -o twice.mcap --scans 2 --azimuth-steps 9";
    let city = "simulate city -o city.mcap --km 0.05 --beams 2 --azimuth-steps 9";
    let twice = [beside, beside, city, city].into_iter();
    for arguments in ["man -o pages", "man -o pages", named, named, again, again].into_iter().chain(twice) {
        let output = dmp(path, arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", text(&output.stderr));
    }
}
