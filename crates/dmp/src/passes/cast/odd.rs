//! Detects scans unlike the others: the only sign of changed bytes in a log without checksums.

use dmp_lengths::thousands;
use std::fmt;

use super::rows::{median, off_in_rows, ratio};
use crate::drawn::{ScanShape, half_octave_m};

/// Neighbours on either side that a scan is compared with.
const BESIDE: usize = 2;
/// Implausible ranges that one scan may have beyond eight times the usual number.
const IMPLAUSIBLE: u32 = 16;
/// Half octaves from 1 m on at which ranges end later than those of most sensors, and the excess over those
/// of the log.
const FAR: u8 = 18;
const FARTHER: u8 = 8;
/// With fewer returns a share is not significant.
const ENOUGH: u32 = 200;
/// Least relative excess of the larger of two numbers of returns, a scan's own and the median of its
/// neighbours. It must also exceed the usual excess in the log this many times.
const MORE: f64 = 0.75;
const USUAL_MORE: f64 = 10.0;
/// Least share of returns at other ranges than in the nearest neighbour scan; with the same condition.
const APART: f64 = 0.35;
const USUAL_APART: f64 = 4.0;

/// One scan unlike the others, or several in a row with the same oddity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OddScans {
    /// Its number in the log, or that of the first of several.
    pub scan: usize,
    /// Number of the last.
    pub last: usize,
    /// The largest oddity of them.
    pub oddity: Oddity,
}

/// How a scan differs.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Oddity {
    /// This many ranges that no sensor measures.
    Implausible(u32),
    /// Ranges far beyond those of most scans.
    Far {
        /// The end of its ranges, except for a few, at least, metres.
        end_m: f64,
        /// The end of the ranges of most scans, at most, metres.
        usual_m: f64,
    },
    /// A number of returns unlike that of its neighbours, or of most scans.
    Returns {
        /// Its own.
        returns: u32,
        /// Those of the others.
        usual: u32,
    },
    /// A large share of its returns lies at ranges that its neighbours do not have.
    Ranges {
        /// As a fraction.
        share: f64,
    },
}

impl fmt::Display for OddScans {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scan, last, oddity } = self;
        let up_to = if scan == last {
            write!(f, "scan {scan} has ")?;
            ""
        } else {
            write!(f, "scans {scan} to {last} have ")?;
            if matches!(oddity, Oddity::Returns { returns, usual } if returns < usual) {
                "down to "
            } else {
                "up to "
            }
        };
        match oddity {
            Oddity::Implausible(count) => {
                write!(f, "{up_to}{} ranges below 1 mm or above 100 km", thousands(count))
            }
            Oddity::Far { end_m, usual_m } => {
                write!(f, "ranges beyond {end_m:.0} m where those of most scans end before {usual_m:.0} m")
            }
            Oddity::Returns { returns, usual } => {
                let (returns, usual) = (thousands(returns), thousands(usual));
                write!(f, "{up_to}{returns} returns where about {usual} are usual")
            }
            Oddity::Ranges { share } => {
                write!(f, "{up_to}{:.0} % of its returns at other ranges than those beside it", 100.0 * share)
            }
        }
    }
}

impl Oddity {
    /// The larger of two oddities of a kind; `None` if they differ in kind.
    fn odder(self, other: Self) -> Option<Self> {
        let other_is_odder = match (self, other) {
            (Self::Implausible(a), Self::Implausible(b)) => b > a,
            (Self::Far { end_m: a, .. }, Self::Far { end_m: b, .. })
            | (Self::Ranges { share: a }, Self::Ranges { share: b }) => b > a,
            (Self::Returns { returns: a, usual: u }, Self::Returns { returns: b, usual: v }) => {
                match (a < u, b < v) {
                    (true, true) => b < a,
                    (false, false) => b > a,
                    _ => return None,
                }
            }
            _ => return None,
        };
        Some(if other_is_odder { other } else { self })
    }
}

/// Merges consecutive scans of one kind, by their numbers.
pub(super) fn in_rows(odd: impl IntoIterator<Item = (usize, Oddity)>) -> Vec<OddScans> {
    let mut rows: Vec<OddScans> = Vec::new();
    for (scan, oddity) in odd {
        if let Some(row) = rows.last_mut()
            && row.last + 1 == scan
            && let Some(odder) = row.oddity.odder(oddity)
        {
            (row.last, row.oddity) = (scan, odder);
        } else {
            rows.push(OddScans { scan, last: scan, oddity });
        }
    }
    rows
}

/// The scans of a log, given in order of time, that are unlike those before and after them, or have numbers
/// that few scans have. A change of scene makes a scan unlike one side; only a scan unlike both sides is odd.
pub(super) fn odd_scans(shapes: &[ScanShape]) -> Vec<(usize, Oddity)> {
    // With two scans, neither can be the odd one.
    if shapes.len() <= BESIDE {
        return Vec::new();
    }
    let beside = |k: usize| {
        let (first, end) = (k.saturating_sub(BESIDE), (k + BESIDE + 1).min(shapes.len()));
        (first..end).filter(move |&other| other != k).map(|other| &shapes[other])
    };
    let usual_implausible_beside = |k: usize| median(beside(k).map(|shape| shape.implausible).collect());
    // An even number of neighbours has two medians: take the nearer, since neighbours of an odd scan are
    // compared too.
    let usual_returns_beside = |k: usize| {
        let mut all: Vec<u32> = beside(k).map(|shape| shape.returns).collect();
        all.sort_unstable();
        let (low, high) = (all[(all.len() - 1) / 2], all[all.len() / 2]);
        let own = shapes[k].returns;
        if ratio(own, low) < ratio(own, high) { low } else { high }
    };
    let more = |k: usize| ratio(shapes[k].returns, usual_returns_beside(k)) - 1.0;
    let apart = |k: usize| {
        let others = beside(k).filter(|other| other.returns >= ENOUGH);
        let nearest = others.map(|other| shapes[k].apart(other)).reduce(f64::min);
        nearest.filter(|_| shapes[k].returns >= ENOUGH).unwrap_or(0.0)
    };
    let usual_of = |of: &dyn Fn(usize) -> f64| {
        let mut all: Vec<f64> = (0..shapes.len()).map(of).collect();
        all.sort_unstable_by(f64::total_cmp);
        all[all.len() / 2]
    };
    let (most, farthest) =
        (MORE.max(USUAL_MORE * usual_of(&more)), APART.max(USUAL_APART * usual_of(&apart)));
    let of_log = |of: fn(&ScanShape) -> u32| median(shapes.iter().map(of).collect());
    let (usual_implausible, usual_end) =
        (of_log(|shape| shape.implausible), of_log(|shape| shape.end.into()) as u8);
    let returns: Vec<u32> = shapes.iter().map(|shape| shape.returns).collect();
    let (usual_returns, in_rows) = (of_log(|shape| shape.returns), off_in_rows(&returns));
    let odd = |k: usize| {
        let shape = &shapes[k];
        let implausible = usual_implausible.min(usual_implausible_beside(k));
        // The first and last scan may be partial, or lie at a change of scene.
        let (has_both, returns) = (k > 0 && k + 1 < shapes.len(), usual_returns_beside(k));
        if shape.implausible > IMPLAUSIBLE.saturating_add(implausible.saturating_mul(8)) {
            Some(Oddity::Implausible(shape.implausible))
        } else if shape.end >= FAR.max(usual_end.saturating_add(FARTHER)) {
            Some(Oddity::Far { end_m: half_octave_m(shape.end), usual_m: half_octave_m(usual_end + 1) })
        } else if in_rows[k] {
            Some(Oddity::Returns { returns: shape.returns, usual: usual_returns })
        } else if has_both && shape.returns.max(returns) >= ENOUGH && more(k) > most {
            Some(Oddity::Returns { returns: shape.returns, usual: returns })
        } else {
            let share = Some(apart(k)).filter(|&share| has_both && share > farthest);
            share.map(|share| Oddity::Ranges { share })
        }
    };
    (0..shapes.len()).filter_map(|k| Some((k, odd(k)?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::Scan;

    fn shape(ranges_m: impl Iterator<Item = f64>, implausible: u32) -> ScanShape {
        let points_in_sensor_m = ranges_m.map(|range_m| [range_m as f32, 0.0, 0.0]).collect();
        let mut shape = ScanShape::of(&Scan { points_in_sensor_m, ..Scan::default() });
        shape.implausible = implausible;
        shape
    }

    /// A scan among walls at a distance.
    fn street(width_m: f64, returns: usize) -> ScanShape {
        shape((0..returns).map(|k| width_m * (1.0 + k as f64 / returns as f64)), 0)
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
        // Scans so far apart that no two neighbours are alike.
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
        // The last may lie at a change of scene.
        shapes[59] = street(60.0, 20_000);
        let odd = odd_scans(&shapes);
        let places: Vec<usize> = odd.iter().map(|&(k, _)| k).collect();
        assert_eq!(places, [10, 20, 30, 40]);
        assert!(matches!(odd[0].1, Oddity::Ranges { share } if share > 0.9));
        assert_eq!(odd[1].1, Oddity::Returns { returns: 3_000, usual: 20_000 });
        assert_eq!(odd[2].1, Oddity::Implausible(40));
    }

    #[test]
    fn rows_of_odd_scans_are_found_by_what_is_usual_in_the_log() {
        let mut shapes: Vec<_> = (0..60).map(|k| street(5.0 + 0.1 * f64::from(k), 20_000)).collect();
        for k in 10..15 {
            shapes[k].implausible = 40 + k as u32;
            shapes[k + 10] = street(5.0, 3_000 - k);
            shapes[k + 20] = street(900.0, 20_000);
        }
        let odd = in_rows(odd_scans(&shapes));
        let rows: Vec<_> = odd.iter().map(|row| (row.scan, row.last)).collect();
        assert_eq!(rows, [(10, 14), (20, 24), (30, 34)]);
        let words = [
            "scans 10 to 14 have up to 54 ranges below 1 mm or above 100 km",
            "scans 20 to 24 have down to 2,986 returns where about 20,000 are usual",
            "scans 30 to 34 have ranges beyond 1448 m where those of most scans end before 23 m",
        ];
        assert_eq!(odd.iter().map(ToString::to_string).collect::<Vec<_>>(), words);
    }
}
