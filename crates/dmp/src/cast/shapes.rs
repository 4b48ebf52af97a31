//! Scans that are unlike those around them: where no checksum guards a log, the only sign of bytes that changed.

use dmp_sensor::{Ray, ReturnCounts};
use serde::{Deserialize, Serialize};

/// Shares of ranges are counted in half octaves from 0.25 m.
const BINS: usize = 24;
const FIRST_EXPONENT: i32 = -2;
/// Scans on either side that a scan is compared with.
const BESIDE: usize = 2;
/// Implausible ranges that one scan may have more than the scans beside it have eightfold.
const IMPLAUSIBLE: u32 = 16;
/// How many times as many returns as the median of those beside it, or as few, are unlike them.
const TIMES: u32 = 4;
/// Returns without which a share says little.
const ENOUGH: u32 = 200;
/// Share of the returns that would have to be at another range to make a scan like the nearest of those beside it: more than
/// this, and more than so many times what is usual in the log.
const APART: f64 = 0.5;
const USUAL: f64 = 4.0;

/// What is kept of a scan to compare it with others: counts, and how its ranges are spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ScanShape {
    used: u32,
    implausible: u32,
    /// Shares of the used returns, of 255.
    shares: [u8; BINS],
}

/// Counts the ranges of a scan.
#[derive(Debug, Clone, Default)]
pub(super) struct ShapeCounts {
    bins: [u32; BINS],
}

impl ShapeCounts {
    pub(super) fn add(&mut self, rays: &[Ray]) {
        for ray in rays {
            // Exponent and first bit of the mantissa: half octaves without a logarithm.
            let bits = ray.range_m.to_bits() >> 51;
            let half_octave = bits as i64 - 2 * (1023 + i64::from(FIRST_EXPONENT));
            self.bins[half_octave.clamp(0, BINS as i64 - 1) as usize] += 1;
        }
    }

    /// What was counted since the last time.
    pub(super) fn take(&mut self, counts: &ReturnCounts) -> ScanShape {
        let bins = std::mem::take(&mut self.bins);
        let used: u32 = bins.iter().sum();
        let share = |count: u32| ((255 * u64::from(count) + u64::from(used) / 2) / u64::from(used.max(1))) as u8;
        let implausible = counts.implausible().min(u64::from(u32::MAX)) as u32;
        ScanShape { used, implausible, shares: bins.map(share) }
    }
}

impl ScanShape {
    /// Share of the returns that are at another range: total variation, 0 to 1.
    fn apart(&self, other: &Self) -> f64 {
        let differences = self.shares.iter().zip(&other.shares).map(|(a, b)| u32::from(a.abs_diff(*b)));
        f64::from(differences.sum::<u32>()) / 510.0
    }
}

/// What is odd about a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Oddity {
    /// So many ranges that no sensor measures.
    Implausible(u32),
    /// So many returns where those beside it have others.
    Returns { used: u32, usual: u32 },
    /// So large a share of its returns lies at ranges that the scans beside it do not have.
    Ranges { share: f64 },
}

/// The scans of a log, each by its place in the order of time, that are unlike those before and after them. A scene that
/// changes makes a scan unlike those on one side; only a scan unlike both is odd.
pub(crate) fn odd_scans(shapes: &[ScanShape]) -> Vec<(usize, Oddity)> {
    let beside = |k: usize| {
        let (first, end) = (k.saturating_sub(BESIDE), (k + BESIDE + 1).min(shapes.len()));
        (first..end).filter(move |&other| other != k).map(|other| &shapes[other])
    };
    let median = |mut values: Vec<u32>| {
        values.sort_unstable();
        values.get(values.len() / 2).copied().unwrap_or(0)
    };
    let nearest = |k: usize| {
        let others = beside(k).filter(|other| other.used >= ENOUGH);
        others.map(|other| shapes[k].apart(other)).reduce(f64::min)
    };
    let enough = |k: &usize| shapes[*k].used >= ENOUGH;
    let mut apart: Vec<f64> = (0..shapes.len()).filter(enough).filter_map(nearest).collect();
    apart.sort_unstable_by(f64::total_cmp);
    let usual_apart = apart.get(apart.len() / 2).copied().unwrap_or(0.0);
    let odd = |k: usize| {
        let shape = &shapes[k];
        let implausible = median(beside(k).map(|other| other.implausible).collect());
        let usual = median(beside(k).map(|other| other.used).collect());
        if shape.implausible > IMPLAUSIBLE.saturating_add(implausible.saturating_mul(8)) {
            return Some(Oddity::Implausible(shape.implausible));
        }
        let (low, high) = (shape.used.min(usual), shape.used.max(usual));
        if high >= ENOUGH && high > low.saturating_mul(TIMES) {
            return Some(Oddity::Returns { used: shape.used, usual });
        }
        let share = nearest(k).filter(|_| enough(&k))?;
        (share > APART && share > USUAL * usual_apart).then_some(Oddity::Ranges { share })
    };
    // Of two scans none is the odd one.
    if shapes.len() <= BESIDE { return Vec::new() }
    (0..shapes.len()).filter_map(|k| Some((k, odd(k)?))).collect()
}
