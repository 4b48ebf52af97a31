//! Distances, as JSON.

use dmp_log::shown_path;
use dmp_truth::surface::{Distances, Extent, SurfaceReport, SurfaceSettings};
use serde::Serialize;

use crate::options::{Asked, truth};

use super::maps::{Measured, MeasuredMap};

/// What the command prints. Serialised, it is the JSON of schema `dmp-smd/1`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct SmdResult {
    pub(super) schema: &'static str,
    pub(super) dmp_version: &'static str,
    pub(super) config: ConfigResult,
    pub(super) reference: ReferenceResult,
    pub(super) maps: Vec<MapResult>,
    pub(super) timing: Timing,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ConfigResult {
    pub(super) cap_m: f64,
    pub(super) thresholds_m: Vec<f64>,
    pub(super) thin_m: Option<f64>,
    pub(super) crop: bool,
    pub(super) spacing_m: f64,
    pub(super) resolution_m: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ReferenceResult {
    pub(super) file: String,
    pub(super) format: &'static str,
    pub(super) points: u64,
    pub(super) triangles: u64,
    pub(super) dropped: u64,
    pub(super) area_m2: f64,
    pub(super) extent_m: [[f64; 3]; 2],
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct MapResult {
    pub(super) name: String,
    pub(super) format: &'static str,
    pub(super) points: u64,
    pub(super) dropped: u64,
    pub(super) extent_m: [[f64; 3]; 2],
    /// x, y, z, qx, qy, qz, qw.
    pub(super) reference_from_map: [f64; 7],
    pub(super) accuracy: DistancesResult,
    pub(super) completeness: Option<DistancesResult>,
    pub(super) chamfer_m: Option<f64>,
    pub(super) thresholds: Vec<ThresholdResult>,
    pub(super) scratch_bytes: u64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct DistancesResult {
    pub(super) count: u64,
    pub(super) mean_m: f64,
    pub(super) median_m: f64,
    pub(super) rmse_m: f64,
    pub(super) std_m: f64,
    pub(super) p90_m: f64,
    pub(super) p95_m: f64,
    pub(super) max_m: f64,
    pub(super) beyond_cap: u64,
    pub(super) beyond_cap_share: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ThresholdResult {
    pub(super) threshold_m: f64,
    pub(super) precision: f64,
    pub(super) inlier_rmse_m: Option<f64>,
    pub(super) recall: Option<f64>,
    pub(super) f_score: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Timing {
    pub(super) total_s: f64,
    pub(super) threads: usize,
}

impl SmdResult {
    pub(super) fn new(asked: &Asked, settings: &SurfaceSettings, measured: &Measured, total_s: f64) -> Self {
        let config = ConfigResult {
            cap_m: settings.cap_m,
            thresholds_m: settings.thresholds_m.clone(),
            thin_m: settings.thin_m,
            crop: settings.crop,
            spacing_m: settings.spacing_m,
            resolution_m: measured.maps.first().map_or(0.0, |map| map.report.resolution_m),
        };
        // The same for every map.
        let counts = measured.maps.first().map(|map| map.report.reference);
        let reference = ReferenceResult {
            file: asked.get(&truth::SURFACE).map(|path| shown_path(&path)).unwrap_or_default(),
            format: measured.reference_format,
            points: counts.map_or(0, |counts| counts.points),
            triangles: counts.map_or(0, |counts| counts.triangles),
            dropped: counts.map_or(0, |counts| counts.dropped),
            area_m2: counts.map_or(0.0, |counts| counts.area_m2),
            extent_m: counts.map_or([[0.0; 3]; 2], |counts| corners(&counts.extent)),
        };
        Self {
            schema: "dmp-smd/1",
            dmp_version: env!("CARGO_PKG_VERSION"),
            config,
            reference,
            maps: measured.maps.iter().map(MapResult::new).collect(),
            timing: Timing { total_s, threads: settings.threads },
        }
    }
}

fn corners(extent: &Extent) -> [[f64; 3]; 2] {
    [extent.low_m, extent.high_m]
}

impl MapResult {
    fn new(map: &MeasuredMap) -> Self {
        let SurfaceReport { accuracy, completeness, thresholds, evaluated, .. } = &map.report;
        let place = map.reference_from_map.translation.vector;
        let turn = map.reference_from_map.rotation.coords;
        let threshold = |at: &dmp_truth::surface::AtThreshold| ThresholdResult {
            threshold_m: at.threshold_m,
            precision: at.precision,
            inlier_rmse_m: at.inlier_rmse_m,
            recall: at.recall,
            f_score: at.f_score,
        };
        Self {
            name: map.name.clone(),
            format: map.format,
            points: evaluated.points,
            dropped: evaluated.dropped,
            extent_m: corners(&evaluated.extent),
            reference_from_map: [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w],
            accuracy: DistancesResult::new(accuracy),
            completeness: completeness.as_ref().map(DistancesResult::new),
            chamfer_m: map.report.chamfer_m,
            thresholds: thresholds.iter().map(threshold).collect(),
            scratch_bytes: map.report.scratch_bytes,
        }
    }
}

impl DistancesResult {
    fn new(distances: &Distances) -> Self {
        Self {
            count: distances.count,
            mean_m: distances.mean_m,
            median_m: distances.median_m,
            rmse_m: distances.rmse_m,
            std_m: distances.std_m,
            p90_m: distances.p90_m,
            p95_m: distances.p95_m,
            max_m: distances.max_m,
            beyond_cap: distances.beyond_cap,
            beyond_cap_share: distances.beyond_cap as f64 / distances.count as f64,
        }
    }
}
