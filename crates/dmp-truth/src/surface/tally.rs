//! Distances as whole numbers: exact sums and quantiles in any order.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use super::{Distances, SurfaceSettings};

/// Distances are rounded to 2⁻²⁰ m, about a micrometre, before anything is summed: integers add up to the
/// same in any order.
pub(super) const UNITS_PER_M: f64 = 1_048_576.0;
/// Most bins of the histogram that median and percentiles come from.
const MAX_BINS: u64 = 1 << 20;

pub(super) fn units(metres: f64) -> u64 {
    (metres * UNITS_PER_M).round() as u64
}

/// Sums of capped distances.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Sums {
    pub(super) count: u64,
    beyond: u64,
    sum: u128,
    squares: u128,
    max: u64,
    /// For each threshold how many are within it, and the sum of their squares.
    within: Vec<(u64, u128)>,
}

/// Collects the distances of one direction, from any number of threads.
#[derive(Debug)]
pub(super) struct Tally {
    cap_m: f64,
    cap_units: u64,
    thresholds_units: Vec<u64>,
    /// A bin is 2^shift units wide.
    shift: u32,
    bins: Vec<AtomicU64>,
    sums: Mutex<Sums>,
}

impl Tally {
    pub(super) fn new(settings: &SurfaceSettings) -> Self {
        let cap_units = units(settings.cap_m);
        let mut shift = 0;
        while cap_units >> shift > MAX_BINS {
            shift += 1;
        }
        let bins = (0..=cap_units >> shift).map(|_| AtomicU64::new(0)).collect();
        let thresholds_units: Vec<u64> = settings.thresholds_m.iter().map(|&t| units(t)).collect();
        let within = vec![(0, 0); thresholds_units.len()];
        let sums = Mutex::new(Sums { within, ..Sums::default() });
        Self { cap_m: settings.cap_m, cap_units, thresholds_units, shift, bins, sums }
    }

    /// Empty sums for a thread to fill.
    pub(super) fn sums(&self) -> Sums {
        Sums { within: vec![(0, 0); self.thresholds_units.len()], ..Sums::default() }
    }

    /// Adds a squared distance; `None` where nothing was found at all.
    pub(super) fn add(&self, sums: &mut Sums, squared_m2: Option<f64>) {
        let distance_m = squared_m2.map_or(f64::INFINITY, f64::sqrt);
        // Compared before rounding: what is further than the cap is beyond it by however little.
        let beyond = distance_m > self.cap_m;
        self.add_many(sums, if beyond { self.cap_units } else { units(distance_m) }, beyond, 1);
    }

    /// Adds points that are known to have nothing within the cap.
    pub(super) fn add_beyond(&self, sums: &mut Sums, count: u64) {
        if count > 0 {
            self.add_many(sums, self.cap_units, true, count);
        }
    }

    fn add_many(&self, sums: &mut Sums, distance: u64, beyond: bool, count: u64) {
        let square = u128::from(distance).pow(2) * u128::from(count);
        sums.count += count;
        sums.beyond += if beyond { count } else { 0 };
        sums.sum += u128::from(distance) * u128::from(count);
        sums.squares += square;
        sums.max = sums.max.max(distance);
        for (within, &threshold) in sums.within.iter_mut().zip(&self.thresholds_units) {
            if distance <= threshold && !beyond {
                within.0 += count;
                within.1 += square;
            }
        }
        self.bins[(distance >> self.shift) as usize].fetch_add(count, Ordering::Relaxed);
    }

    /// Adds what a thread has gathered.
    pub(super) fn merge(&self, part: &Sums) {
        let mut sums = self.sums.lock().unwrap_or_else(PoisonError::into_inner);
        sums.count += part.count;
        sums.beyond += part.beyond;
        sums.sum += part.sum;
        sums.squares += part.squares;
        sums.max = sums.max.max(part.max);
        for (total, part) in sums.within.iter_mut().zip(&part.within) {
            total.0 += part.0;
            total.1 += part.1;
        }
    }

    /// Smallest distance that at least this share of the points does not exceed, in units, rounded down
    /// to a bin.
    fn quantile(&self, count: u64, share: f64) -> u64 {
        let wanted = ((share * count as f64).ceil() as u64).clamp(1, count);
        let mut seen = 0;
        for (bin, in_bin) in self.bins.iter().enumerate() {
            seen += in_bin.load(Ordering::Relaxed);
            if seen >= wanted {
                return (bin as u64) << self.shift;
            }
        }
        self.cap_units
    }

    /// Width of the bins behind median and percentiles, metres.
    pub(super) fn resolution_m(&self) -> f64 {
        (1_u64 << self.shift) as f64 / UNITS_PER_M
    }

    /// The distances; `None` where there is not one.
    pub(super) fn distances(&self) -> Option<Distances> {
        let sums = self.sums.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let count = sums.count;
        if count == 0 {
            return None;
        }
        let n = count as f64;
        let root_m = |squares: f64| squares.sqrt() / UNITS_PER_M;
        // n Σd² − (Σd)² is exact in integers and never negative.
        let spread = u128::from(count) * sums.squares - sums.sum * sums.sum;
        let quantile_m = |share| self.quantile(count, share) as f64 / UNITS_PER_M;
        let within_rmse =
            |&(within, squares): &(u64, u128)| (within > 0).then(|| root_m(squares as f64 / within as f64));
        Some(Distances {
            count,
            mean_m: sums.sum as f64 / n / UNITS_PER_M,
            median_m: quantile_m(0.5),
            rmse_m: root_m(sums.squares as f64 / n),
            std_m: root_m(spread as f64) / n,
            p90_m: quantile_m(0.9),
            p95_m: quantile_m(0.95),
            max_m: sums.max as f64 / UNITS_PER_M,
            beyond_cap: sums.beyond,
            within: sums.within.iter().map(|&(within, _)| within).collect(),
            within_rmse_m: sums.within.iter().map(within_rmse).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tally_of(cap_m: f64, distances_m: &[f64]) -> Tally {
        let settings = SurfaceSettings { cap_m, thresholds_m: vec![0.1, 0.5], ..SurfaceSettings::default() };
        let tally = Tally::new(&settings);
        for part in distances_m.chunks(3) {
            let mut sums = tally.sums();
            part.iter().for_each(|&d| tally.add(&mut sums, Some(d * d)));
            tally.merge(&sums);
        }
        tally
    }

    #[test]
    fn the_cap_itself_is_not_beyond_and_nothing_found_is() {
        let tally = tally_of(0.5, &[0.5, 0.500_000_1]);
        let mut sums = tally.sums();
        tally.add(&mut sums, None);
        tally.add_beyond(&mut sums, 7);
        tally.merge(&sums);
        let distances = tally.distances().unwrap();
        assert_eq!((distances.count, distances.beyond_cap, distances.mean_m), (10, 9, 0.5));
        // Within a threshold as large as the cap lies what is not beyond it.
        assert_eq!(distances.within, [0, 1]);
        assert_eq!(distances.within_rmse_m, [None, Some(0.5)]);
        assert!(tally_of(1.0, &[]).distances().is_none());
    }

    #[test]
    fn a_large_cap_costs_resolution_not_memory() {
        let tally = tally_of(100.0, &[99.0; 5]);
        assert!(tally.bins.len() as u64 <= MAX_BINS + 1);
        let median_m = tally.distances().unwrap().median_m;
        assert!(median_m <= 99.0 && 99.0 - median_m < tally.resolution_m());
    }
}
