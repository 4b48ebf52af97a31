//! Scans that are unlike those around them: where no checksum guards a log, the only sign of bytes that changed.

use std::fmt;

use dmp_sensor::{DropReason, Ray, ReturnCounts};
use serde::{Deserialize, Serialize};

/// Shares of ranges are counted in half octaves from 0.25 m.
const BINS: usize = 24;
const FIRST_EXPONENT: i32 = -2;
/// Scans on either side that a scan is compared with.
const BESIDE: usize = 2;
/// Implausible ranges that one scan may have more than the scans beside it have eightfold.
const IMPLAUSIBLE: u32 = 16;
/// Returns without which a share says little.
const ENOUGH: u32 = 200;
/// How much more, as a share, the larger of two numbers of returns is, a scan's own and the median of those beside it: more
/// than this, and more than so many times what is usual in the log.
const MORE: f64 = 0.75;
const USUAL_MORE: f64 = 10.0;
/// Share of the returns that would have to be at another range to make a scan like the nearest of those beside it, likewise.
const APART: f64 = 0.35;
const USUAL_APART: f64 = 4.0;

/// What is kept of a scan to compare it with others: counts, and how its ranges are spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ScanShape {
    /// Points where something came back.
    returns: u32,
    /// Returns that are posed and have a plausible range.
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
        let share =
            |count: u32| ((255 * u64::from(count) + u64::from(used) / 2) / u64::from(used.max(1))) as u8;
        let nothing = counts.dropped(DropReason::NonFinite) + counts.dropped(DropReason::NoReturn);
        let [returns, implausible] = [counts.total() - nothing, counts.implausible()]
            .map(|count| count.min(u64::from(u32::MAX)) as u32);
        ScanShape { returns, used, implausible, shares: bins.map(share) }
    }
}

impl ScanShape {
    /// Share of the returns that are at another range: total variation, 0 to 1.
    fn apart(&self, other: &Self) -> f64 {
        let differences = self.shares.iter().zip(&other.shares).map(|(a, b)| u32::from(a.abs_diff(*b)));
        f64::from(differences.sum::<u32>()) / 510.0
    }
}

/// A scan that is unlike those before and after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OddScan {
    /// Its number in the log.
    pub scan: usize,
    /// What is odd about it.
    pub oddity: Oddity,
}

/// What is odd about a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Oddity {
    /// So many ranges that no sensor measures.
    Implausible(u32),
    /// So many returns where those beside it have others.
    Returns {
        /// Its own.
        returns: u32,
        /// Those of the scans beside it.
        usual: u32,
    },
    /// So large a share of its returns lies at ranges that the scans beside it do not have.
    Ranges {
        /// Of 1.
        share: f64,
    },
}

impl fmt::Display for OddScan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "scan {} has ", self.scan)?;
        match self.oddity {
            Oddity::Implausible(count) => write!(f, "{count} ranges below 1 mm or above 100 km"),
            Oddity::Returns { returns, usual } => {
                write!(f, "{returns} returns where they have about {usual}")
            }
            Oddity::Ranges { share } => write!(f, "{:.0} % of its returns at other ranges", 100.0 * share),
        }
    }
}

/// The scans of a log, each by its place in the order of time, that are unlike those before and after them. A scene that
/// changes makes a scan unlike those on one side; only a scan unlike both is odd.
pub(crate) fn odd_scans(shapes: &[ScanShape]) -> Vec<(usize, Oddity)> {
    // Of two scans none is the odd one.
    if shapes.len() <= BESIDE {
        return Vec::new();
    }
    let beside = |k: usize| {
        let (first, end) = (k.saturating_sub(BESIDE), (k + BESIDE + 1).min(shapes.len()));
        (first..end).filter(move |&other| other != k).map(|other| &shapes[other])
    };
    let usual = |k: usize, of: fn(&ScanShape) -> u32| median(beside(k).map(of).collect());
    let more = |k: usize| {
        let (own, usual) = (shapes[k].returns, usual(k, |shape| shape.returns));
        f64::from(own.max(usual)) / f64::from(own.min(usual).max(1)) - 1.0
    };
    let apart = |k: usize| {
        let others = beside(k).filter(|other| other.used >= ENOUGH);
        let nearest = others.map(|other| shapes[k].apart(other)).reduce(f64::min);
        nearest.filter(|_| shapes[k].used >= ENOUGH).unwrap_or(0.0)
    };
    let usual_of = |of: &dyn Fn(usize) -> f64| {
        let mut all: Vec<f64> = (0..shapes.len()).map(of).collect();
        all.sort_unstable_by(f64::total_cmp);
        all[all.len() / 2]
    };
    let (most, farthest) =
        (MORE.max(USUAL_MORE * usual_of(&more)), APART.max(USUAL_APART * usual_of(&apart)));
    let odd = |k: usize| {
        let (shape, implausible) = (&shapes[k], usual(k, |shape| shape.implausible));
        // The first and the last scan may be parts, or where the scene changes.
        let (has_both, returns) = (k > 0 && k + 1 < shapes.len(), usual(k, |shape| shape.returns));
        if shape.implausible > IMPLAUSIBLE.saturating_add(implausible.saturating_mul(8)) {
            Some(Oddity::Implausible(shape.implausible))
        } else if has_both && shape.returns.max(returns) >= ENOUGH && more(k) > most {
            Some(Oddity::Returns { returns: shape.returns, usual: returns })
        } else {
            let share = Some(apart(k)).filter(|&share| has_both && share > farthest);
            share.map(|share| Oddity::Ranges { share })
        }
    };
    (0..shapes.len()).filter_map(|k| Some((k, odd(k)?))).collect()
}

fn median(mut values: Vec<u32>) -> u32 {
    values.sort_unstable();
    values.get(values.len() / 2).copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(ranges_m: impl Iterator<Item = f64>, implausible: u32) -> ScanShape {
        let ray = |range_m| Ray { origin_in_world: [0.0; 3], direction_in_world: [1.0, 0.0, 0.0], range_m };
        let rays: Vec<Ray> = ranges_m.map(ray).collect();
        let mut counts = ShapeCounts::default();
        counts.add(&rays);
        ScanShape { returns: rays.len() as u32, implausible, ..counts.take(&ReturnCounts::default()) }
    }

    /// A scan among walls at a distance.
    fn street(width_m: f64, returns: usize) -> ScanShape {
        shape((0..returns).map(|k| width_m * (1.0 + k as f64 / returns as f64)), 0)
    }

    #[test]
    fn half_octaves_are_told_apart() {
        let bin =
            |range_m: f64| shape(std::iter::once(range_m), 0).shares.iter().position(|&share| share == 255);
        assert_eq!(
            [0.001, 0.25, 0.37, 0.38, 0.5, 0.75, 1.0, 1e9].map(bin),
            [0, 0, 0, 1, 2, 3, 4, BINS - 1].map(Some)
        );
        let empty = ShapeCounts::default().take(&ReturnCounts::default());
        assert_eq!((empty.used, empty.shares), (0, [0; BINS]));
    }

    /// The null: a scene that changes, slowly or from one scan to the next, has no odd scans.
    #[test]
    fn a_scene_that_changes_has_no_odd_scans() {
        let widens = (0..100).map(|k| street(5.0 * 1.05f64.powi(k), 20_000 - 100 * k as usize));
        assert_eq!(odd_scans(&widens.collect::<Vec<_>>()), []);
        let opens = (0..100).map(|k| street(if k < 50 { 5.0 } else { 60.0 }, 20_000));
        assert_eq!(odd_scans(&opens.collect::<Vec<_>>()), []);
        for at in [1, 59] {
            let opens_at_an_end = (0..60).map(|k| street(if k < at { 5.0 } else { 60.0 }, 20_000));
            assert_eq!(odd_scans(&opens_at_an_end.collect::<Vec<_>>()), []);
        }
        // Scans so far apart that none is like the one before.
        let thinned = (0..100).map(|k| street([4.0, 16.0, 64.0, 8.0, 32.0][k % 5], 20_000));
        assert_eq!(odd_scans(&thinned.collect::<Vec<_>>()), []);
        let few = (0..100).map(|k| street(1.0 + f64::from(k * 37 % 50), 100));
        assert_eq!(odd_scans(&few.collect::<Vec<_>>()), []);
        for count in 0..3 {
            let all: Vec<_> = (0..count).map(|k| street(5.0, 1000 * (1 + 9 * k))).collect();
            assert_eq!(odd_scans(&all), []);
        }
    }

    #[test]
    fn a_scan_unlike_those_on_both_sides_is_odd() {
        let mut shapes: Vec<_> = (0..60).map(|k| street(5.0 + 0.1 * f64::from(k), 20_000)).collect();
        shapes[10] = street(60.0, 20_000);
        shapes[20] = street(5.0, 3_000);
        shapes[30].implausible = 40;
        shapes[40] = street(60.0, 20_000);
        // The last may be where the scene changes.
        shapes[59] = street(60.0, 20_000);
        let odd = odd_scans(&shapes);
        let places: Vec<usize> = odd.iter().map(|&(k, _)| k).collect();
        assert_eq!(places, [10, 20, 30, 40]);
        assert!(matches!(odd[0].1, Oddity::Ranges { share } if share > 0.9));
        assert_eq!(odd[1].1, Oddity::Returns { returns: 3_000, usual: 20_000 });
        assert_eq!(odd[2].1, Oddity::Implausible(40));
    }
}
