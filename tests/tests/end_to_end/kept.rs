//! `dmp score --keep` and `dmp compare`: runs that were scored on different days are judged as if they had been scored together.

use std::fs;
use std::path::Path;

use dmp_log::{KeptPart, KeptReader, KeptWriter};
use serde_json::{Value, json};

use crate::common::{dmp, refused, text, write};

fn done(folder: &Path, arguments: &str) -> Value {
    let output = dmp(folder, &format!("{arguments} --json --quiet"));
    assert_eq!(output.status.code(), Some(0), "{arguments}\n{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Scores these runs of a log apart, the first as `options` say and the others like it, and together; compares what was kept and
/// asserts that it is what comes of scoring them together.
fn apart_is_together(folder: &Path, log: &str, runs: &[&str], options: &str) {
    for (k, run) in runs.iter().enumerate() {
        let like = if k == 0 { options } else { "--like 0.dmp" };
        done(folder, &format!("score {log} {run} {like} --keep {k}.dmp"));
    }
    let together = done(folder, &format!("score {log} {} --like 0.dmp --keep all.dmp", runs.join(" ")));
    let files: Vec<String> = (0..runs.len()).map(|k| format!("{k}.dmp")).collect();
    let apart = done(folder, &format!("compare {} --threads 2", files.join(" ")));
    assert_alike(&apart, &together);
    // Of one file, of files in another order, with one thread.
    assert_alike(&done(folder, "compare all.dmp"), &together);
    let files: Vec<String> = files.into_iter().rev().collect();
    let backwards = done(folder, &format!("compare {} --threads 1", files.join(" ")));
    assert_eq!((&backwards["order"], &backwards["promise"]), (&apart["order"], &apart["promise"]));
    assert_eq!(backwards["not_compared"], json!([]));
}

/// The runs and verdicts are the same, and the numbers of pairs but for what rounding does.
fn assert_alike(apart: &Value, together: &Value) {
    for field in ["runs", "order", "ties", "promise", "config", "sampling"] {
        assert_eq!(apart[field], together[field], "{field}");
    }
    assert_eq!(apart["not_compared"], json!([]));
    let [of_apart, of_together] = [apart, together].map(|json| json["pairs"].as_array().unwrap());
    assert_eq!(of_apart.len(), of_together.len());
    for (a, b) in of_apart.iter().zip(of_together) {
        for field in ["a", "b", "score", "verdict", "decided_at_m", "is_same", "reason", "llr_raw"] {
            assert_eq!(a[field], b[field], "{field}");
        }
        for (a, b) in a["scales"].as_array().unwrap().iter().zip(b["scales"].as_array().unwrap()) {
            assert_eq!((&a["scale_m"], &a["returns"]), (&b["scale_m"], &b["returns"]));
            let mean_m2 = b["mean_a_m2"].as_f64().unwrap();
            let near = |a: &Value, b: &Value| {
                let [a, b] = [a, b].map(|value| value.as_f64().unwrap());
                (a - b).abs() < 1e-4 * mean_m2.max(b.abs())
            };
            for field in ["mean_a_m2", "mean_b_m2", "difference_m2"] {
                assert!(near(&a[field], &b[field]), "{field}: {} {}", a[field], b[field]);
            }
            for end in 0..2 {
                let (a, b) = (&a["interval_m2"][end], &b["interval_m2"][end]);
                assert!(near(a, b), "interval: {a} {b}");
            }
        }
    }
}

#[test]
fn runs_scored_apart_are_judged_as_if_scored_together() {
    let folder = tempfile::tempdir().unwrap();
    let runs = ["-t @/truth.tum", "-t @/drift.tum", "-t @/noise.tum", "-t @/collapsed.tum"];
    apart_is_together(folder.path(), "@/town.mcap", &runs, "");
}

#[test]
fn a_sample_and_given_maps_are_judged_so_too() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    apart_is_together(folder, "@/town.mcap", &["-t @/truth.tum", "-t @/noise.tum"], "--sample 40 --every 2");
    let map = dmp(folder, "map build @/town.mcap -t @/truth.tum -o town.dmpmap -q");
    assert_eq!(map.status.code(), Some(0), "{}", text(&map.stderr));
    let given = ["-t @/truth.tum --map town.dmpmap", "-t @/noise.tum --map town.dmpmap"];
    for (k, run) in given.iter().enumerate() {
        let like = if k == 0 { "" } else { "--like 0.dmp" };
        done(folder, &format!("score @/town.mcap {run} {like} --keep {k}.dmp"));
    }
    let runs = "-t @/truth.tum -t @/noise.tum --map town.dmpmap";
    let together = done(folder, &format!("score @/town.mcap {runs} --like 0.dmp"));
    assert_alike(&done(folder, "compare 0.dmp 1.dmp"), &together);
    // Runs that are judged by different scores have no returns in common that could be told of.
    done(folder, "score @/town.mcap -t fused=@/noise.tum --like 0.dmp --keep fused.dmp");
    let mixed = done(folder, "compare 0.dmp 1.dmp fused.dmp");
    assert_eq!(mixed["not_compared"].as_array().unwrap().len(), 2);
    assert_eq!(mixed["pairs"].as_array().unwrap().len(), 1);
}

#[test]
fn a_room_is_judged_so_too() {
    let folder = tempfile::tempdir().unwrap();
    let made = dmp(folder.path(), "simulate room -o room --size 80x60 --frames 40 --rate 2 -q");
    assert_eq!(made.status.code(), Some(0), "{}", text(&made.stderr));
    let runs = ["good", "odometry", "off"].map(|name| format!("-t room/estimates/{name}.txt"));
    let runs: Vec<&str> = runs.iter().map(String::as_str).collect();
    apart_is_together(folder.path(), "room", &runs, "");
}

/// The null beside the power: the same run under another name is told apart at no scale.
#[test]
fn equal_runs_scored_apart_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    done(folder, "score @/town.mcap -t a=@/truth.tum --keep a.dmp");
    done(folder, "score @/town.mcap -t b=@/truth.tum --like a.dmp --keep b.dmp");
    let compared = done(folder, "compare a.dmp b.dmp");
    let pair = &compared["pairs"][0];
    assert_eq!(pair["verdict"], "same");
    for scale in pair["scales"].as_array().unwrap() {
        assert_eq!(scale["difference_m2"], 0.0);
    }
}

#[test]
fn results_without_returns_stand_beside_those_with() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    done(folder, "score @/town.mcap -t @/truth.tum --keep truth.dmp");
    done(folder, "score @/town.mcap -t @/drift.tum --like truth.dmp --keep drift.dmp");
    let noise = done(folder, "score @/town.mcap -t @/noise.tum --like truth.dmp");
    write(folder, "noise.json", &noise.to_string());
    let compared = done(folder, "compare truth.dmp drift.dmp noise.json");
    assert_eq!(compared["pairs"].as_array().unwrap().len(), 1);
    assert_eq!(compared["pairs"][0]["verdict"], "truth");
    assert_eq!(compared["not_compared"], json!([["truth", "noise"], ["noise", "drift"]]));
    let told = text(&dmp(folder, "compare truth.dmp drift.dmp noise.json").stdout);
    assert!(told.contains("To compare them, keep both results with `dmp score --keep`,"), "{told}");
    // One promise for all that is told. With pairs of another result there are two.
    assert!(told.contains("At most 1 % of commands tell any two equal runs apart"), "{told}");
    let two = done(folder, "score @/town.mcap -t @/truth.tum -t @/noise.tum --like truth.dmp");
    write(folder, "two.json", &two.to_string());
    let compared = done(folder, "compare truth.dmp drift.dmp two.json");
    assert_eq!(
        (compared["pairs"].as_array().unwrap().len(), &compared["promise"]["of_each_result"]),
        (2, &json!(true))
    );
    let told = text(&dmp(folder, "compare truth.dmp drift.dmp two.json").stdout);
    assert!(told.contains("At most 1 % of results tell any two equal runs apart, each by itself"), "{told}");
    let gate = dmp(folder, "compare truth.dmp drift.dmp --expect-best truth");
    assert_eq!(gate.status.code(), Some(0), "{}", text(&gate.stderr));
}

#[test]
fn what_cannot_be_kept_is_refused_before_the_log_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let score = "score @/town.mcap -t @/truth.tum -t @/noise.tum";
    refused(folder, &format!("{score} --keep a.json"), 2, &["a.json: a result is kept as .dmp"]);
    refused(folder, &format!("{score} --keep none/a.dmp"), 2, &["there is no folder none"]);
    refused(folder, &format!("{score} --keep a.dmp --map truth=@/town.mcap"), 2, &["a.dmp", "two commands"]);
    for option in ["--decide", "--quick"] {
        let output = dmp(folder, &format!("{score} --keep a.dmp {option}"));
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains("--keep"), "{}", text(&output.stderr));
    }
    refused(folder, "shard plan @/town.mcap -t @/truth.tum -o plan --keep a.dmp", 2, &["--keep in parts"]);
    assert!(!folder.join("a.dmp").exists());
}

#[test]
fn row_32_results_that_are_not_what_was_kept_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    done(folder, "score @/town.mcap -t @/truth.tum --keep a.dmp");
    done(folder, "score @/town.mcap -t @/noise.tum --like a.dmp --keep b.dmp");
    let whole = fs::read(folder.join("b.dmp")).unwrap();
    let middle = whole.len() / 2;
    fs::write(folder.join("cut.dmp"), &whole[..middle]).unwrap();
    refused(folder, "compare a.dmp cut.dmp", 1, &["cut.dmp: message "]);
    let mut flipped = whole.clone();
    flipped[middle] ^= 1;
    fs::write(folder.join("flipped.dmp"), flipped).unwrap();
    refused(folder, "compare a.dmp flipped.dmp", 1, &["flipped.dmp: message "]);
    fs::write(folder.join("head.dmp"), &whole[..40]).unwrap();
    refused(folder, "compare a.dmp head.dmp", 1, &["head.dmp: message 0: "]);
    refused(folder, "compare a.dmp @/town.mcap", 1, &["town.mcap", "no result of `dmp score --keep`"]);
    done(folder, "score @/town.mcap -t @/noise.tum --voxel 0.5 --keep other.dmp");
    refused(folder, "compare a.dmp other.dmp", 1, &["`dmp score --like a.dmp`"]);
    // Of a log that nobody may read on the way the file of before stays.
    let before = fs::read(folder.join("a.dmp")).unwrap();
    refused(folder, "score @/town.mcap -t @/truth.tum --max-range 0.01 --min-range 0 --keep a.dmp", 1, &[]);
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
            writer.scan([read.ordinal, read.scan, read.mark], 0, &[returns]).unwrap();
        }
    }
    writer.finish().unwrap();
}

#[test]
fn row_32_forged_results_are_refused_and_take_no_memory() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    done(folder, "score @/town.mcap -t @/truth.tum --keep a.dmp");
    done(folder, "score @/town.mcap -t @/noise.tum --like a.dmp --keep b.dmp");
    let as_it_is = |_: &mut Value| {};
    let (all, scans) = (&|_: &mut KeptPart| true, 100);
    forged(folder, ["b.dmp", "c.dmp"], &as_it_is, all);
    assert_eq!(done(folder, "compare a.dmp c.dmp")["not_compared"], json!([]));
    let refused_with = |part: &dyn Fn(&mut KeptPart) -> bool, words: &str| {
        forged(folder, ["b.dmp", "c.dmp"], &as_it_is, part);
        refused(folder, "compare a.dmp c.dmp", 1, &["c.dmp: ", words]);
    };
    refused_with(&|part| part.scan + 1 < scans, "ends before scan 99, which others hold");
    refused_with(&|part| part.scan > 0, "returns of scan 1, the 2. of all, where others hold ");
    refused_with(
        &|part| {
            part.mark ^= u64::from(part.scan == 7);
            true
        },
        "holds other returns of scan 7 than others do",
    );
    refused_with(
        &|part| {
            part.returns.truncate(2);
            true
        },
        "holds 2 returns of scan 0, the 1. of all, where others hold ",
    );
    // What both claim alike.
    let both = |json: &dyn Fn(&mut Value), part: &dyn Fn(&mut KeptPart) -> bool, words: &str| {
        for [from, to] in [["a.dmp", "x.dmp"], ["b.dmp", "y.dmp"]] {
            forged(folder, [from, to], json, part);
        }
        refused(folder, "compare x.dmp y.dmp", 1, &["x.dmp: ", words]);
    };
    both(
        &|json| json["sampling"]["frames_total"] = (1_u64 << 62).into(),
        all,
        "4,611,686,018,427,387,904 scans",
    );
    both(
        &|json| json["sampling"]["frames_scored"] = 1_000_000_000_000_u64.into(),
        all,
        "1,000,000,000,000 of 100 scans",
    );
    both(&|json| json["inputs"]["returns_used"] = 1_000.into(), all, "its result tells of 1,000 of 100");
    both(&|json| json["sampling"]["looks"] = json!([28, 100]), all, "made with --decide");
    both(&|_| {}, &|part| part.scan < 50, "its result tells of 309,402 of 100");
    both(
        &|_| {},
        &|part| {
            part.ordinal |= 1 << 50;
            true
        },
        "of 100",
    );
    both(
        &|_| {},
        &|part| {
            part.ordinal = 3;
            true
        },
        "scan 1 goes on with return 0 behind ",
    );
}
