//! The scores of the sample data, for tests.

use serde_json::{Value, json};

use super::contents::Report;

/// The JSON of the samples' report: truth, drift, noise and collapsed, every pair decided.
pub(crate) fn scores_json() -> Value {
    let text = include_str!("../../../../data-samples/scores.json");
    let mut json: Value = serde_json::from_str(text).unwrap();
    // What the file leaves out, being of the moment.
    json["dmp_version"] = "0".into();
    json["drift"]["dmp_version"] = "0".into();
    json["inputs"]["log"] = "town.mcap".into();
    json["timing"] = json!({ "plan_s": 1.0, "fuse_s": 1.0, "trails_s": 0.0, "cast_s": 2.0,
        "drift_s": 0.0, "total_s": 4.0, "threads": 2 });
    json["memory"] = json!({ "budget_bytes": 100, "peak_anon_bytes": 10, "scratch_bytes": 0, "disk_bytes": 5,
        "disk_bytes_estimated": 6, "tile_loads": 7, "tiles_in_reach": 8, "tile_visits": 9 });
    json
}

/// The report itself.
pub(crate) fn scores() -> Report {
    serde_json::from_value(scores_json()).unwrap()
}

#[test]
fn the_samples_come_back_to_the_same_bits() {
    let json = scores_json();
    let report: Report = serde_json::from_value(json.clone()).unwrap();
    assert_eq!(
        serde_json::to_string_pretty(&serde_json::to_value(&report).unwrap()).unwrap(),
        serde_json::to_string_pretty(&json).unwrap()
    );
    let text = serde_json::to_string(&report).unwrap();
    assert_eq!(serde_json::from_str::<Report>(&text).unwrap(), report);
}

/// The fields in the order in which they have always stood: nothing but their names depends on types.
#[test]
fn fields_stand_in_their_order() {
    let report = scores();
    let order = |json: String, fields: &[&str]| {
        let places: Vec<_> = fields.iter().map(|field| json.find(&format!("\"{field}\":"))).collect();
        assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{fields:?}: {json}");
    };
    order(
        serde_json::to_string(&report.config).unwrap(),
        &["voxel_m", "horizon_m", "ego", "ego_cells", "ego_box_m", "every", "free_space"],
    );
    order(
        serde_json::to_string(&report.pairs[0]).unwrap(),
        &[
            "a",
            "b",
            "score",
            "llr_raw",
            "verdict",
            "is_same",
            "better_on_the_whole",
            "decided_at_m",
            "reason",
            "frames_needed",
            "places_needed",
        ],
    );
    order(
        serde_json::to_string(&report.inputs.runs[0]).unwrap(),
        &["name", "world_from_own", "pairing", "max_time_gap_s", "notes"],
    );
}
