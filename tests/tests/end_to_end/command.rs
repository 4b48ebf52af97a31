//! The command itself: its main job on the samples, its JSON, and what bad input gets.

use serde::Deserialize;

use crate::common::{dmp, real_data, refused, text, unwrapped, workspace, write};

const MAIN_JOB: &str = "score @/town.mcap -t @/truth.tum -t @/drift.tum -t @/noise.tum -t @/collapsed.tum";

/// The JSON as documented: a field that is missing, or one that is not documented, fails here.
mod schema {
    use super::Deserialize;
    use std::collections::BTreeMap;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "every field must be there; not every one is asserted on")]
    pub(super) struct Report {
        pub(super) schema: String,
        pub(super) dmp_version: String,
        pub(super) config: Config,
        pub(super) inputs: Inputs,
        pub(super) free_space: Option<FreeSpace>,
        pub(super) runs: Vec<Run>,
        pub(super) left_out: Vec<serde_json::Value>,
        pub(super) order: Vec<String>,
        pub(super) ties: Vec<[String; 2]>,
        pub(super) pairs: Vec<Pair>,
        pub(super) drift: dmp::DriftReport,
        pub(super) promise: BTreeMap<String, Option<f64>>,
        pub(super) sampling: serde_json::Value,
        pub(super) warnings: Vec<String>,
        pub(super) gates: Vec<serde_json::Value>,
        pub(super) timing: BTreeMap<String, f64>,
        pub(super) memory: BTreeMap<String, Option<u64>>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "every field must be there; not every one is asserted on")]
    pub(super) struct Config {
        pub(super) voxel_m: f64,
        pub(super) voxel_filled_share: Option<f64>,
        pub(super) tile_edge_m: f64,
        pub(super) disc_radius_m: f64,
        pub(super) segments: Segments,
        pub(super) min_range_m: f64,
        pub(super) max_range_m: f64,
        pub(super) horizon_m: f64,
        pub(super) ego: String,
        pub(super) ego_cells: u64,
        pub(super) ego_box_m: Option<[[f64; 3]; 2]>,
        pub(super) every: u64,
        pub(super) body_from_sensor: Option<[f64; 7]>,
        pub(super) time_offset_s: f64,
        pub(super) sigma_m: Option<f64>,
        pub(super) depth_noise: Option<BTreeMap<String, f64>>,
        pub(super) scales: String,
        pub(super) miss_price: f64,
        pub(super) free_space: bool,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub(super) struct FreeSpace {
        pub(super) votes: Vec<String>,
        pub(super) returns_fused: u64,
        pub(super) returns_left_out: u64,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub(super) struct Segments {
        pub(super) length_m: Option<f64>,
        pub(super) length_s: Option<f64>,
        pub(super) length_scans: Option<u64>,
        pub(super) count: usize,
        pub(super) travel_m: f64,
        pub(super) starts_ns: Vec<i64>,
        pub(super) starts_scan: Vec<u64>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "every field must be there; not every one is asserted on")]
    pub(super) struct Inputs {
        pub(super) log: String,
        pub(super) format: String,
        pub(super) fingerprint: String,
        pub(super) bytes: u64,
        pub(super) has_checksums: Option<bool>,
        pub(super) topic: Option<String>,
        pub(super) point_times: Option<String>,
        pub(super) span_ns: Option<[i64; 2]>,
        pub(super) scans: u64,
        pub(super) scans_used: u64,
        pub(super) returns: u64,
        pub(super) returns_used: u64,
        pub(super) dropped: BTreeMap<String, u64>,
        pub(super) runs: Vec<RunInput>,
        pub(super) notes: Vec<String>,
        pub(super) damage: Vec<String>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "every field must be there; not every one is asserted on")]
    pub(super) struct RunInput {
        pub(super) name: String,
        pub(super) file: Option<String>,
        pub(super) format: Option<String>,
        pub(super) poses: u64,
        pub(super) body_from_sensor: [f64; 7],
        pub(super) body_from_sensor_source: String,
        pub(super) world_from_own: [f64; 7],
        pub(super) pairing: String,
        pub(super) pose_at: String,
        pub(super) time_offset_s: f64,
        pub(super) conventions: Option<serde_json::Value>,
        pub(super) max_time_gap_s: f64,
        pub(super) longest_gap_s: Option<f64>,
        pub(super) scans_between_poses: u64,
        pub(super) scans_without_pose: u64,
        pub(super) map: String,
        pub(super) map_notes: Vec<String>,
        pub(super) notes: Vec<String>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "every field must be there; not every one is asserted on")]
    pub(super) struct Run {
        pub(super) name: String,
        pub(super) returns: u64,
        pub(super) frames: u64,
        pub(super) dmp_sum_m2: f64,
        pub(super) dmp_mean_m2: Option<f64>,
        pub(super) dmp_depth_sum_m2: Option<f64>,
        pub(super) dmp_depth_mean_m2: Option<f64>,
        pub(super) r_cv_m2: BTreeMap<String, Option<f64>>,
        pub(super) r_cv_interval_m2: Option<[f64; 2]>,
        pub(super) r_near_interval_m2: Option<[f64; 2]>,
        pub(super) r_cv_withheld: Option<String>,
        pub(super) r_near_m2: BTreeMap<String, Option<f64>>,
        pub(super) miss_rate: Option<f64>,
        pub(super) blocked_rate: Option<f64>,
        pub(super) coverage: Option<f64>,
        pub(super) coverage_revisit: Option<f64>,
        pub(super) log_likelihood_raw: f64,
        pub(super) surfels: u64,
        pub(super) tiles: u64,
        pub(super) thin_voxels: Option<u64>,
        pub(super) map_points_dropped: u64,
        pub(super) surfels_with_trails: Option<u64>,
        pub(super) surfels_contradicted: Option<u64>,
        pub(super) warnings: Vec<String>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "every field must be there; not every one is asserted on")]
    pub(super) struct Pair {
        pub(super) a: String,
        pub(super) b: String,
        pub(super) score: String,
        pub(super) scales: Vec<Scale>,
        pub(super) llr_raw: f64,
        pub(super) verdict: String,
        pub(super) is_same: bool,
        pub(super) better_on_the_whole: Option<String>,
        pub(super) decided_at_m: Option<f64>,
        pub(super) reason: String,
        pub(super) frames_needed: Option<u64>,
        pub(super) places_needed: Option<u64>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(clippy::struct_field_names, reason = "the names are those of the JSON")]
    pub(super) struct Scale {
        pub(super) scale_m: f64,
        pub(super) mean_a_m2: Option<f64>,
        pub(super) mean_b_m2: Option<f64>,
        pub(super) difference_m2: Option<f64>,
        pub(super) interval_m2: Option<[f64; 2]>,
        pub(super) apart_at_most_m: Option<f64>,
        pub(super) margin_m: Option<f64>,
        pub(super) returns: u64,
    }
}

#[test]
fn the_main_job_ranks_the_samples() {
    let output = dmp(&workspace(), MAIN_JOB);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    let place = |name: &str| table.find(name).unwrap_or_else(|| panic!("no {name} in\n{table}"));
    assert!(
        place("truth") < place("noise")
            && place("noise") < place("drift")
            && place("drift") < place("collapsed")
    );
    let readme = std::fs::read_to_string(workspace().join("README.md")).unwrap();
    assert!(readme.contains(table.trim_end()), "README.md shows another table than\n{table}");
    let words = unwrapped(&table);
    for said in
        ["truth is best: better than noise, ", "worse by", "these settings only", "so each interval is at"]
    {
        assert!(words.contains(said), "no `{said}` in\n{table}");
    }
}

#[test]
fn the_json_is_as_documented() {
    let output = dmp(&workspace(), &format!("{MAIN_JOB} --json"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report: schema::Report = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report.schema, "dmp-score/2");
    assert_eq!((report.order[0].as_str(), report.order[3].as_str()), ("truth", "collapsed"));
    assert!(report.ties.is_empty() && report.pairs.len() == 6 && report.runs.len() == 4);
    for pair in &report.pairs {
        assert!(pair.verdict == pair.a || pair.verdict == pair.b, "{pair:?}");
        let decided = pair.scales.iter().find(|scale| Some(scale.scale_m) == pair.decided_at_m).unwrap();
        let [low, high] = decided.interval_m2.unwrap();
        let difference = decided.difference_m2.unwrap();
        assert!(low <= difference && difference <= high && (low > 0.0 || high < 0.0), "{decided:?}");
        assert_eq!(pair.verdict == pair.a, difference < 0.0, "lower is better");
        assert!(decided.returns > 100_000);
        // Better by more than what may count as the same, at some scale.
        assert!(!pair.is_same && pair.scales.iter().any(|scale| scale.apart_at_most_m > scale.margin_m));
        let means = decided.mean_a_m2.unwrap() - decided.mean_b_m2.unwrap();
        assert!((means - difference).abs() < 1e-9);
    }
    let inputs = &report.inputs;
    assert_eq!(inputs.returns, inputs.returns_used + inputs.dropped.values().sum::<u64>());
    assert_eq!(report.config.segments.starts_ns.len(), report.config.segments.count);
    assert_eq!(report.config.segments.starts_scan.len(), report.config.segments.count);
    let segments = &report.config.segments;
    assert_eq!((segments.length_s, segments.length_scans), (None, None));
    assert!(report.config.segments.length_m == Some(12.0) && report.config.segments.travel_m > 150.0);
    assert_eq!((report.drift.runs.len(), report.drift.comparisons.len()), (4, 6));
    // The documentation names every field of the top.
    let documented = std::fs::read_to_string(workspace().join("docs/json.md")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let documented_field = |field: &String| documented.contains(&format!("`{field}`"));
    for part in [
        &json,
        &json["config"],
        &json["inputs"],
        &json["inputs"]["runs"][0],
        &json["runs"][0],
        &json["pairs"][0],
        &json["timing"],
    ] {
        let missing: Vec<&String> =
            part.as_object().unwrap().keys().filter(|f| !documented_field(f)).collect();
        assert!(missing.is_empty(), "not in docs/json.md: {missing:?}");
    }
}

#[test]
fn free_space_is_told_and_not_used_with_given_maps() {
    let folder = tempfile::tempdir().unwrap();
    let output = dmp(folder.path(), &format!("{MAIN_JOB} --free-space --json --quiet"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report: schema::Report = serde_json::from_slice(&output.stdout).unwrap();
    let free_space = report.free_space.unwrap();
    assert!(report.config.free_space && free_space.returns_left_out < free_space.returns_fused / 20);
    assert_eq!(free_space.votes[0], "truth");
    assert_eq!(report.order[0], "truth");
    for run in &report.runs {
        assert!(run.surfels_contradicted < run.surfels_with_trails, "{run:?}");
        assert!(Some(run.surfels) <= run.surfels_with_trails);
    }
    let table = unwrapped(&text(&dmp(folder.path(), &format!("{MAIN_JOB} --free-space --verbose")).stdout));
    for words in ["in no map: ", "which rays pass through in truth", "surfels with trails", ", trails "] {
        assert!(table.contains(words), "no `{words}` in\n{table}");
    }
    let cloud = write(folder.path(), "cloud.ply", "ply");
    let given = format!("score @/town.mcap -t @/truth.tum --free-space --map {}", cloud.display());
    refused(folder.path(), &given, 2, &["free-space", "`truth`", "--map"]);
}

#[test]
fn threads_memory_and_folder_leave_the_json_alone() {
    let folder = tempfile::tempdir().unwrap();
    let json = |options: &str| {
        let output = dmp(folder.path(), &format!("{MAIN_JOB} --json --quiet {options}"));
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        assert_eq!(text(&output.stderr), "");
        let mut json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let object = json.as_object_mut().unwrap();
        assert!(object.remove("timing").is_some() && object.remove("memory").is_some());
        json
    };
    let one = json("--threads 1");
    for options in
        ["--threads 2 --memory 64MiB", "--threads 4 --memory 256MiB --work .", "--memory unlimited"]
    {
        assert!(json(options) == one, "{options}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left behind");
}

#[test]
fn the_price_of_a_miss_changes_the_score_and_no_pair() {
    let folder = tempfile::tempdir().unwrap();
    let json = |options: &str| {
        let output = dmp(folder.path(), &format!("{MAIN_JOB} --json --quiet {options}"));
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    let (default, dearer) = (json(""), json("--miss-price 0.25"));
    assert_eq!(
        (&default["config"]["miss_price"], &dearer["config"]["miss_price"]),
        (&0.15.into(), &0.25.into())
    );
    assert_eq!(default["pairs"].as_array().unwrap().len(), 6);
    assert_eq!(default["pairs"], dearer["pairs"]);
    let runs_of = |report: &serde_json::Value| report["runs"].as_array().unwrap().clone();
    for (before, after) in runs_of(&default).iter().zip(&runs_of(&dearer)) {
        let r_cv_m2 = |run: &serde_json::Value, scale: &str| run["r_cv_m2"][scale].as_f64().unwrap();
        let expected = (0.25 - 0.15) * 100.0 * (1.0 - before["coverage"].as_f64().unwrap());
        let difference = r_cv_m2(after, "10") - r_cv_m2(before, "10");
        assert!(expected > 0.1, "a run without misses shows nothing");
        assert!((difference / expected - 1.0).abs() < 1e-9, "{difference} is not {expected}");
        assert!(["2", "0.5", "0.2"].iter().all(|scale| r_cv_m2(before, scale) == r_cv_m2(after, scale)));
    }
    let refused = dmp(folder.path(), &format!("{MAIN_JOB} --miss-price -0.1"));
    assert_eq!((refused.status.code(), text(&refused.stdout)), (Some(2), String::new()));
    assert!(text(&refused.stderr).contains("`-0.1` is no share from 0 to 1"), "{}", text(&refused.stderr));
}

#[test]
fn bad_input_gets_one_line_with_file_place_and_value() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let good = "1700000000 0 0 0 0 0 0 1\n1700000060 1 0 0 0 0 0 1\n";
    write(folder, "good.tum", good);
    write(folder, "noise.bin", "this is no log");
    write(folder, "rows.kitti", "1 0 0 0 0 1 0 0 0 0 1 0\n");
    std::fs::create_dir(folder.join("nothing")).unwrap();
    std::fs::write(folder.join("zeros.mcap"), [0u8; 4096]).unwrap();

    let town = "score @/town.mcap -t";
    refused(folder, "score none.mcap -t good.tum", 2, &["none.mcap"]);
    refused(folder, "score nothing -t good.tum", 1, &["nothing"]);
    refused(folder, "score noise.bin -t good.tum", 1, &["noise.bin"]);
    refused(folder, "score zeros.mcap -t good.tum", 1, &["zeros.mcap"]);
    refused(folder, &format!("{town} none.tum"), 2, &["none.tum"]);
    refused(folder, &format!("{town} rows.kitti"), 1, &["rows", "1 poses for 100 scans"]);
    refused(folder, &format!("{town} same=@/truth.tum -t same=@/drift.tum"), 2, &["same"]);
    refused(folder, &format!("{town} @/truth.tum --topic /lidar"), 2, &["/lidar", "/points"]);
    refused(folder, &format!("{town} @/truth.tum --map none.las"), 2, &["none.las"]);
    refused(folder, &format!("{town} @/truth.tum --work nowhere"), 1, &["nowhere"]);
    refused(folder, &format!("{town} @/truth.tum --min-range 50 --max-range 20"), 2, &["50", "20"]);
}

#[test]
fn wrong_usage_exits_with_2() {
    let folder = tempfile::tempdir().unwrap();
    let town = "score @/town.mcap -t @/truth.tum";
    for options in [
        "--memory lots",
        "--voxel -1",
        "--extrinsic 1,2,3",
        "--extrinsic 0,0,0,0,0,0,0",
        "--threads 0",
        "--every 0",
        "--map-unit yards",
        "--nonsense",
    ] {
        let output = dmp(folder.path(), &format!("{town} {options}"));
        assert_eq!(output.status.code(), Some(2), "{options}: {}", text(&output.stderr));
        assert!(!output.stderr.is_empty() && output.stdout.is_empty(), "{options}");
    }
    assert_eq!(dmp(folder.path(), "score @/town.mcap").status.code(), Some(2), "no run");
}

#[test]
fn info_tells_what_is_in_a_log() {
    let folder = tempfile::tempdir().unwrap();
    let output = dmp(folder.path(), "info @/town.mcap -t @/truth.tum --json");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(info["schema"], "dmp-info/1");
    assert!(text(&output.stdout).contains("/points"));
    let people = text(&dmp(folder.path(), "info @/town.mcap").stdout);
    for words in ["sensor_msgs/msg/PointCloud2", "100", "2.00 Hz"] {
        assert!(people.contains(words), "no `{words}` in\n{people}");
    }
    assert_eq!(info["streams"][0]["scans"]["fields"][3]["meaning"], "time");
    assert_eq!(info["trajectories"][0]["scans_within"], 100);
    if let Some(data) = real_data("rs32_static") {
        let folder_log = text(&dmp(&data, "info .").stdout);
        assert!(folder_log.contains("14") && folder_log.contains("579"), "{folder_log}");
    }
}

/// Where `score` asks, `info` answers: several topics, and times that could mean this or that.
#[test]
fn info_describes_what_cannot_be_scored_as_it_is() {
    let logs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("conformance/mcap");
    let output = dmp(&logs, "info two_clouds.mcap --json");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let topics: Vec<&str> =
        info["streams"].as_array().unwrap().iter().map(|stream| stream["topic"].as_str().unwrap()).collect();
    assert_eq!(topics, ["/front/points", "/rear/points"]);
    assert_eq!(info["streams"][1]["scans"]["frame_id"], "livox_frame");
    assert_eq!(info["topics"].as_array().unwrap().len(), 3);
    assert_eq!(dmp(&logs, "info two_clouds.mcap --topic /chatter").status.code(), Some(2));

    let unclear = dmp(&logs, "info velodyne_none.mcap --point-time absolute-ms --json");
    let info: serde_json::Value = serde_json::from_slice(&unclear.stdout).unwrap();
    assert!(info["streams"][0]["problem"].is_null(), "{info}");
    let refused = dmp(&logs, "info velodyne_none.mcap --point-time absolute-ms --stamp end --json");
    let info: serde_json::Value = serde_json::from_slice(&refused.stdout).unwrap();
    let problem = info["streams"][0]["problem"].as_str().unwrap();
    assert!(problem.contains("--stamp end") && problem.contains("`time`"), "{problem}");
    assert_eq!(info["streams"][0]["scans"]["scans"], 3);
}

#[test]
fn a_simulated_log_can_be_scored_in_both_formats() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &str| {
        let output = dmp(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}\n{}", text(&output.stderr));
        text(&output.stdout)
    };
    run("simulate town -o drive.mcap --scans 40 --azimuth-steps 90 --seed 3");
    run("simulate town -o drive --scans 40 --azimuth-steps 90 --seed 3 --truth drive.truth.txt");
    run("simulate errors drive.truth.tum --drift-ate 0.5 --noise 0.05,0.2deg -o wrong.tum");
    run("score drive.mcap -t drive.truth.tum -t wrong.tum");
    run("score drive -t drive.truth.txt");
    let in_place = dmp(folder.path(), "simulate errors drive.truth.tum --scale 2 -o ./drive.truth.tum");
    assert_eq!(in_place.status.code(), Some(2), "the truth is not to be lost: {}", text(&in_place.stderr));
    // The same numbers, the same bytes.
    run("simulate town -o again.mcap --scans 40 --azimuth-steps 90 --seed 3");
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("drive.mcap") == read("again.mcap") && read("drive.truth.tum") == read("again.truth.tum"));
}

#[test]
fn a_simulated_city_is_read_back_as_it_was_told() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &str, code: i32| {
        let output = dmp(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments}\n{}", text(&output.stderr));
        text(&output.stdout) + &text(&output.stderr)
    };
    let told = run("simulate city --km 0.2 --beams 32 --azimuth-steps 60 --seed 5 -o city.mcap", 0);
    let info: serde_json::Value = serde_json::from_str(&run("info city.mcap --json", 0)).unwrap();
    let found = &info["streams"][0]["scans"];
    let (scans, returns) = (&found["scans"], &found["returns"]);
    // Amounts have commas.
    let plain = told.replace(", ", "; ").replace(',', "");
    assert!(plain.contains(&format!("{scans} scans; {returns} returns; 0.200 km")), "{told}{info}");
    assert!(scans.as_u64().unwrap() > 100, "{scans}");
    run("score city.mcap -t city.truth.tum", 0);
    // The same numbers, the same bytes; an elsewhere of its own for another seed.
    run("simulate city --km 0.2 --beams 32 --azimuth-steps 60 --seed 5 -o again.mcap", 0);
    run("simulate city --km 0.2 --beams 32 --azimuth-steps 60 --seed 6 -o other.mcap", 0);
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("city.mcap") == read("again.mcap") && read("city.truth.tum") == read("again.truth.tum"));
    assert!(read("city.truth.tum") != read("other.truth.tum"));
    let refused = run("simulate city --km 0 -o none.mcap", 2);
    assert!(refused.contains("travel in m") && refused.contains("not 0"), "{refused}");
    assert!(!folder.path().join("none.mcap").exists());
}
