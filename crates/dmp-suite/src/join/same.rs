//! Checks that two reports agree on everything that makes scores comparable.

use std::fmt::Display;

use dmp_report::Report;

use super::error::{JoinError, MadeWith};
use super::named::NamedReport;

/// What must be equal, in words; the JSON field; its value.
type Fact = (MadeWith, &'static str, fn(&Report) -> String);

/// In order: causes before the settings that follow from them.
const FACTS: [Fact; 29] = [
    (MadeWith::Version, "dmp_version", |report| report.dmp_version.clone()),
    (MadeWith::Log, "inputs.fingerprint", |report| report.inputs.fingerprint.clone()),
    (MadeWith::Log, "inputs.bytes", |report| report.inputs.bytes.to_string()),
    (MadeWith::Log, "inputs.topic", |report| or_null(report.inputs.topic.as_ref())),
    (MadeWith::Log, "inputs.scans", |report| report.inputs.scans.to_string()),
    (MadeWith::Log, "inputs.returns", |report| report.inputs.returns.to_string()),
    (MadeWith::Log, "inputs.span_ns", |report| format!("{:?}", report.inputs.span_ns)),
    (MadeWith::Log, "inputs.point_times", |report| or_null(report.inputs.point_times.as_ref())),
    (MadeWith::Settings, "config.time_offset_s", |report| report.config.time_offset_s.to_string()),
    (MadeWith::Frames, "config.every", |report| report.config.every.to_string()),
    (MadeWith::Frames, "sampling.frames_scored", |report| report.sampling.frames_scored.to_string()),
    (MadeWith::Frames, "sampling.returns_one_in", |report| report.sampling.returns_one_in.to_string()),
    (MadeWith::Frames, "sampling.seed", |report| or_null(report.sampling.seed)),
    (MadeWith::Settings, "promise.confidence", |report| report.promise.confidence.to_string()),
    (MadeWith::Settings, "promise.same_within_m", |report| report.promise.same_within_m.to_string()),
    (MadeWith::Settings, "config.min_range_m", |report| report.config.min_range_m.to_string()),
    (MadeWith::Settings, "config.max_range_m", |report| report.config.max_range_m.to_string()),
    (MadeWith::Settings, "config.horizon_m", |report| report.config.horizon_m.to_string()),
    (MadeWith::Settings, "config.ego", |report| report.config.ego.name().to_owned()),
    (MadeWith::Settings, "config.ego_box_m", |report| format!("{:?}", report.config.ego.box_m())),
    (MadeWith::Settings, "config.voxel_m", |report| report.config.voxel_m.to_string()),
    (MadeWith::Settings, "config.tile_edge_m", |report| report.config.tile_edge_m.to_string()),
    (MadeWith::Settings, "config.disc_radius_m", |report| report.config.disc_radius_m.to_string()),
    (MadeWith::Settings, "config.miss_price", |report| report.config.miss_price.to_string()),
    (MadeWith::Settings, "config.scales", |report| format!("{:?}", report.config.scales)),
    (MadeWith::Settings, "config.sigma_m", |report| or_null(report.config.sigma_m)),
    (MadeWith::Settings, "config.depth_noise", |report| format!("{:?}", report.config.depth_noise)),
    (MadeWith::Settings, "config.segment", |report| format!("{:?}", report.config.segment)),
    (MadeWith::Vehicle, "config.ego_cells", |report| report.config.ego.cells.to_string()),
];

/// Rejects reports whose scores are not comparable.
pub(super) fn check(a: &NamedReport, b: &NamedReport) -> Result<(), JoinError> {
    let different = |what, field: String, of_a: String, of_b: String| {
        let reports = Box::new([a.file.clone(), b.file.clone()]);
        Err(JoinError::Different { reports, what, field, values: Box::new([of_a, of_b]) })
    };
    for (what, field, value) in FACTS {
        let (of_a, of_b) = (value(&a.report), value(&b.report));
        if of_a != of_b {
            return different(what, field.to_owned(), of_a, of_b);
        }
    }
    Ok(())
}

fn or_null(value: Option<impl Display>) -> String {
    value.map_or("null".to_owned(), |value| value.to_string())
}
