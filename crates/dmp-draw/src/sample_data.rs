//! The report of the sample data, for tests.

use dmp_report::Report;

pub(crate) fn sample() -> Report {
    let text = include_str!("../../../data-samples/scores.json");
    let mut json: serde_json::Value = serde_json::from_str(text).unwrap();
    json.as_object_mut().unwrap().remove("gates");
    // What depends on where and on what machine it was made is not in the file.
    json["dmp_version"] = "0.1.0".into();
    json["drift"]["dmp_version"] = "0.1.0".into();
    json["inputs"]["log"] = "data-samples/town.mcap".into();
    for run in json["inputs"]["runs"].as_array_mut().unwrap() {
        run["file"] = format!("{}.tum", run["name"].as_str().unwrap()).into();
    }
    json["timing"] = serde_json::json!({
        "plan_s": 0.1, "fuse_s": 0.2, "trails_s": 0.0, "cast_s": 0.7, "total_s": 1.0, "threads": 2
    });
    json["memory"] = serde_json::json!({
        "budget_bytes": 1 << 30, "peak_anon_bytes": 1 << 25, "scratch_bytes": 0, "disk_bytes": 1 << 20,
        "disk_bytes_estimated": 1 << 20, "tile_loads": 1, "tiles_in_reach": 1, "tile_visits": 1
    });
    serde_json::from_value(json).unwrap()
}
