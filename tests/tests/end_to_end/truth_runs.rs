//! `dmp truth ape|rpe` of several runs, and of files of other units and columns. `pages.rs` looks at their plots.

use std::fmt::Write as _;
use std::fs;

use crate::common::{done, ends, has, json, refused, sample, text, write};

const RUNS: &str = "@/truth.tum @/drift.tum @/noise.tum @/collapsed.tum";

/// The lines of the sample's drift, numbers apart.
fn drift() -> Vec<Vec<String>> {
    let all = fs::read_to_string(sample("drift.tum")).unwrap();
    let rows = all.lines().filter(|line| !line.starts_with('#'));
    rows.map(|line| line.split_whitespace().map(str::to_owned).collect()).collect()
}

#[test]
fn several_runs_stand_side_by_side() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let all = json(path, &format!("truth ape {RUNS} -a"));
    assert_eq!(all["schema"], "dmp-truth-runs/1");
    let runs = all["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 3);
    for (run, name) in runs.iter().zip(["drift", "noise", "collapsed"]) {
        assert_eq!(*run, json(path, &format!("truth ape @/truth.tum @/{name}.tum -a")));
    }
    let rmse = format!("{:.6}", runs[0]["stats"]["rmse"].as_f64().unwrap());
    has(
        &done(path, &format!("truth ape {RUNS} -a")),
        &["APE w.r.t. translation part (m)", "drift.tum", &rmse],
    );
}

#[test]
fn each_estimate_has_a_result_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let save =
        |runs: &str, code: i32| text(&ends(path, &format!("truth ape @/truth.tum {runs}"), code).stderr);
    save("@/drift.tum --save_results one.zip", 0);
    save("@/drift.tum @/noise.tum --save_results all.zip", 0);
    assert!(!path.join("all.zip").exists() && path.join("all.noise.zip").exists());
    assert_eq!(fs::read(path.join("all.drift.zip")).unwrap(), fs::read(path.join("one.zip")).unwrap());
    has(&save("@/drift.tum @/collapsed.tum --save_results all.zip", 2), &["all.drift.zip: the file exists"]);
    assert!(!path.join("all.collapsed.zip").exists());
    // Of one name, in several folders.
    for run in ["a", "b"] {
        fs::create_dir(path.join(run)).unwrap();
        fs::copy(sample("drift.tum"), path.join(run).join("run.tum")).unwrap();
    }
    save("a/run.tum b/run.tum --save_results two.zip", 0);
    assert!(path.join("two.a_run.zip").exists() && path.join("two.b_run.zip").exists());
    save("a/run.tum a/run.tum --save_results same.zip", 2);
}

#[test]
fn plots_that_cannot_be_written_are_refused_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let truth = "truth ape no-such.tum none.tum";
    refused(
        folder.path(),
        &format!("{truth} --plot a.pdf"),
        2,
        &["a.pdf", "plots are written as .html or .svg"],
    );
    refused(folder.path(), &format!("{truth} --plot no/a.html"), 2, &["no/a.html", "there is no folder no"]);
    fs::copy(sample("drift.tum"), folder.path().join("run.svg")).unwrap();
    refused(folder.path(), "truth ape @/truth.tum run.svg --plot run.svg", 2, &["run.svg"]);
    assert_eq!(fs::read(folder.path().join("run.svg")).unwrap(), fs::read(sample("drift.tum")).unwrap());
}

#[test]
fn files_of_other_units_and_columns_have_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let expected = json(folder.path(), "truth ape @/truth.tum @/drift.tum -a")["stats"].clone();
    let rows = drift();
    let ns = |stamp: &str| {
        let (seconds, decimals) = stamp.split_once('.').unwrap_or((stamp, ""));
        format!("{seconds}{decimals:0<9}").trim_start_matches('0').to_owned()
    };
    let file = |name: &str, head: &str, line: &dyn Fn(&[String]) -> String| {
        let mut all = head.to_owned();
        rows.iter().for_each(|row| writeln!(all, "{}", line(row)).unwrap());
        write(folder.path(), name, &all);
    };
    file("named.csv", "qw,qz,qy,qx,z,y,x,time_s\n", &|row| {
        row.iter().rev().map(String::as_str).collect::<Vec<_>>().join(",")
    });
    file("ns.csv", "stamp_ns;tx;ty;tz;qx;qy;qz;qw\n", &|row| {
        format!("{};{}", ns(&row[0]), row[1..].join(";"))
    });
    file("bare.tum", "", &|row| format!("{} {}", ns(&row[0]), row[1..].join(" ")));
    let start_ns = 1_699_999_999_000_000_000_i64;
    file("clock.tum", "", &|row| {
        format!("{} {}", ns(&row[0]).parse::<i64>().unwrap() - start_ns, row[1..].join(" "))
    });
    for run in ["named.csv", "ns.csv", "bare.tum", "clock.tum --time_unit ns --t_offset 1699999999"] {
        let report = json(folder.path(), &format!("truth ape @/truth.tum {run} -a"));
        for (name, value) in expected.as_object().unwrap() {
            let (found, value) = (report["stats"][name].as_f64().unwrap(), value.as_f64().unwrap());
            assert!((found - value).abs() <= 1e-9 * value.abs().max(1.0), "{run} {name}: {found} {value}");
        }
    }
    let notes = json(folder.path(), "truth ape @/truth.tum ns.csv")["notes"].to_string();
    has(&notes, &["ns.csv: columns by the names in line 1: stamp_ns, tx"]);
    // A clock that begins with the drive.
    let refusal =
        ["clock.tum: line 1: stamps from 937500000 to ", "the time unit must be given (s, ms, us or ns)"];
    refused(folder.path(), "truth ape @/truth.tum clock.tum", 1, &refusal);
    refused(folder.path(), "score @/town.mcap -t clock.tum", 1, &refusal);
    write(folder.path(), "places.csv", "time,x,y,z\n0,1,2,3\n");
    let refusal = ["places.csv: places without rotations", "of translations only"];
    refused(folder.path(), "truth ape @/truth.tum places.csv -r full", 2, &refusal);
    refused(folder.path(), "truth rpe @/truth.tum places.csv", 2, &refusal);
    refused(folder.path(), "truth ape @/truth.tum places.csv --align_origin", 2, &refusal);
    // Of places alone the error is that of the poses.
    file("rtk.csv", "", &|row| row[..4].join(","));
    let report = json(folder.path(), "truth ape @/truth.tum rtk.csv -a");
    let poses = json(folder.path(), "truth ape @/truth.tum @/drift.tum -a");
    let [a, b] = [&report, &poses].map(|report| report["stats"]["rmse"].as_f64().unwrap());
    assert!((a - b).abs() < 1e-9, "{a} {b}");
    has(&report["notes"].to_string(), &["rtk.csv: ", "rotations are not compared"]);
}
