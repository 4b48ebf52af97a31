//! What a measurement says.

use super::Extent;

/// Distances of points from a surface, metres, each counted as the cap where it is further.
#[derive(Debug, Clone, PartialEq)]
pub struct Distances {
    /// Points measured.
    pub count: u64,
    /// Mean.
    pub mean_m: f64,
    /// Smallest distance that half of the points do not exceed.
    pub median_m: f64,
    /// Root of the mean square.
    pub rmse_m: f64,
    /// Standard deviation around the mean (of these points: divided by their number).
    pub std_m: f64,
    /// Smallest distance that 90 % of the points do not exceed.
    pub p90_m: f64,
    /// The same for 95 %.
    pub p95_m: f64,
    /// Largest; the cap where a point is further.
    pub max_m: f64,
    /// Points further than the cap.
    pub beyond_cap: u64,
    /// Points within each threshold.
    pub within: Vec<u64>,
    /// Root of the mean square of those; `None` where there is none.
    pub within_rmse_m: Vec<Option<f64>>,
}

impl Distances {
    /// Share of the points within threshold number `index`.
    pub fn share_within(&self, index: usize) -> f64 {
        self.within.get(index).copied().unwrap_or(0) as f64 / self.count as f64
    }
}

/// Accuracy and completeness at one length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtThreshold {
    /// The length t, metres.
    pub threshold_m: f64,
    /// Accuracy: share of the evaluated points within t of the reference.
    pub precision: f64,
    /// Root mean square distance of those, metres; `None` where there is none.
    pub inlier_rmse_m: Option<f64>,
    /// Completeness: share of the reference within t of the evaluated points; `None` without samples.
    pub recall: Option<f64>,
    /// 2 P R / (P + R), 0 where both are; `None` without a recall.
    pub f_score: Option<f64>,
}

/// What became of the evaluated points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvaluatedCounts {
    /// Points that were used; with thinning, more than are measured.
    pub points: u64,
    /// Points excluded: not finite, or beyond ±5e7 m.
    pub dropped: u64,
    /// Where they are, in the reference's frame.
    pub extent: Extent,
}

/// What the reference was made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceCounts {
    /// Points that were used.
    pub points: u64,
    /// Triangles that were used.
    pub triangles: u64,
    /// Points or triangles excluded: not finite, or beyond ±5e7 m.
    pub dropped: u64,
    /// Area of the triangles, square metres.
    pub area_m2: f64,
    /// Samples that stand for the triangles in the completeness, those outside the crop not counted.
    pub samples: u64,
    /// Where it is; the crop changes nothing here.
    pub extent: Extent,
}

/// How far a map lies from a reference, and how much of the reference it covers.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceReport {
    /// From each evaluated point to the reference. Its mean is the surface mean distance.
    pub accuracy: Distances,
    /// From each reference point or sample to the evaluated points; `None` where there is none: a mesh
    /// smaller than one sample.
    pub completeness: Option<Distances>,
    /// Chamfer distance: half the sum of the two means, metres.
    pub chamfer_m: Option<f64>,
    /// Precision, recall and F-score.
    pub thresholds: Vec<AtThreshold>,
    /// The evaluated points.
    pub evaluated: EvaluatedCounts,
    /// The reference.
    pub reference: ReferenceCounts,
    /// Median and percentiles are rounded down to a multiple of this, metres.
    pub resolution_m: f64,
    /// Bytes spilled to scratch files.
    pub scratch_bytes: u64,
}

pub(super) fn at_thresholds(
    thresholds_m: &[f64],
    accuracy: &Distances,
    completeness: Option<&Distances>,
) -> Vec<AtThreshold> {
    let at = |(index, &threshold_m): (usize, &f64)| {
        let precision = accuracy.share_within(index);
        let recall = completeness.map(|distances| distances.share_within(index));
        let f_score = recall.map(|recall| {
            let sum = precision + recall;
            if sum > 0.0 { 2.0 * precision * recall / sum } else { 0.0 }
        });
        let inlier_rmse_m = accuracy.within_rmse_m.get(index).copied().flatten();
        AtThreshold { threshold_m, precision, inlier_rmse_m, recall, f_score }
    };
    thresholds_m.iter().enumerate().map(at).collect()
}
