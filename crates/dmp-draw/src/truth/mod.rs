//! Runs compared with ground truth, drawn: where, when and by how much they are off.

mod curves;
mod picture;
#[cfg(test)]
pub(crate) mod tests;
mod ways;

pub(crate) use curves::{LEVELS, Over, angles, error_over, errors_of_all, places, shares_of_all};
pub use picture::truth_picture;
pub(crate) use ways::{Side, coloured_way, ways_of_all};

/// A comparison with ground truth, to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthPlots {
    /// `APE` or `RPE`.
    pub metric: String,
    /// What the errors are and how runs were aligned, line by line.
    pub title: String,
    /// The name of the reference.
    pub reference: String,
    /// What errors are in; empty for a number without a unit.
    pub unit: String,
    /// Whether poses have times; else they have numbers.
    pub has_stamps: bool,
    /// The runs, in the order given.
    pub runs: Vec<TruthRun>,
    /// What was guessed or is odd.
    pub notes: Vec<String>,
    /// The version of the command.
    pub dmp_version: String,
}

/// A run beside the reference.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthRun {
    /// Its name.
    pub name: String,
    /// The poses that were compared, in the order of the file.
    pub poses: Vec<TruthPose>,
    /// Errors, each with the number of the pose it belongs to: of a pair the later one.
    pub errors: Vec<(usize, f64)>,
    /// Their statistics.
    pub stats: TruthStats,
}

/// A pose of a run and that of the reference at the same time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruthPose {
    /// Seconds after the first pose of all runs, or the number of the pose.
    pub at: f64,
    /// The reference's way up to here, metres.
    pub way_m: f64,
    /// The places of reference and run, metres.
    pub positions_m: [[f64; 3]; 2],
    /// Roll, pitch and yaw of reference and run (fixed axes x, y, z), degrees.
    pub roll_pitch_yaw_deg: [[f64; 3]; 2],
}

/// Statistics of errors, in their unit; `sse` in its square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruthStats {
    /// Root of the mean square.
    pub rmse: f64,
    /// Mean.
    pub mean: f64,
    /// Median.
    pub median: f64,
    /// Standard deviation.
    pub std: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Sum of squares.
    pub sse: f64,
}

impl TruthStats {
    /// Names and values, those first that are looked at first.
    pub fn named(&self) -> [(&'static str, f64); 7] {
        [
            ("rmse", self.rmse),
            ("mean", self.mean),
            ("median", self.median),
            ("std", self.std),
            ("min", self.min),
            ("max", self.max),
            ("sse", self.sse),
        ]
    }
}

impl TruthPlots {
    /// Errors from here on have the worst colour: of the run in the middle all but the largest fiftieth are below. So neither a
    /// very bad run nor a very good one takes the colours from the others.
    pub(crate) fn top(&self) -> f64 {
        let top = |run: &TruthRun| {
            let mut errors: Vec<f64> = run.errors.iter().map(|error| error.1).collect();
            let at = errors.len() * 49 / 50;
            (!errors.is_empty()).then(|| *errors.select_nth_unstable_by(at, f64::total_cmp).1)
        };
        let mut tops: Vec<f64> = self.runs.iter().filter_map(top).collect();
        tops.sort_by(f64::total_cmp);
        tops.get(tops.len() / 2).copied().unwrap_or(0.0)
    }

    /// What stands beside the axis of errors.
    pub(crate) fn error_axis(&self) -> String {
        if self.unit.is_empty() { self.metric.clone() } else { format!("{} [{}]", self.metric, self.unit) }
    }

    /// An error with its unit.
    pub(crate) fn with_unit(&self, error: f64) -> String {
        let digits = crate::text::digits(error);
        if self.unit.is_empty() { digits } else { format!("{digits} {}", self.unit) }
    }

    /// What stands below an axis of time.
    pub(crate) fn time_axis(&self) -> &'static str {
        if self.has_stamps { "time [s]" } else { "pose" }
    }
}
