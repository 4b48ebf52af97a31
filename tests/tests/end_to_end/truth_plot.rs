//! `dmp truth ape|rpe --plot`: several runs beside ground truth, as a page and as a picture; files of other units and columns.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::browser::{Browser, Theme, pixels};
use crate::common::{dmp, refused, text, workspace, write};

const RUNS: &str = "@/truth.tum @/drift.tum @/noise.tum @/collapsed.tum";

fn json(folder: &Path, command: &str) -> Value {
    let output = dmp(folder, &format!("{command} --json"));
    assert_eq!(output.status.code(), Some(0), "{command}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn plotted(folder: &Path, command: &str, file: &str) -> String {
    let output = dmp(folder, &format!("{command} --silent --plot {file}"));
    assert_eq!(output.status.code(), Some(0), "{command}: {}", text(&output.stderr));
    assert!(output.stdout.is_empty());
    fs::read_to_string(folder.join(file)).unwrap()
}

/// The lines of the sample's drift, numbers apart.
fn drift() -> Vec<Vec<String>> {
    let all = fs::read_to_string(workspace().join("data-samples/drift.tum")).unwrap();
    let rows = all.lines().filter(|line| !line.starts_with('#'));
    rows.map(|line| line.split_whitespace().map(str::to_owned).collect()).collect()
}

#[test]
fn a_page_and_a_picture_tell_the_numbers_of_the_json() {
    let folder = tempfile::tempdir().unwrap();
    for command in
        ["truth ape @/truth.tum @/drift.tum -a", "truth rpe @/truth.tum @/drift.tum -d 5 -u m --all_pairs"]
    {
        let stats = json(folder.path(), command)["stats"].clone();
        let page = plotted(folder.path(), command, "run.html");
        let picture = plotted(folder.path(), command, "run.svg");
        for name in ["rmse", "mean", "median", "std", "min", "max", "sse"] {
            let value = format!(">{:.6}<", stats[name].as_f64().unwrap());
            assert!(page.contains(&value) && picture.contains(&value), "{name} {value}");
        }
        assert_eq!((page.matches("<svg xmlns").count(), picture.matches("<svg ").count()), (10, 11));
        for outside in ["https:", "<script", "src=", "@import", "url("] {
            assert!(!page.contains(outside) && !picture.contains(outside), "{outside}");
        }
        assert_eq!(plotted(folder.path(), command, "run.html"), page, "the same bytes");
    }
}

#[test]
fn several_runs_stand_side_by_side() {
    let folder = tempfile::tempdir().unwrap();
    let all = json(folder.path(), &format!("truth ape {RUNS} -a"));
    assert_eq!(all["schema"], "dmp-truth-runs/1");
    let runs = all["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 3);
    for (run, name) in runs.iter().zip(["drift", "noise", "collapsed"]) {
        assert_eq!(*run, json(folder.path(), &format!("truth ape @/truth.tum @/{name}.tum -a")));
    }
    let table = text(&dmp(folder.path(), &format!("truth ape {RUNS} -a")).stdout);
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines[0].starts_with("APE w.r.t. translation part (m)"), "{table}");
    assert_eq!(lines[3].split_whitespace().collect::<Vec<_>>()[..3], ["run", "max", "mean"]);
    let of_drift: Vec<&str> = lines[4].split_whitespace().collect();
    let rmse = format!("{:.6}", runs[0]["stats"]["rmse"].as_f64().unwrap());
    assert!(of_drift[0].ends_with("drift.tum") && of_drift[5] == rmse, "{table}");
    let page = plotted(folder.path(), &format!("truth ape {RUNS} -a"), "runs.html");
    let picture = plotted(folder.path(), &format!("truth ape {RUNS} -a"), "runs.svg");
    for name in ["drift.tum", "noise.tum", "collapsed.tum"] {
        let heading = format!(">{name}</h2>");
        assert!(page.contains(&heading) && picture.contains(&format!(">{name}</text>")), "{name}");
    }
    assert!(page.contains(">All runs</h2>") && page.contains("APE of 3 runs against truth.tum"));
}

#[test]
fn each_estimate_has_a_result_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let save = |runs: &str, file: &str| {
        let output =
            dmp(folder.path(), &format!("truth ape @/truth.tum {runs} --save_results {file} --silent"));
        (output.status.code(), text(&output.stderr))
    };
    assert_eq!(save("@/drift.tum", "one.zip").0, Some(0));
    assert_eq!(save("@/drift.tum @/noise.tum", "all.zip").0, Some(0));
    assert!(!at("all.zip").exists() && at("all.noise.zip").exists());
    assert_eq!(fs::read(at("all.drift.zip")).unwrap(), fs::read(at("one.zip")).unwrap());
    let (code, told) = save("@/drift.tum @/collapsed.tum", "all.zip");
    assert!(code == Some(2) && told.contains("all.drift.zip: there is a file"), "{told}");
    assert!(!at("all.collapsed.zip").exists());
    // Of one name, in several folders.
    for run in ["a", "b"] {
        fs::create_dir(at(run)).unwrap();
        fs::copy(workspace().join("data-samples/drift.tum"), at(run).join("run.tum")).unwrap();
    }
    assert_eq!(save("a/run.tum b/run.tum", "two.zip").0, Some(0));
    assert!(at("two.a_run.zip").exists() && at("two.b_run.zip").exists());
    assert_eq!(save("a/run.tum a/run.tum", "same.zip").0, Some(2));
    // In the place of an input.
    fs::rename(at("a/run.tum"), at("x.b.tum")).unwrap();
    let (code, told) = save("x.b.tum b/run.tum --no_warnings", "x.tum");
    assert_eq!(code, Some(0), "{told}");
    fs::rename(at("b/run.tum"), at("b.tum")).unwrap();
    let (code, told) = save("x.b.tum b.tum --no_warnings", "x.tum");
    assert!(code == Some(2) && told.contains("x.b.tum"), "{told}");
}

#[test]
fn what_cannot_be_drawn_is_told_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let truth = "truth ape no-such.tum none.tum";
    refused(
        folder.path(),
        &format!("{truth} --plot a.pdf"),
        2,
        &["a.pdf", "plots are written as .html or .svg"],
    );
    refused(folder.path(), &format!("{truth} --plot no/a.html"), 2, &["no/a.html", "there is no folder no"]);
    let run = fs::read(workspace().join("data-samples/drift.tum")).unwrap();
    fs::write(folder.path().join("run.svg"), &run).unwrap();
    refused(folder.path(), "truth ape @/truth.tum run.svg --plot run.svg", 2, &["run.svg"]);
    assert_eq!(fs::read(folder.path().join("run.svg")).unwrap(), run);
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
    assert!(notes.contains("ns.csv: columns by the names in line 1: stamp_ns, tx"), "{notes}");
    // A clock that begins with the drive.
    let refusal =
        ["clock.tum: line 1: stamps from 937500000 to ", "the time unit must be given (s, ms, us or ns)"];
    refused(folder.path(), "truth ape @/truth.tum clock.tum", 1, &refusal);
    refused(folder.path(), "score @/town.mcap -t clock.tum", 1, &refusal);
    write(folder.path(), "places.csv", "time,x,y,z\n0,1,2,3\n");
    let refusal = ["places.csv: line 1: no quaternion among the columns `time,x,y,z`"];
    refused(folder.path(), "truth ape @/truth.tum places.csv", 1, &refusal);
}

/// One run, several, pairs and angles, poses without stamps: at two widths, light and dark.
#[test]
fn a_browser_shows_every_plot() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let nasty = "a <b>long & bad name of a run that goes on and on.tum";
    fs::copy(workspace().join("data-samples/drift.tum"), folder.path().join(nasty)).unwrap();
    fs::copy(workspace().join("data-samples/noise.tum"), folder.path().join("noise.tum")).unwrap();
    for name in ["truth", "drift"] {
        let command = format!("convert trajectory @/{name}.tum -o {name}.txt --to kitti");
        assert_eq!(dmp(folder.path(), &command).status.code(), Some(0));
        fs::remove_file(folder.path().join("times.txt")).unwrap();
    }
    let mut several = crate::common::dmp_command(folder.path(), "truth ape @/truth.tum");
    several.args([nasty, "noise.tum", "-a", "--silent", "--plot", "several.html"]);
    assert!(several.status().unwrap().success());
    plotted(folder.path(), "truth ape @/truth.tum @/drift.tum -as", "one.html");
    plotted(folder.path(), "truth rpe @/truth.tum @/drift.tum -d 10 -u m -r angle_deg", "pairs.html");
    plotted(folder.path(), "truth ape kitti truth.txt drift.txt -r full", "rows.html");
    for file in ["one.html", "several.html", "pairs.html", "rows.html"] {
        let mut grounds = Vec::new();
        for (width_px, theme) in
            [(1280, Theme::Light), (1280, Theme::Dark), (390, Theme::Light), (390, Theme::Dark)]
        {
            let page = browser.open(&folder.path().join(file), width_px, theme);
            for (role, name) in [
                ("region", "Result"),
                ("columnheader", "rmse"),
                ("image", "from above, coloured by error"),
                ("image", "from the side, coloured by error"),
                ("image", "over time"),
                ("image", "over way"),
                ("image", "yaw of"),
                ("region", "What was compared"),
            ] {
                assert!(page.has(role, name), "{file} {width_px} {theme:?}: no {role} `{name}`");
            }
            if file == "several.html" {
                assert!(page.has("region", "All runs") && page.has("image", "Ways of all runs"));
                assert!(page.text().contains("a <b>long & bad name"), "{}", page.text());
            }
            page.assert_sound();
            assert!(page.requests().is_empty(), "{:?}", page.requests());
            let (shot, smaller) = page.screenshot();
            let (width, _, rgb) = pixels(&shot);
            assert_eq!(width * smaller, width_px as usize, "{file}: the page is as wide as the window");
            grounds.push(rgb[0]);
        }
        assert!(grounds[0][0] > 200 && grounds[1][0] < 60, "{grounds:?}");
    }
}

/// The picture has no page around it: it is put into one.
#[test]
fn a_browser_shows_the_picture() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let picture = plotted(folder.path(), &format!("truth ape {RUNS} -a"), "runs.svg");
    let page =
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>runs</title></head><body>";
    let path = write(folder.path(), "runs.html", &format!("{page}{picture}</body></html>"));
    let page = browser.open(&path, 1700, Theme::Light);
    page.assert_sound();
}
