//! Distances, their quantiles, and where they are largest.

use serde::{Deserialize, Serialize};

/// Distances between the points of two runs: each is the root mean square over the returns of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spread {
    /// Pairs of scans.
    pub pairs: u64,
    /// Their median, metres.
    pub median_m: f64,
    /// 95 % of them are at most this, metres.
    pub most_m: f64,
    /// The same of the place where it is largest, metres. A place is 20 m of travel, in a room 2 m.
    pub worst_m: f64,
    /// The scans of that place: the first and the last.
    pub worst_scans: [u64; 2],
}

/// Of distances with their places and scans, ordered by place.
pub(super) struct Distances {
    all_m: Vec<f32>,
    of_place_m: Vec<f32>,
    scans: [u64; 2],
    worst: Option<(f64, [u64; 2])>,
}

impl Distances {
    pub(super) fn new() -> Self {
        Self { all_m: Vec::new(), of_place_m: Vec::new(), scans: [u64::MAX, 0], worst: None }
    }

    pub(super) fn add(&mut self, distance_m: f64, scans: [u64; 2]) {
        self.of_place_m.push(distance_m as f32);
        self.scans = [self.scans[0].min(scans[0]), self.scans[1].max(scans[1])];
    }

    pub(super) fn end_place(&mut self) {
        if let Some(most_m) = quantile(&mut self.of_place_m, 0.95)
            && self.worst.is_none_or(|(worst_m, _)| most_m > worst_m)
        {
            self.worst = Some((most_m, self.scans));
        }
        self.all_m.append(&mut self.of_place_m);
        self.scans = [u64::MAX, 0];
    }

    pub(super) fn spread(mut self) -> Option<Spread> {
        self.end_place();
        let (worst_m, worst_scans) = self.worst?;
        Some(Spread {
            pairs: self.all_m.len() as u64,
            median_m: quantile(&mut self.all_m, 0.5)?,
            most_m: quantile(&mut self.all_m, 0.95)?,
            worst_m,
            worst_scans,
        })
    }
}

/// The smallest of the numbers that at least this share of them does not exceed.
fn quantile(numbers: &mut [f32], share: f64) -> Option<f64> {
    let rank = ((share * numbers.len() as f64).ceil() as usize).checked_sub(1)?;
    let (_, number, _) = numbers.select_nth_unstable_by(rank, f32::total_cmp);
    Some(f64::from(*number))
}
