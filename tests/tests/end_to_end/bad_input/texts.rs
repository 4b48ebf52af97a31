//! Rows 26, 27, 29 and 30: messages that nobody takes, text that commands what it is printed on, texts without end, and what
//! results say of the machine.

use std::fs;
use std::process::Stdio;

use dmp_log::{FolderFormat, McapScanWriter, McapWriterOptions};
use serde_json::{Value, json};

use super::clouds::timed;
use super::raw::{Cloud, bag, bag_of_records, message_record, static_frames};
use super::table::Row;
use super::{GATE_THAT_FAILS, Town, run};
use crate::common::{dmp_command, text};

pub(super) const ROWS: &[Row] = &[
    Row {
        number: 29,
        made: texts_without_end,
        lines: "
            [ulimit -v 700000] score seq -t truth.tum => 1 times.txt | 8,589,934,592 bytes
            [ulimit -v 700000] info seq => 1 times.txt | 8,589,934,592 bytes
            [ulimit -v 700000] info other => 1 times.txt | line 1: longer than 65536 bytes
            [ulimit -v 700000] info /dev/zero => 1 /dev/zero
            [ulimit -v 700000] compare /dev/zero => 1 /dev/zero
            [ulimit -v 700000] map info /dev/zero => 1 /dev/zero
            [ulimit -v 700000] map verify /dev/zero => 1 /dev/zero
            [ulimit -v 700000] score town.mcap -t truth.tum --map /dev/zero => 1 /dev/zero
            [ulimit -v 700000] score town.mcap -t truth.tum --map sparse.tum => 1 sparse.tum",
    },
    Row {
        // What says that it is a result is not believed before it is one; fields beside its own are passed over.
        number: 29,
        made: |town| {
            let saved = text(&town.make("score town.mcap -t truth.tum --json --quiet"));
            let many = |what: &str| format!("\"x\": [{}{what}],", format!("{what},").repeat(4 << 20));
            let inputs = "\"inputs\": {";
            town.write("large.json", saved.replacen('{', &format!("{{{}", " ".repeat(64 << 20)), 1));
            town.write("lists.json", saved.replacen(inputs, &format!("{inputs}{}", many("[]")), 1));
            town.write("beside.json", saved.replacen('{', &format!("{{{}", many("{\"a\":0}")), 1));
        },
        lines: "
            [ulimit -v 700000] compare large.json => 1 large.json | more than 67108864 bytes
            [ulimit -v 700000] compare lists.json => 1 lists.json | unknown field `x`
            [ulimit -v 700000] compare beside.json => 0/0",
    },
    Row {
        // A bag names no files outside its folder.
        number: 29,
        made: |town| {
            for (bag, name) in [
                ("up", "../town.mcap"),
                ("root", &town.path("town.mcap").display().to_string()),
                ("bag", "town.mcap"),
            ] {
                let list = format!("rosbag2_bagfile_information:\n  relative_file_paths:\n    - {name}\n");
                town.write(&format!("{bag}/metadata.yaml"), list);
            }
            town.write("bag/town.mcap", town.read("town.mcap"));
        },
        lines: "
            info up => 1 metadata.yaml | line 3 | town.mcap | is not there
            info root => 1 metadata.yaml | line 3 | town.mcap | is not there
            score bag => 0 truth first",
    },
];

/// Numbers by the hundred million in one line; nothing at all, for ever; neither text nor an end; blank lines and no end.
fn texts_without_end(town: &Town) {
    let sparse = |name: &str, bytes: u64| fs::File::create(town.path(name)).unwrap().set_len(bytes).unwrap();
    for (folder, bytes) in [("seq", 8 << 30), ("other", 400 << 20)] {
        town.scans(folder, town.scans, FolderFormat::Bin);
        sparse(&format!("{folder}/times.txt"), bytes);
    }
    town.write("line.txt", "1 ".repeat(100 << 20));
    sparse("sparse.tum", 1 << 30);
    let letters: Vec<u8> = (0..3_u32 << 20).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    town.write("bytes.tum", letters);
    fs::File::options().append(true).open(town.path("bytes.tum")).unwrap().set_len(1 << 30).unwrap();
    town.write("blank.tum", "#\n\n".repeat(20 << 20));
    let endless = "line 1: longer than 65536 bytes";
    for (run, why) in [
        ("line.txt", endless),
        ("sparse.tum", endless),
        ("/dev/zero", "a device"),
        ("/dev/urandom", "a device"),
        ("bytes.tum", "not text"),
        ("blank.tum", "blank lines and comments"),
    ] {
        for command in [
            format!("score town.mcap -t {run}"),
            format!("info town.mcap -t {run}"),
            format!("convert trajectory {run} --to tum -o new.tum"),
            format!("loops {run} --candidates {run}"),
        ] {
            town.line(format!("[ulimit -v 700000] {command} => 1 {run} | {why}"));
        }
        town.line(format!(
            "[ulimit -v 700000] score town.mcap -t truth.tum --extrinsic calib:{run} => 1 {run}"
        ));
    }
}

/// Scores and exit codes are what they are, whoever reads the messages.
#[test]
fn row_26_messages_that_nobody_takes_change_nothing() {
    let town = Town::new();
    let all = "score town.mcap -t truth.tum -t drift.tum --json";
    let gate = format!("{all} {GATE_THAT_FAILS}");
    let scores = |bytes: &[u8]| super::scores(&serde_json::from_slice(bytes).unwrap());
    let heard = scores(&town.make(all));
    assert_eq!(run(town.root(), "", &gate).status.code(), Some(4));
    let full = || Stdio::from(fs::File::options().write(true).open("/dev/full").unwrap());
    let closed = || Stdio::from(std::io::pipe().unwrap().1);
    let with = |arguments: &str, stdout: Stdio, stderr: Stdio| {
        dmp_command(town.root(), arguments).stdout(stdout).stderr(stderr).output().unwrap()
    };
    for stderr in [full, closed] {
        let unheard = with(all, Stdio::piped(), stderr());
        assert_eq!((unheard.status.code(), scores(&unheard.stdout)), (Some(0), heard.clone()));
        assert_eq!(with(&gate, Stdio::piped(), stderr()).status.code(), Some(4));
    }
    // A reader who has seen enough is no failure; a disk that is full is one.
    assert_eq!(with(all, full(), closed()).status.code(), Some(1));
    assert_eq!(with(all, closed(), closed()).status.code(), Some(0));
    for results in
        ["--help", "score --help", "--version", "info town.mcap", "info town.mcap --json", "man score"]
    {
        let lost = with(results, full(), Stdio::piped());
        let stderr = text(&lost.stderr);
        let is_named =
            stderr.starts_with("error: standard output: cannot write: ") && stderr.lines().count() == 1;
        assert!(lost.status.code() == Some(1) && is_named, "{results}\n{stderr}");
        let read = with(results, closed(), Stdio::piped());
        assert_eq!((read.status.code(), text(&read.stderr).as_str()), (Some(0), ""), "{results}");
    }
    assert_eq!(with("score nowhere.mcap -t truth.tum", Stdio::piped(), closed()).status.code(), Some(2));
}

/// Everything that a command prints: no line of it commands a terminal or a CI server, and none begins with what stands
/// behind an end of line in foreign text.
fn printed(town: &Town, arguments: &str) -> String {
    let output = run(town.root(), "", arguments);
    let printed = text(&output.stdout) + &text(&output.stderr);
    let is_shown = |c: char| {
        let turns = matches!(c, '\u{200b}' | '\u{202e}' | '\u{2060}' | '\u{feff}' | '\u{ad}' | '\u{e0041}');
        !(c.is_control() && c != '\n' && c != '\t' || turns)
    };
    assert!(printed.chars().all(is_shown), "{arguments}\n{printed}");
    let commands = |line: &str| line.trim_start().starts_with("::") || line.contains("##[");
    assert_eq!(printed.lines().find(|line| commands(line)), None, "{arguments}\n{printed}");
    assert!(!printed.lines().any(|line| line.trim_start().starts_with("forged")), "{arguments}\n{printed}");
    printed
}

/// A log with other names of its topic and frame.
fn named_mcap(town: &Town, log: &str, topic: &str, frame: &str) {
    let options =
        McapWriterOptions { topic: topic.into(), frame_id: frame.into(), ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(&town.path(log), &options).unwrap();
    town.scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
}

#[test]
fn row_27_foreign_text_commands_neither_terminals_nor_ci_servers() {
    let town = Town::new();
    // Topics and frames; frames and fields in messages; texts of a saved result; a scan file that is cut; names that begin a line.
    let odd = "/a\u{1b}[2J\n::stop-commands::x\u{202e}\u{9b}";
    named_mcap(&town, "topics.mcap", odd, odd);
    let of_scan = |scan| {
        let mut cloud = Cloud::of(scan);
        cloud.frame_id = "a\nforged\t\u{200b}\u{e0041}";
        cloud.fields.push(("b\nforged", 0, 7));
        cloud
    };
    town.write("fields.mcap", bag(&town.scans.iter().map(of_scan).collect::<Vec<_>>()));
    town.write("seq/000000.bin", [0; 1601]);
    town.write("seq/0\n::stop-commands::x\u{1b}[2J.bin", [0; 1601]);
    let saved = town.make("score town.mcap -t truth.tum -t drift.tum --json --quiet");
    let mut report: Value = serde_json::from_slice(&saved).unwrap();
    let text_of_others = "b\n::stop-commands::x\n##[group]\nforged\u{feff}\u{ad}";
    report["warnings"] = json!([text_of_others]);
    report["left_out"] = json!([{ "name": text_of_others, "reason": text_of_others }]);
    report["inputs"]["dropped"][text_of_others] = 1.into();
    report["inputs"]["runs"][0]["map_notes"] = json!([text_of_others]);
    report["runs"][0]["r_cv_withheld"] = text_of_others.into();
    report["pairs"][0]["reason"] = text_of_others.into();
    town.write("odd.json", report.to_string());
    town.write("named.json", text(&saved).replace("\"truth\"", "\"tr\\u001b[2Juth\""));
    for (from, to) in [
        ("drift.tum", "::warning::a.tum"),
        ("drift.tum", "##[error]b.tum"),
        ("town.mcap", "::add-mask::c.mcap"),
    ] {
        fs::copy(town.path(from), town.path(to)).unwrap();
    }
    town.scans("::group::d", town.scans, FolderFormat::Bin);
    let runs = "-t ::warning::a.tum -t ##[error]b.tum -t ::e=truth.tum";
    for (arguments, expected) in [
        ("info topics.mcap", r"\u001b[2J\u000a::stop-commands::x\u202e\u009b"),
        ("info topics.mcap --json", ""),
        ("score topics.mcap -t truth.tum -t drift.tum --verbose", ""),
        ("score topics.mcap --topic /none -t truth.tum", ""),
        ("info fields.mcap", r"a\u000aforged\u0009\u200b\udb40\udc41"),
        ("info fields.mcap", r"b\u000aforged (float32, not used)"),
        ("score fields.mcap -t truth.tum -t drift.tum --verbose", ""),
        ("calibrate fields.mcap -t truth.tum", ""),
        ("info seq", ""),
        ("score seq -t truth.tum", ""),
        ("convert log seq -o new.mcap", ""),
        ("compare odd.json -v", r"b\u000a::stop-commands::x\u000a\u0023#[group]\u000aforged\ufeff\u00ad"),
        ("compare odd.json --json", ""),
        ("compare named.json", r"tr\u001b[2Juth"),
        (&format!("score ::add-mask::c.mcap {runs} --verbose"), ""),
        ("map build ::add-mask::c.mcap -t ::e=truth.tum -o ::e.dmpmap", ""),
        (&format!("score ::add-mask::c.mcap {runs} --json {GATE_THAT_FAILS}"), ""),
        (&format!("calibrate ::add-mask::c.mcap {runs}"), ""),
        (&format!("info ::add-mask::c.mcap {runs}"), ""),
        ("info ::group::d", r"\u003a:group::d"),
        ("map info ::e.dmpmap", ""),
        ("map verify ::e.dmpmap", ""),
        ("convert trajectory truth.tum --to kitti -o ::f.txt", ""),
        ("convert log ::group::d -o ::f.mcap", ""),
        ("truth smd truth.ply ::g.ply", ""),
        ("compare ::nowhere.json", ""),
        ("loops ::nowhere.g2o --candidates ##[error]nowhere.g2o", ""),
        ("man -o ::man", ""),
        ("##[error]no-command", ""),
        ("score ::add-mask::c.mcap -t truth.tum --memory ##[error]much", ""),
    ] {
        let printed = printed(&town, arguments);
        assert!(printed.contains(expected), "{arguments}: no {expected} in\n{printed}");
    }
    let frame = &serde_json::from_slice::<Value>(&town.make("info fields.mcap --json")).unwrap()["streams"]
        [0]["scans"];
    assert_eq!(frame["frame_id"], "a\nforged\t\u{200b}\u{e0041}");
    let named = dmp_command(town.root(), "score town.mcap -t")
        .arg("a\n::stop-commands::x=truth.tum")
        .output()
        .unwrap();
    assert_eq!((named.status.code(), text(&named.stderr).lines().count()), (Some(2), 1));
}

/// Names as long as a format allows, and names by the thousand.
#[test]
fn row_27_long_and_many_names_are_cut() {
    let town = Town::new();
    let long = format!("/{}", "n".repeat(65_535));
    named_mcap(&town, "long.mcap", &long, "lidar");
    assert!(text(&town.make("info long.mcap")).contains("(65536 characters)"));
    let saved = text(&town.make("score town.mcap -t truth.tum -t drift.tum --json --quiet"));
    town.write("a.json", &saved);
    town.write("long.json", saved.replace("\"truth\"", &format!("\"{}\"", &long[1..])));
    for arguments in ["compare long.json", "compare a.json long.json"] {
        let output = run(town.root(), "", arguments);
        assert!(output.status.code().is_some_and(|code| code != 101), "{}", text(&output.stderr));
    }
    let clouds: Vec<Vec<u8>> = town.scans.iter().map(|scan| message_record(&Cloud::of(scan))).collect();
    town.write("frames.mcap", bag_of_records(&[static_frames(20_000), clouds.concat()].concat()));
    let topic = format!("--topic /{}", "n".repeat(60_000));
    for (log, options, most_bytes, words) in [
        ("frames.mcap", "", 1000, "one of 19992 more"),
        ("frames.mcap", "--extrinsic frame:none", 1000, "one of 19992 more"),
        ("town.mcap", &topic, 5000, " bytes)"),
    ] {
        let stderr =
            text(&run(town.root(), "", &format!("score {log} -t truth.tum {options} --quiet")).stderr);
        assert!(stderr.len() < most_bytes && stderr.contains(words), "{stderr}");
    }
}

/// What is given by a path from the root is named by its last part: results of others do not name folders.
#[test]
fn row_30_results_hold_no_paths_from_the_root() {
    let town = Town::new();
    let root = town.root().canonicalize().unwrap().to_str().unwrap().to_owned();
    let printed = |arguments: &str| {
        let printed = text(&town.make(&arguments.replace("ROOT", &root)));
        assert!(!printed.contains(&root), "{arguments}\n{printed}");
        printed
    };
    let json = |arguments: &str| serde_json::from_str::<Value>(&printed(arguments)).unwrap();
    let score = "score ROOT/town.mcap -t ROOT/truth.tum -t ROOT/drift.tum --json --quiet";
    let report = json(&format!("{score} --report ROOT/r.html"));
    town.make("map build town.mcap -t truth.tum -o truth.dmpmap --quiet");
    assert_eq!(report["inputs"]["log"], "town.mcap");
    assert_eq!(report["inputs"]["runs"][0]["file"], "truth.tum");
    town.write("saved.json", report.to_string());
    assert_eq!(json("compare ROOT/saved.json --json")["results"][0]["file"], "saved.json");
    let relative = json("score town.mcap -t ./truth.tum -t drift.tum --json --quiet");
    assert_eq!(relative["inputs"]["runs"][0]["file"], "./truth.tum");
    let name = town.root().file_name().unwrap().to_str().unwrap();
    assert_eq!(json(&format!("info ../{name}/town.mcap --json"))["log"], "town.mcap");
    // Times that are not understood: a problem names the log too.
    let own = |_: i64, ns: i64| (ns as f64 / 1e9 + 700.0).to_le_bytes().to_vec();
    timed(&town, "own", town.scans, &[("time", 'F', 8, &own)]);
    let info = json("info ROOT/own --json");
    let problem = info["streams"][0]["problem"].as_str().unwrap();
    assert!(problem.starts_with("own: point time"), "{problem}");
    town.make("map export truth.dmpmap -o truth.ply --quiet");
    for arguments in [
        &format!("{score} --map truth=ROOT/truth.dmpmap"),
        "info ROOT/town.mcap -t ROOT/truth.tum --json",
        "map info ROOT/truth.dmpmap --json",
        "map info ROOT/truth.dmpmap",
        "truth ape ROOT/truth.tum ROOT/drift.tum --json",
        "truth smd ROOT/truth.ply ROOT/truth.dmpmap --json --quiet",
        "calibrate ROOT/town.mcap -t ROOT/truth.tum --json --quiet",
        "drift ROOT/town.mcap -t ROOT/truth.tum --json --quiet",
    ] {
        printed(arguments);
    }
    for file in ["r.html", "truth.dmpmap"] {
        let bytes = town.read(file);
        assert!(!bytes.windows(root.len()).any(|part| part == root.as_bytes()), "{file}");
    }
}
