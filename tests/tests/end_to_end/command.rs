//! The command itself: its main job on the samples, its JSON, `info`, `simulate`, and wrong usage.

use std::path::Path;

use serde_json::Value;

use crate::common::{SAMPLE, TWO, done, ends, has, json, once, refused, scores, text, workspace, write};

#[test]
fn the_samples_are_ranked_as_the_readme_shows() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "all.json", &once(SAMPLE).stdout());
    // `compare` tests that this is the table of the score itself.
    let table = done(folder.path(), "compare all.json");
    let ranks = ["1  truth ", "2  noise ", "3  collapsed ", "3  drift "];
    has(&table, &ranks.map(|rank| format!("\n{rank}")).each_ref().map(String::as_str));
    let readme = std::fs::read_to_string(workspace().join("README.md")).unwrap();
    assert!(readme.contains(table.trim_end()), "README.md shows another table than\n{table}");
    let is_small = table.lines().count() <= 24 && table.lines().all(|line| line.chars().count() <= 80);
    assert!(is_small, "more than 24 lines of 80 columns:\n{table}");
}

/// The names of all fields; those of maps from scales, stages and reasons are data.
fn fields<'a>(value: &'a Value, found: &mut Vec<&'a str>) {
    match value {
        Value::Array(all) => all.iter().for_each(|one| fields(one, found)),
        Value::Object(all) => {
            for (name, value) in all {
                found.push(name);
                if !["dropped", "r_cv_m2", "r_near_m2"].contains(&name.as_str()) {
                    fields(value, found);
                }
            }
        }
        _ => {}
    }
}

/// Asserts that `docs/schema.json` has every field.
pub(crate) fn assert_documented(json: &Value) {
    let page = std::fs::read_to_string(workspace().join("docs/schema.json")).unwrap();
    let mut found = Vec::new();
    fields(json, &mut found);
    found.retain(|field| !page.contains(&format!("\"{field}\"")));
    assert!(found.is_empty(), "not in docs/schema.json: {found:?}");
}

#[test]
fn the_json_is_documented_and_is_read_back_as_the_report() {
    let json = once(SAMPLE).json();
    assert_documented(&json);
    let report: dmp::Report = serde_json::from_value(json.clone()).unwrap();
    for (field, value) in serde_json::to_value(&report).unwrap().as_object().unwrap() {
        assert_eq!(*value, json[field], "{field}");
    }
    assert_eq!((&json["schema"], &json["left_out"]), (&"dmp-score/3".into(), &serde_json::json!([])));
    assert_eq!(report.order, ["truth", "noise", "collapsed", "drift"]);
    assert_eq!((report.pairs.len(), report.runs.len()), (6, 4));
    assert_eq!(report.ties, [["collapsed", "drift"]]);
    for pair in &report.pairs {
        let Some(better) = pair.verdict.better() else { continue };
        let decided =
            pair.scales.iter().find(|scale| Some(scale.scale_m) == pair.verdict.decided_at_m()).unwrap();
        let [low, high] = decided.interval_m2.unwrap();
        let difference = decided.difference_m2.unwrap();
        assert!(low <= difference && difference <= high && (low > 0.0 || high < 0.0), "{decided:?}");
        assert_eq!(better == pair.a, difference < 0.0, "lower is better");
        let means = decided.mean_a_m2.unwrap() - decided.mean_b_m2.unwrap();
        assert!((means - difference).abs() < 1e-9 && decided.returns > 100_000);
    }
    let inputs = &report.inputs;
    assert_eq!(inputs.returns, inputs.returns_used + inputs.dropped.0.values().sum::<u64>());
    let segments = &report.inputs.runs[0].segments;
    assert_eq!((segments.starts_ns.len(), segments.starts_scan.len()), (segments.count, segments.count));
    assert!(segments.length_m == Some(12.0) && segments.travel_m > 150.0);
    let drift = report.drift.unwrap();
    assert_eq!((drift.runs.len(), drift.comparisons.len()), (4, 6));
}

#[test]
fn threads_memory_and_folder_change_no_bit_of_the_json() {
    let folder = tempfile::tempdir().unwrap();
    let expected = scores(&once(&format!("{TWO} --json --quiet")).output.stdout);
    let output = ends(folder.path(), &format!("{TWO} --json --quiet --threads 3 --memory 64MiB --work ."), 0);
    assert!(scores(&output.stdout) == expected && output.stderr.is_empty(), "{}", text(&output.stderr));
    assert_eq!(folder.path().read_dir().unwrap().count(), 0, "nothing is left behind");
}

/// Where `score` asks, `info` answers: several topics, and times that could mean this or that.
#[test]
fn info_describes_what_cannot_be_scored_as_it_is() {
    let logs = workspace().join("tests/conformance/mcap");
    let info = json(&logs, "info two_clouds.mcap");
    let streams = info["streams"].as_array().unwrap();
    assert_eq!(
        (&streams[0]["topic"], &streams[1]["topic"]),
        (&"/front/points".into(), &"/rear/points".into())
    );
    assert_eq!(streams[1]["scans"]["frame_id"], "livox_frame");
    assert_eq!(info["topics"].as_array().unwrap().len(), 3);
    ends(&logs, "info two_clouds.mcap --topic /chatter", 2);
    let problem = |options: &str| {
        let arguments = format!("info velodyne_none.mcap --point-time absolute-ms {options}");
        json(&logs, &arguments)["streams"][0]["problem"].clone()
    };
    assert_eq!(problem(""), Value::Null);
    has(problem("--stamp end").as_str().unwrap(), &["--stamp end", "`time`"]);
}

fn same_bytes(folder: &Path, a: &str, b: &str) -> bool {
    [a, b].map(|name| std::fs::read(folder.join(name)).unwrap()).windows(2).all(|pair| pair[0] == pair[1])
}

#[test]
fn a_simulated_town_can_be_scored_and_comes_out_the_same_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let town = "simulate town --scans 40 --azimuth-steps 90 --seed 3";
    done(path, &format!("{town} -o drive.mcap"));
    done(path, &format!("{town} -o drive --truth drive.truth.txt"));
    done(path, "simulate errors drive.truth.tum --drift-ate 0.5 --noise 0.05,0.2deg -o wrong.tum");
    done(path, "score drive.mcap -t drive.truth.tum -t wrong.tum");
    done(path, "score drive -t drive.truth.txt");
    ends(path, "simulate errors drive.truth.tum --scale 2 -o ./drive.truth.tum", 2);
    done(path, &format!("{town} -o again.mcap"));
    assert!(
        same_bytes(path, "drive.mcap", "again.mcap")
            && same_bytes(path, "drive.truth.tum", "again.truth.tum")
    );
}

#[test]
fn a_simulated_city_is_read_back_as_it_was_printed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let city = "simulate city --km 0.2 --beams 16 --azimuth-steps 60";
    let output = ends(path, &format!("{city} --seed 5 -o city.mcap"), 0);
    let found = json(path, "info city.mcap")["streams"][0]["scans"].clone();
    // Amounts have commas.
    let printed = (text(&output.stdout) + &text(&output.stderr)).replace(", ", "; ").replace(',', "");
    has(&printed, &[&format!("{} scans; {} returns; 0.200 km", found["scans"], found["returns"])]);
    assert!(found["scans"].as_u64().unwrap() > 100, "{found}");
    done(path, "score city.mcap -t city.truth.tum");
    done(path, &format!("{city} --seed 5 -o again.mcap"));
    done(path, &format!("{city} --seed 6 -o other.mcap"));
    assert!(
        same_bytes(path, "city.mcap", "again.mcap") && same_bytes(path, "city.truth.tum", "again.truth.tum")
    );
    assert!(!same_bytes(path, "city.truth.tum", "other.truth.tum"));
    refused(path, "simulate city --km 0 -o none.mcap", 2, &["travel in m", "not 0"]);
    assert!(!path.join("none.mcap").exists());
}
