//! Rows 5, 6 and 25: full disks, leftovers, and outputs in the place of inputs, of each other, and of what is no file.

use std::fs::{self, File};
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink};
use std::process::{Child, Stdio};

use dmp_log::FolderFormat;

use super::table::Row;
use super::{GATE, Town, contents, names_in, report, run, scores};
use crate::common::{dmp_command, text};

const BEFORE: &str = "what was there before";

pub(super) const ROWS: &[Row] = &[
    Row {
        // A limit of file sizes stands for the full disk: both refuse to write midway. In blocks of 512 bytes, or of 1024 in
        // some shells.
        number: 5,
        made: |town| {
            for name in ["maps/truth.dmpmap", "old.mcap", "old.truth.tum", "work/other", "wrong.tum"] {
                town.write(name, BEFORE);
            }
            let number = std::cell::Cell::new(0);
            let astray = town.changed("truth.tum", |ns, mut pose| {
                number.set(number.get() + 1);
                let utm = nalgebra::Vector3::new(500_000.0, 5_400_000.0, 0.0);
                pose.translation.vector += if number.get() == 12 { nalgebra::Vector3::zeros() } else { utm };
                Some((ns, pose))
            });
            town.tum("astray.tum", &astray);
            let long: String = (0..100_000).map(|k| format!("{k} 0 0 0 0 0 0 1\n")).collect();
            town.write("long.tum", long);
            // So many that each run's share of the memory is small.
            let many: String = (0..24).map(|k| format!(" -t run{k}=@/noise.tum")).collect();
            town.line(format!(
                "[ulimit -f 8] score @/town.mcap{many} --work work --memory 136MiB => 1 work | cannot write the scratch file"
            ));
        },
        lines: "
            [ulimit -f 8] score town.mcap -t truth.tum --work work => 1 work | cannot write the store
            [ulimit -f 8] map build town.mcap -t truth.tum -o maps/truth.dmpmap => 1 truth.with-trails.dmpmap | cannot write
            [ulimit -f 8] convert log town.mcap -o new.mcap => 1 new.mcap | cannot write
            [ulimit -f 2] convert log town.mcap -o new --to pcd => 1 new | cannot write
            [ulimit -f 2] convert log town.mcap -o new --to laz => 1 new | cannot write
            [ulimit -f 8] simulate town -o old.mcap --truth old.truth.tum --scans 20 => 1 old.mcap | cannot write
            [ulimit -f 8] simulate town -o new --scans 20 => 1 new | cannot write
            [ulimit -f 8] man -o pages => 1 pages/dmp | cannot write
            [ulimit -f 1] simulate errors truth.tum --scale 1.1 -o wrong.tum => 1 wrong.tum | cannot write
            score town.mcap -t astray.tum --residuals r.laz => 2 r.laz | LAS reaches 214 km | pose 12 of | .ply
            score town.mcap -t long.tum --memory 32MiB => 2 100,000 poses need at least | --memory
            score town.mcap -t long.tum -t truth.tum --memory 32MiB => 2 poses need at least | --memory
            score town.mcap --report no/page.html => 2 no/page.html | there is no folder no
            simulate town -o new --traffic 18446744073709551615 => 2 the number of cars | up to 10000",
    },
    Row {
        // Every option that writes, in the place of everything that is read.
        number: 25,
        made: |town| {
            town.write("result.json", town.make("score town.mcap -t truth.tum --json --quiet"));
            town.make("map build town.mcap -t truth.tum -o truth.dmpmap --quiet");
            town.make("convert log town.mcap -o scans --to pcd --quiet");
            // Nobody comes to read them.
            for name in ["graph/graph.g2o", "graph/candidates.g2o", "graph/labels.csv"] {
                town.write(name, name);
            }
            fs::hard_link(town.path("truth.tum"), town.path("hard.html")).unwrap();
            symlink("truth.tum", town.path("soft.csv")).unwrap();
        },
        lines: "
            map build town.mcap -t truth.tum -o town.mcap => 2 output
            map build town.mcap -t truth.tum -o truth.tum => 2 output
            map build scans -t truth.tum -o scans/scans/000003.pcd => 2 output
            map export truth.dmpmap -o truth.dmpmap => 2 output
            convert log town.mcap -o town.mcap => 2 output
            convert trajectory truth.tum -o ./truth.tum --to tum => 2 output
            simulate errors truth.tum --scale 1.1 -o truth.tum => 2 output
            simulate city --km 1 -o x.mcap --truth x.mcap => 2 output
            simulate town -o x.mcap --truth ./x.mcap => 2 output
            score town.mcap {gate} --junit truth.tum => 2 output
            score town.mcap {gate} --junit town.mcap => 2 output
            score town.mcap --report hard.html => 2 output
            score town.mcap --per-frame soft.csv => 2 output
            score town.mcap --per-tile soft.csv => 2 output
            score town.mcap --per-tile x.csv --per-frame ./x.csv => 2 output
            score town.mcap --report x.html {gate} --junit x.html => 2 output
            score town.mcap -t town=truth.tum --residuals town.mcap => 2 output
            compare result.json result.json {gate} --junit result.json => 2 output
            loops graph/graph.g2o --candidates graph/candidates.g2o --truth graph/labels.csv --svg graph/labels.csv => 2 output
            loops graph/graph.g2o --candidates graph/candidates.g2o --accept --save-graph graph/graph.g2o => 2 output
            truth ape truth.tum drift.tum --save_results drift.tum => 2 output",
    },
    Row {
        // What is read without being named, beside inputs and above them; and what would be read the next time.
        number: 25,
        made: |town| {
            town.scans("drive", town.scans, FolderFormat::Bin);
            town.scans("survey", town.scans, FolderFormat::Laz);
            town.write("bag/town.mcap", town.read("town.mcap"));
            for name in
                ["bagd/bag.db3", "bagd/metadata.yaml", "rgbd/depth/1.png", "rgbd/depth.txt", "rgbd/camera.json"]
            {
                town.write(name, name);
            }
            town.write("kitti/other", "");
            town.make("convert trajectory truth.tum --to kitti --quiet -o kitti/poses.txt");
            town.write("plots/other", "");
            fs::hard_link(town.path("drive/times.txt"), town.path("hard.html")).unwrap();
            fs::hard_link(town.path("drift.tum"), town.path("plots/time-offset.svg")).unwrap();
            symlink("bag/town.mcap", town.path("soft.html")).unwrap();
        },
        lines: "
            simulate errors kitti/poses.txt --scale 1.1 -o kitti/times.txt => 2 output
            simulate errors kitti/poses.txt --scale 1.1 -o calib.txt => 2 output
            score drive/scans {gate} --junit drive/times.txt => 2 output
            score drive/scans --report hard.html => 2 output
            score drive/scans {gate} --junit drive/calib.txt => 2 output
            score drive/scans {gate} --junit drive/times/000003.f32 => 2 output
            score rgbd/depth {gate} --junit rgbd/camera.json => 2 output
            score rgbd/depth {gate} --junit rgbd/depth.txt => 2 output
            score bag --report soft.html => 2 output
            score bagd/bag.db3 {gate} --junit bagd/metadata.yaml => 2 output
            score bagd/bag.db3 {gate} --junit bagd/bag.db3-journal => 2 output
            calibrate town.mcap -t drift.tum --plots plots => 2 output
            score survey -t truth.tum --residuals survey/scans/out.laz => 2 output
            score survey -t truth.tum --residuals survey/out.laz => 2 output
            map build drive -t truth.tum -o drive/scans/zz.bin => 2 output
            score drive {gate} --junit drive/calib.txt => 2 output
            score drive {gate} --junit drive/scans/timestamps.txt => 2 output
            convert log bag -o bag/again.mcap => 2 output
            score rgbd {gate} --junit rgbd/depth/2.png => 2 output
            score drive --report drive/report.html --per-frame drive/scores.csv => 0 truth first",
    },
    Row {
        // Outputs do not meet, whatever links lead to.
        number: 25,
        made: |town| {
            for name in ["a.csv", "b.csv", "log.mcap", "log.tum"] {
                symlink("nowhere", town.path(name)).unwrap();
            }
        },
        lines: "
            convert trajectory truth.tum --to kitti -o times.txt => 2 output
            convert trajectory truth.tum --to redwood -o ./times.txt => 2 output
            simulate town -o new/ --truth new/times.txt => 2 output
            simulate city --km 1 -o new --truth ./new/scans/000000.bin => 2 output
            score town.mcap -t truth.tum -t @/drift.tum --residuals r.laz --per-frame r.drift.laz => 2 output
            score town.mcap --per-frame a.csv --per-tile b.csv => 2 output
            simulate town -o log.mcap --truth log.tum => 2 output
            simulate town -o new/ --truth new/truth.tum --scans 2 --azimuth-steps 20 => 0/0",
    },
    Row {
        // A file that no option names is not replaced.
        number: 25,
        made: |town| {
            for name in ["pages/dmp-score.1", "new.truth.tum", "times.txt", "labels.csv"] {
                town.write(name, BEFORE);
            }
            town.write("others/dmp-score.1", ".TH \"dmp-score\" 1 \"\" \"dmp 0.0.1\"\n");
            town.write("kitti/other", "");
        },
        lines: "
            man -o pages => 2 pages/dmp-score.1 | is there already
            simulate town -o new.mcap --scans 2 => 2 new.truth.tum | is there already
            simulate city -o new.mcap --km 1 => 2 new.truth.tum | is there already
            convert trajectory truth.tum --to kitti -o poses.txt => 2 times.txt | is there already
            simulate loops @/drift.tum -o . => 2 labels.csv | is there already
            man -o others => 0/0
            man -o others => 0/0
            simulate town -o new.mcap --truth new.truth.tum --scans 2 --azimuth-steps 9 => 0/0
            simulate town -o new.mcap --truth new.truth.tum --scans 2 --azimuth-steps 9 => 0/0
            convert trajectory truth.tum --to kitti -o kitti/poses.txt => 0/0
            convert trajectory truth.tum --to kitti -o kitti/poses.txt => 0/0
            simulate town -o twice.mcap --scans 2 --azimuth-steps 9 => 0/0
            simulate town -o twice.mcap --scans 2 --azimuth-steps 9 => 0/0
            simulate city -o city.mcap --km 0.05 --beams 2 --azimuth-steps 9 => 0/0
            simulate city -o city.mcap --km 0.05 --beams 2 --azimuth-steps 9 => 0/0",
    },
];

#[test]
fn row_06_leftovers_are_never_used_and_programs_at_once_do_not_meet() {
    let town = Town::new();
    let path = town.root();
    fs::create_dir(town.path("work")).unwrap();
    let score = |run: &str| format!("score town.mcap -t run={run}.tum --work work");
    let alone = ["truth", "drift"].map(|run| scores(&report(path, "", &score(run), 0)));
    // What a killed run leaves: a part of a work folder, under a name of its own.
    town.make("map build town.mcap -t drift.tum -o drift.dmpmap --quiet");
    town.write("work/dmp-work-AbC123/run.dmpmap", town.read("drift.dmpmap"));
    let leftover = contents(&town.path("work"));
    assert_eq!(scores(&report(path, "", &score("truth"), 0)), alone[0]);
    assert!(contents(&town.path("work")) == leftover);
    fs::remove_dir_all(town.path("work/dmp-work-AbC123")).unwrap();

    // The same name for other runs, at once.
    let start = |run: &str| -> Child {
        let mut command = dmp_command(path, &format!("{} --json --quiet", score(run)));
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let children = ["truth", "drift", "truth"].map(start);
    for (child, alone) in children.into_iter().zip([&alone[0], &alone[1], &alone[0]]) {
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        assert_eq!(&scores(&serde_json::from_slice(&output.stdout).unwrap()), alone);
    }
    assert_eq!(names_in(&town.path("work")), [""; 0]);
}

/// The scores are printed, and the other files are written.
#[test]
fn row_05_a_file_that_cannot_be_written_hides_no_scores() {
    let town = Town::new();
    symlink("/dev/full", town.path("full.csv")).unwrap();
    symlink("/dev/full", town.path("full.html")).unwrap();
    let whole = town.report("score town.mcap -t truth.tum --drift=none");
    for (outputs, full, written) in [
        ("--per-frame full.csv --report page.html", "full.csv", &["page.html"][..]),
        ("--per-tile full.csv --keep kept.dmp --residuals r.laz", "full.csv", &["kept.dmp", "r.laz"]),
        ("--report full.html --scene scene.mcap", "full.html", &["scene.mcap"]),
        ("--report full.html --expect R_near_5<0.01cm", "full.html", &[]),
        ("--report full.html --quick", "full.html", &[]),
    ] {
        let drift = if outputs.contains("--quick") { "" } else { "--drift=none" };
        let arguments = format!("score town.mcap -t truth.tum {drift} {outputs} --json --quiet");
        let output = run(town.root(), "", &arguments);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(5), "{arguments}: {stderr}");
        let last = stderr.lines().last().unwrap();
        let words = [&format!("error: {full}: cannot write"), "the scores are complete"];
        assert!(words.iter().all(|word| last.contains(*word)), "{arguments}: {stderr}");
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        if !outputs.contains("--quick") {
            assert_eq!(scores(&report), scores(&whole), "{arguments}");
        }
        assert!(written.iter().all(|file| fs::metadata(town.path(file)).unwrap().len() > 100), "{arguments}");
    }
}

/// What is no file takes what is written, and stays what it is.
#[test]
fn row_25_what_is_no_file_is_written_through() {
    let town = Town::new();
    let null = || fs::metadata("/dev/null").unwrap();
    let mode = null().permissions().mode();
    for arguments in [
        &format!("score town.mcap -t truth.tum {GATE} --junit /dev/null --quiet"),
        "map build town.mcap -t truth.tum -o /dev/null --quiet",
        "simulate errors truth.tum --scale 1.1 -o /dev/null --quiet",
        "convert trajectory truth.tum --to kitti -o /dev/null --quiet",
    ] {
        town.make(arguments);
        assert!(null().file_type().is_char_device() && null().permissions().mode() == mode, "{arguments}");
    }
    // A link stays, what it leads to keeps its permissions, what a killed program left is removed.
    symlink("kept.tum", town.path("link.tum")).unwrap();
    town.write("kept.tum", "before");
    fs::set_permissions(town.path("kept.tum"), fs::Permissions::from_mode(0o604)).unwrap();
    town.write(".kept.tum.abc123.dmp-tmp", "half");
    town.make("simulate errors truth.tum --scale 1.1 -o link.tum --quiet");
    assert!(fs::symlink_metadata(town.path("link.tum")).unwrap().is_symlink());
    let kept = fs::metadata(town.path("kept.tum")).unwrap();
    assert!(kept.len() > 100 && kept.permissions().mode() & 0o777 == 0o604);
    assert!(!names_in(town.root()).iter().any(|name| name.ends_with(".dmp-tmp")));
}

/// The command with standard output at the end of a file: its exit code and standard error.
fn printed_into(town: &Town, file: &str, arguments: &str) -> (Option<i32>, String) {
    let out = File::options().append(true).create(true).open(town.path(file)).unwrap();
    let output = dmp_command(town.root(), arguments).stdout(out).stderr(Stdio::piped()).output().unwrap();
    (output.status.code(), text(&output.stderr))
}

#[test]
fn row_25_what_is_printed_meets_no_file() {
    let town = Town::new();
    town.scans("drive", town.scans, FolderFormat::Bin);
    let before = contents(town.root());
    let score = "score town.mcap -t truth.tum --json --quiet";
    for (file, arguments) in [
        ("truth.tum", score.to_owned()),
        ("drive/times.txt", "score drive -t truth.tum --quiet".into()),
        ("drive/scans/000001.bin", "score drive -t truth.tum --quiet".into()),
        ("f.csv", format!("{score} --per-frame f.csv")),
        ("f.csv", format!("{score} {GATE} --junit /dev/stdout")),
    ] {
        let (code, stderr) = printed_into(&town, file, &arguments);
        assert!(code == Some(2) && stderr.lines().count() == 1 && stderr.contains("output"), "{stderr}");
        let _ = fs::remove_file(town.path("f.csv"));
        assert!(contents(town.root()) == before, "{arguments}");
    }
    assert_eq!(printed_into(&town, "drive/out.json", "score drive -t truth.tum --json --quiet").0, Some(0));

    // What is written to standard output is there alone, behind what was there.
    let scale = "simulate errors truth.tum --scale 1.1 -o";
    town.make(&format!("{scale} scaled.tum --quiet"));
    let scaled = text(&town.read("scaled.tum"));
    assert_eq!(text(&town.make(&format!("{scale} /dev/stdout --quiet"))), scaled);
    town.write("all.txt", "before\n");
    let (code, stderr) = printed_into(&town, "all.txt", &format!("{scale} /dev/stdout"));
    assert!(code == Some(0) && stderr.contains("poses, ATE"), "{stderr}");
    assert_eq!(text(&town.read("all.txt")), format!("before\n{scaled}"));
    let map = File::create(town.path("map")).unwrap();
    let mut build = dmp_command(town.root(), "map build town.mcap -t truth.tum -o /dev/stdout --quiet");
    assert!(build.stdout(map).status().unwrap().success());
    town.make("map verify map");
}
