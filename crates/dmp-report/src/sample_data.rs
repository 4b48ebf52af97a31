//! The scores of the sample data, for tests.

use serde_json::{Value, json};

use super::Report;

/// The JSON of the samples' report: truth, drift, noise and collapsed, every pair decided.
pub(crate) fn scores_json() -> Value {
    let text = include_str!("../../../data-samples/scores.json");
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
