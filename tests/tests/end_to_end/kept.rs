//! `dmp score --keep` and `dmp compare`: runs that were scored on different days are judged as if they had been scored together.

use std::fs;
use std::path::Path;

use dmp_log::{KeptPart, KeptReader, KeptWriter};
use serde_json::{Value, json};

use crate::common::{SCORE, TWO, done, json as scored, misused, once, refused, write};

/// A result of the truth is `a.dmp`, and that of another run `b.dmp`.
fn two_kept(folder: &Path, other: &str) {
    for (run, file) in [("@/truth.tum", "a.dmp"), (other, "b.dmp")] {
        once(&format!("{SCORE} --every 3 -t {run} --json --quiet --keep {file}")).copy(file, folder);
    }
}

/// Scores these runs of a log apart and together; compares what was kept and asserts that it is what comes of scoring them
/// together, to the bit.
fn apart_is_together(folder: &Path, log: &str, runs: &[&str], options: &str) {
    let score = format!("score {log} --trust --drift=none {options}");
    for (k, run) in runs.iter().enumerate() {
        scored(folder, &format!("{score} {run} --keep {k}.dmp"));
    }
    let together = scored(folder, &format!("{score} {} --keep all.dmp", runs.join(" ")));
    let files: Vec<String> = (0..runs.len()).map(|k| format!("{k}.dmp")).collect();
    let apart = scored(folder, &format!("compare {} --threads 2", files.join(" ")));
    assert_alike(&apart, &together);
    // Of one file, of files in another order, with one thread.
    assert_alike(&scored(folder, "compare all.dmp"), &together);
    let files: Vec<String> = files.into_iter().rev().collect();
    let backwards = scored(folder, &format!("compare {} --threads 1", files.join(" ")));
    assert_eq!((&backwards["order"], &backwards["promise"]), (&apart["order"], &apart["promise"]));
    assert_eq!(backwards["not_compared"], json!([]));
}

fn assert_alike(apart: &Value, together: &Value) {
    for field in ["runs", "order", "ties", "pairs", "promise", "config", "sampling"] {
        assert_eq!(apart[field], together[field], "{field}");
    }
    assert_eq!(apart["inputs"]["runs"], together["inputs"]["runs"]);
    assert_eq!(apart["not_compared"], json!([]));
}

#[test]
fn runs_scored_apart_are_judged_as_if_scored_together() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    apart_is_together(
        folder,
        "@/town.mcap",
        &["-t @/truth.tum", "-t @/drift.tum", "-t @/noise.tum"],
        "--every 3",
    );
    apart_is_together(
        folder,
        "@/town.mcap",
        &["-t @/truth.tum", "-t @/noise.tum"],
        "--every 2 --returns 1/2",
    );
    let room = once("simulate room -o room --size 80x60 --frames 40 --rate 2 -q").folder.join("room");
    let room = room.display();
    let runs = ["good", "off"].map(|name| format!("-t {room}/estimates/{name}.txt"));
    apart_is_together(folder, &room.to_string(), &runs.each_ref().map(String::as_str), "");
}

#[test]
fn given_maps_are_judged_so_too_and_not_beside_fused_ones() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    once(crate::map_command::BUILD).copy("truth.dmpmap", folder);
    for (k, run) in ["truth", "noise"].into_iter().enumerate() {
        let score = format!("{SCORE} --every 3 -t @/{run}.tum --map truth.dmpmap --keep {k}.dmp");
        scored(folder, &score);
    }
    let runs = "-t @/truth.tum -t @/noise.tum --map truth.dmpmap";
    let together = scored(folder, &format!("{SCORE} --every 3 {runs}"));
    assert_alike(&scored(folder, "compare 0.dmp 1.dmp"), &together);
    let voxel = together["config"]["voxel_m"].as_f64().unwrap();
    scored(folder, &format!("{SCORE} --every 3 -t fused=@/noise.tum --voxel {voxel} --keep fused.dmp"));
    let mixed = scored(folder, "compare 0.dmp 1.dmp fused.dmp");
    assert_eq!(mixed["not_compared"].as_array().unwrap().len(), 2);
    assert_eq!(mixed["pairs"].as_array().unwrap().len(), 1);
}

/// The null beside the power: the same run under another name differs at no scale.
#[test]
fn equal_runs_scored_apart_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    two_kept(folder, "b=@/truth.tum");
    let compared = scored(folder, "compare a.dmp b.dmp");
    let pair = &compared["pairs"][0];
    assert_eq!(pair["verdict"], "same");
    assert!(pair["scales"].as_array().unwrap().iter().all(|scale| scale["difference_m2"] == 0.0), "{pair}");
}

#[test]
fn results_without_returns_stand_beside_those_with() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    two_kept(folder, "@/drift.tum");
    let noise = scored(folder, &format!("{SCORE} --every 3 -t @/noise.tum"));
    write(folder, "noise.json", &noise.to_string());
    let compared = scored(folder, "compare a.dmp b.dmp noise.json");
    assert_eq!(compared["pairs"].as_array().unwrap().len(), 1);
    assert_eq!(compared["pairs"][0]["verdict"], "truth");
    assert_eq!(compared["not_compared"], json!([["truth", "noise"], ["noise", "drift"]]));
    assert!(compared["promise"]["of_each_result"].is_null());
    // With pairs of another result each result has its own rate of error.
    let two = scored(folder, &format!("{SCORE} --every 3 -t @/truth.tum -t @/noise.tum"));
    write(folder, "two.json", &two.to_string());
    let compared = scored(folder, "compare a.dmp b.dmp two.json");
    assert_eq!(compared["pairs"].as_array().unwrap().len(), 2);
    assert_eq!(compared["promise"]["of_each_result"], json!(true));
    done(folder, "compare a.dmp b.dmp --expect best:truth");
}

#[test]
fn what_cannot_be_kept_is_refused_before_the_log_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    refused(folder, &format!("{TWO} --keep a.json"), 2, &["a.json: a result is written as .dmp"]);
    refused(folder, &format!("{TWO} --keep none/a.dmp"), 2, &["there is no folder none"]);
    refused(folder, &format!("{TWO} --keep a.dmp --map truth=@/town.mcap"), 2, &["a.dmp", "two commands"]);
    misused(folder, &format!("{TWO} --keep a.dmp --quick"), &["--keep"]);
    assert!(!folder.join("a.dmp").exists());
}

#[test]
fn row_32_damaged_and_foreign_results_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    two_kept(folder, "@/noise.tum");
    let whole = fs::read(folder.join("b.dmp")).unwrap();
    let middle = whole.len() / 2;
    let mut flipped = whole.clone();
    flipped[middle] ^= 1;
    for (bytes, words) in [
        (&whole[..middle], "bad.dmp: message "),
        (&flipped[..], "bad.dmp: message "),
        (&whole[..40], "bad.dmp: message 0: "),
    ] {
        fs::write(folder.join("bad.dmp"), bytes).unwrap();
        refused(folder, "compare a.dmp bad.dmp", 1, &[words]);
    }
    refused(folder, "compare a.dmp @/town.mcap", 1, &["town.mcap", "no result of `dmp score --keep`"]);
    scored(folder, &format!("{SCORE} -t @/noise.tum --every 2 --keep other.dmp"));
    refused(folder, "compare a.dmp other.dmp", 1, &["frames: config.every is 3 and 2", "settings of a.dmp"]);
    // Where the score fails the file of before stays.
    let before = fs::read(folder.join("a.dmp")).unwrap();
    refused(folder, &format!("{SCORE} -t @/truth.tum --max-range 0.01 --min-range 0 --keep a.dmp"), 1, &[]);
    assert_eq!(fs::read(folder.join("a.dmp")).unwrap(), before);
}

/// Writes the kept result `from` again as `to`, with what these make of its JSON and of its parts.
fn forged(
    folder: &Path,
    [from, to]: [&str; 2],
    json: &dyn Fn(&mut Value),
    part: &dyn Fn(&mut KeptPart) -> bool,
) {
    let (mut reader, result) = KeptReader::open(&folder.join(from)).unwrap();
    let mut result: Value = serde_json::from_slice(&result).unwrap();
    json(&mut result);
    let name = result["runs"][0]["name"].as_str().unwrap().to_owned();
    let result = serde_json::to_vec(&result).unwrap();
    let mut writer = KeptWriter::create(&folder.join(to), &result, &[&name]).unwrap();
    let mut read = KeptPart::default();
    while reader.next_part(&mut read).unwrap().is_some() {
        if part(&mut read) {
            let returns = std::mem::take(&mut read.returns);
            writer.scan([read.ordinal, read.scan, read.mark], 0, (&[read.pose], &[returns])).unwrap();
        }
    }
    writer.finish().unwrap();
}

#[test]
fn row_32_forged_results_are_refused_and_take_no_memory() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    two_kept(folder, "@/noise.tum");
    type OfJson<'a> = &'a dyn Fn(&mut Value);
    type OfPart<'a> = &'a dyn Fn(&mut KeptPart) -> bool;
    let (as_is, all): (OfJson<'_>, OfPart<'_>) = (&|_| {}, &|_| true);
    forged(folder, ["b.dmp", "c.dmp"], as_is, all);
    assert_eq!(scored(folder, "compare a.dmp c.dmp")["not_compared"], json!([]));
    let of_parts: [(OfPart<'_>, &str); 4] = [
        (&|part| part.scan < 99, " of 34"),
        (&|part| part.scan > 0, " of 34"),
        (
            &|part| {
                part.mark ^= u64::from(part.scan == 9);
                true
            },
            "its returns of scan 9 differ from the other results",
        ),
        (
            &|part| {
                part.returns.truncate(2);
                true
            },
            "holds 2 returns of scan 0, the 1. of all, where others hold ",
        ),
    ];
    for (part, words) in of_parts {
        forged(folder, ["b.dmp", "c.dmp"], as_is, part);
        refused(folder, "compare a.dmp c.dmp", 1, &["c.dmp: ", words]);
    }
    // What both claim alike.
    let both: [(OfJson<'_>, OfPart<'_>, &str); 4] = [
        (
            &|json| json["sampling"]["frames_scored"] = (1_u64 << 62).into(),
            all,
            "4,611,686,018,427,387,904 scans",
        ),
        (&|json| json["inputs"]["returns_used"] = 1_000.into(), all, " 1,000 of 34"),
        (as_is, &|part| part.scan < 50, " of 34"),
        (
            as_is,
            &|part| {
                part.ordinal = 3;
                true
            },
            "scan 3 continues with return 0 after ",
        ),
    ];
    for (json, part, words) in both {
        for [from, to] in [["a.dmp", "x.dmp"], ["b.dmp", "y.dmp"]] {
            forged(folder, [from, to], json, part);
        }
        refused(folder, "compare x.dmp y.dmp", 1, &["x.dmp: ", words]);
    }
}
