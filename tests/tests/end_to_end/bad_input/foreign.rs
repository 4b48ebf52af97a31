//! Row 27: text that is not what it looks like, or commands what it is printed on.

use std::fs;

use dmp_log::{FolderFormat, McapScanWriter, McapWriterOptions};
use serde_json::Value;

use super::raw::{Cloud, bag, bag_of_records, message_record, static_frames};
use super::{town, write_folder};
use crate::common::{dmp, dmp_command, refused, text};

/// Everything that a command prints: no line of it commands a terminal or a CI server, and none begins with what stands
/// behind an end of line in foreign text.
fn printed(folder: &std::path::Path, arguments: &str) -> String {
    let output = dmp(folder, arguments);
    let told = text(&output.stdout) + &text(&output.stderr);
    let shown = |c: char| {
        let turns = matches!(c, '\u{200b}' | '\u{202e}' | '\u{2060}' | '\u{feff}' | '\u{ad}' | '\u{e0041}');
        !(c.is_control() && c != '\n' && c != '\t' || turns)
    };
    assert!(told.chars().all(shown), "{arguments}\n{told}");
    let commands = |line: &str| line.trim_start().starts_with("::") || line.contains("##[");
    assert_eq!(told.lines().find(|line| commands(line)), None, "{arguments}\n{told}");
    assert!(!told.lines().any(|line| line.trim_start().starts_with("forged")), "{arguments}\n{told}");
    told
}

/// What stands in messages: frames and fields.
#[test]
fn row_27_frames_and_fields_stay_in_their_line() {
    let (folder, scans) = town();
    let path = folder.path();
    let of_scan = |scan| {
        let mut cloud = Cloud::of(scan);
        cloud.frame_id = "a\nforged\t\u{200b}\u{e0041}";
        cloud.fields.push(("b\nforged", 0, 7));
        cloud
    };
    fs::write(path.join("odd.mcap"), bag(&scans.iter().map(of_scan).collect::<Vec<_>>())).unwrap();
    let told = printed(path, "info odd.mcap");
    for expected in [r"a\u000aforged\u0009\u200b\udb40\udc41", r"b\u000aforged (float32, not used)"] {
        assert!(told.contains(expected), "{told}");
    }
    let json: Value = serde_json::from_slice(&dmp(path, "info odd.mcap --json").stdout).unwrap();
    assert_eq!(json["streams"][0]["scans"]["frame_id"], "a\nforged\t\u{200b}\u{e0041}");
    printed(path, "score odd.mcap -t truth.tum -t drift.tum --verbose");
    printed(path, "calibrate odd.mcap -t truth.tum");
}

/// A result of another day's, and of anybody's.
#[test]
fn row_27_texts_of_saved_results_stay_in_their_line() {
    let (folder, _) = town();
    let path = folder.path();
    let saved = dmp(path, "score town.mcap -t truth.tum -t drift.tum --json --quiet");
    let mut report: Value = serde_json::from_slice(&saved.stdout).unwrap();
    let odd = "b\n::stop-commands::x\n##[group]\nforged\u{feff}\u{ad}";
    report["warnings"] = serde_json::json!([odd]);
    report["left_out"] = serde_json::json!([{ "name": odd, "reason": odd }]);
    report["inputs"]["dropped"][odd] = 1.into();
    report["inputs"]["runs"][0]["map_notes"] = serde_json::json!([odd]);
    report["runs"][0]["r_cv_withheld"] = odd.into();
    report["pairs"][0]["reason"] = odd.into();
    fs::write(path.join("odd.json"), report.to_string()).unwrap();
    let told = printed(path, "compare odd.json -v");
    let written_out = r"b\u000a::stop-commands::x\u000a\u0023#[group]\u000aforged\ufeff\u00ad";
    assert!(told.matches(written_out).count() >= 4, "{told}");
    printed(path, "compare odd.json --json");
}

/// Names that are printable, and command all the same where they begin a line.
#[test]
fn row_27_names_that_begin_like_commands_of_ci_servers_are_written_out() {
    let (folder, scans) = town();
    let path = folder.path();
    fs::copy(path.join("drift.tum"), path.join("::warning::a.tum")).unwrap();
    fs::copy(path.join("drift.tum"), path.join("##[error]b.tum")).unwrap();
    fs::copy(path.join("town.mcap"), path.join("::add-mask::c.mcap")).unwrap();
    write_folder(&path.join("::group::d"), &scans, FolderFormat::Bin);
    let runs = "-t ::warning::a.tum -t ##[error]b.tum -t ::e=truth.tum";
    for arguments in [
        &format!("score ::add-mask::c.mcap {runs} --verbose --save-maps maps"),
        &format!("score ::add-mask::c.mcap {runs} --json --fail-above R_near_5=0.01cm"),
        &format!("calibrate ::add-mask::c.mcap {runs}"),
        &format!("info ::add-mask::c.mcap {runs}"),
        "info ::group::d",
        "map info maps/::e.dmpmap",
        "map verify maps/::e.dmpmap",
        "convert trajectory truth.tum --to kitti -o ::f.txt",
        "convert log ::group::d -o ::f.mcap",
        "truth smd maps/truth.ply ::g.ply",
        "compare ::nowhere.json",
        "loops ::nowhere.g2o --candidates ##[error]nowhere.g2o",
        "man -o ::man",
        "##[error]no-command",
        "score ::add-mask::c.mcap -t truth.tum --memory ##[error]much",
    ] {
        printed(path, arguments);
    }
    let told = printed(path, "info ::group::d");
    assert!(told.starts_with(r"\u003a:group::d"), "{told}");
    // What gates print is meant for a CI server.
    let gate = "--fail-above ::e:R_near_5=0.01cm --annotate github --quiet";
    let failed = dmp(path, &format!("score ::add-mask::c.mcap {runs} {gate}"));
    assert!(text(&failed.stderr).starts_with("::error title=dmp gate failed::"), "{}", text(&failed.stderr));
}

/// Names of files, topics, runs and frames command no terminal and no CI server.
#[test]
fn row_27_foreign_text_is_written_out() {
    let (folder, scans) = town();
    let path = folder.path();
    let odd = "/a\u{1b}[2J\n::stop-commands::x\u{202e}\u{9b}";
    let options =
        McapWriterOptions { topic: odd.into(), frame_id: odd.into(), ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(&path.join("odd.mcap"), &options).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
    // A scan file that is cut is named.
    fs::create_dir(path.join("seq")).unwrap();
    for name in ["000000.bin", "0\n::stop-commands::x\u{1b}[2J.bin"] {
        if fs::write(path.join("seq").join(name), [0; 1601]).is_err() {
            // Not every system has such names.
            return;
        }
    }
    let written_out = r"\u001b[2J\u000a::stop-commands::x\u202e\u009b";
    for arguments in [
        "info odd.mcap",
        "info odd.mcap --json",
        "info seq",
        "score odd.mcap -t truth.tum -t drift.tum --verbose",
        "score odd.mcap -t truth.tum -t drift.tum --json",
        "score odd.mcap --topic /none -t truth.tum",
        "score seq -t truth.tum",
        "convert log seq -o new.mcap",
    ] {
        let output = dmp(path, arguments);
        for stream in [&output.stdout, &output.stderr] {
            let told = text(stream);
            let odd = told.chars().find(|c| c.is_control() && *c != '\n' && *c != '\t' || *c == '\u{202e}');
            assert_eq!(odd, None, "{arguments}\n{told}");
            let commands = told.lines().find(|line| line.trim_start().starts_with("::"));
            assert_eq!(commands, None, "{arguments}\n{told}");
        }
        if arguments == "info odd.mcap" {
            assert!(text(&output.stdout).contains(written_out), "{}", text(&output.stdout));
        }
    }
    let named =
        dmp_command(path, "score town.mcap -t").arg("a\n::stop-commands::x=truth.tum").output().unwrap();
    assert_eq!((named.status.code(), text(&named.stderr).lines().count()), (Some(2), 1));
    // In a result of another day's.
    let saved = dmp(path, "score town.mcap -t truth.tum -t drift.tum --json --quiet");
    let saved = text(&saved.stdout);
    fs::write(path.join("odd.json"), saved.replace("\"truth\"", "\"tr\\u001b[2Juth\"")).unwrap();
    refused(path, "compare odd.json", 1, &["odd.json", r"tr\u001b[2Juth"]);
}

/// Names as long as a format allows.
#[test]
fn row_27_long_names_are_shown_as_far_as_they_fit() {
    let (folder, scans) = town();
    let path = folder.path();
    let long = format!("/{}", "n".repeat(65_535));
    let options = McapWriterOptions { topic: long.clone(), ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(&path.join("long.mcap"), &options).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
    let info = dmp(path, "info long.mcap");
    assert_eq!(info.status.code(), Some(0), "{}", text(&info.stderr));
    assert!(text(&info.stdout).contains("(65536 characters)"));
    let saved = dmp(path, "score town.mcap -t truth.tum -t drift.tum --json --quiet");
    fs::write(path.join("a.json"), text(&saved.stdout)).unwrap();
    let renamed = text(&saved.stdout).replace("\"truth\"", &format!("\"{}\"", &long[1..]));
    fs::write(path.join("long.json"), renamed).unwrap();
    for arguments in ["compare long.json", "compare a.json long.json"] {
        let output = dmp(path, arguments);
        assert!(output.status.code().is_some_and(|code| code != 101), "{}", text(&output.stderr));
    }
}

/// Names by the thousand are told by the first few, and a run's maps get names that file systems take.
#[test]
fn row_27_many_and_long_names_are_cut() {
    let (folder, scans) = town();
    let path = folder.path();
    let clouds: Vec<Vec<u8>> = scans.iter().map(|scan| message_record(&Cloud::of(scan))).collect();
    let frames = static_frames(20_000);
    fs::write(path.join("frames.mcap"), bag_of_records(&[frames, clouds.concat()].concat())).unwrap();
    let which = dmp(path, "score frames.mcap -t truth.tum --quiet");
    let told = text(&which.stderr);
    assert_eq!(which.status.code(), Some(2), "{told}");
    assert!(told.len() < 1000 && told.contains("or one of 19992 more"), "{told}");
    let none = dmp(path, "score frames.mcap -t truth.tum --extrinsic frame:none --quiet");
    let told = text(&none.stderr);
    assert!(told.len() < 1000 && told.contains("one of 19992 more"), "{told}");
    let topic = format!("/{}", "n".repeat(60_000));
    let told = text(&dmp(path, &format!("score town.mcap -t truth.tum --topic {topic}")).stderr);
    assert!(told.len() < 5000 && told.contains(" bytes)"), "{told}");

    let [a, b] = ["a", "b"].map(|end| "n".repeat(250) + end);
    let runs = format!("-t {a}=truth.tum -t {b}=drift.tum");
    let scored = dmp(path, &format!("score town.mcap {runs} --save-maps maps --quiet"));
    assert_eq!(scored.status.code(), Some(0), "{}", text(&scored.stderr));
    let stem = "n".repeat(200);
    let maps = [format!("{stem}-1.dmpmap"), format!("{stem}-2.dmpmap")];
    assert!(
        super::names_in(&path.join("maps")).ends_with(&maps),
        "{:?}",
        super::names_in(&path.join("maps"))
    );
}
