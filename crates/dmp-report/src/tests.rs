//! The report of the samples, read and written.

use crate::Report;
use crate::sample_data::{scores, scores_json};

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
        &["voxel_m", "horizon_m", "ego", "ego_cells", "ego_box_m", "every"],
    );
    order(
        serde_json::to_string(&report.pairs[0]).unwrap(),
        &[
            "a",
            "b",
            "score",
            "llr_raw",
            "verdict",
            "better_on_the_whole",
            "decided_at_m",
            "decided_by_drift",
            "reason",
        ],
    );
    order(
        serde_json::to_string(&report.inputs.runs[0]).unwrap(),
        &["name", "world_from_own", "pairing", "max_time_gap_s", "notes"],
    );
}
