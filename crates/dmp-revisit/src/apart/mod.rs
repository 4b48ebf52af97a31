//! How far apart two runs of one log put the same point, by their poses alone.
//!
//! Two runs place scan j against scan i by `A = A_i⁻¹ A_j` and `B = B_i⁻¹ B_j`. A return p of scan j is then put
//! `|A p − B p|` apart.
//! No map, no residual and nothing that moves takes part, and a rigid motion of a run changes nothing.

mod back;
mod between;
mod moments;
mod spread;
mod way;
mod within;

pub use back::share_back;
pub use moments::{MomentSums, Moments};
pub use spread::Spread;
pub use way::Ruler;

use std::fmt;

use dmp_reduce::Basis;
use dmp_sensor::{Isometry3, along_m};
use serde::{Deserialize, Serialize};

use way::{OnWay, ScanInBoth};

/// How far apart two runs put the same points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Apart {
    /// Scans for which both runs have a pose.
    pub scans: u64,
    /// Scans for which only one of them has a pose.
    pub scans_of_one: u64,
    /// Over scans up to 20 m of travel apart, in a room 2 m.
    pub within: Spread,
    /// Over scans of different visits, up to 5 m apart in either run, in a room 0.5 m. Null where there are none.
    pub between: Option<Spread>,
}

impl Apart {
    /// Of scans in the order of time: the number of each in the log, and the pose of the sensor in each run, in any frame of the
    /// run. `None` where both have poses for fewer than two.
    pub fn of_poses(
        scans: impl Iterator<Item = (u64, [Option<Isometry3<f64>>; 2])>,
        ruler: &Ruler,
    ) -> Option<Self> {
        let (mut both, mut of_one) = (Vec::new(), 0);
        for (scan, poses) in scans {
            match poses {
                [Some(a), Some(b)] => both.push(ScanInBoth { scan, run_from_sensor: [a, b] }),
                [None, None] => {}
                _ => of_one += 1,
            }
        }
        Self::of(&both, of_one, ruler)
    }

    /// Of the scans that both runs have.
    fn of(scans: &[ScanInBoth], scans_of_one: u64, ruler: &Ruler) -> Option<Self> {
        let places = |run: usize| {
            scans
                .iter()
                .map(move |scan| Some(scan.run_from_sensor[run].translation.vector))
                .collect::<Vec<_>>()
        };
        let [a_m, b_m] = [0, 1].map(|run| along_m(&places(run), ruler.metre_m));
        let on_way = |((scan, a_m), b_m): ((_, f64), f64)| OnWay { scan, along_m: 0.5 * (a_m + b_m) };
        let scans: Vec<OnWay<'_>> = scans.iter().zip(a_m).zip(b_m).map(on_way).collect();
        let within = within::spread(&scans, ruler)?;
        let between = between::spread(&scans, ruler);
        Some(Self { scans: scans.len() as u64, scans_of_one, within, between })
    }

    /// Whether the runs of a pair are the same for practical purposes: at every place 95 % lie within this length in one visit, metres,
    /// and within twice as much between visits; and one run alone has a pose for no more than one scan in ten.
    /// Of a given map poses do not say how it fits.
    pub fn is_same(&self, basis: Basis, within_m: f64) -> bool {
        let is_alike = 10 * self.scans_of_one <= self.scans;
        basis == Basis::CrossValidated
            && is_alike
            && self.within.worst_m <= within_m
            && self.between.is_none_or(|spread| spread.worst_m <= 2.0 * within_m)
    }

    /// The largest distance at any place, metres, and whether it is between visits.
    pub fn worst(&self) -> (f64, bool) {
        match self.between {
            Some(between) if between.worst_m > self.within.worst_m => (between.worst_m, true),
            _ => (self.within.worst_m, false),
        }
    }

    /// Where that is: the first and the last scan of the place.
    pub fn worst_scans(&self) -> [u64; 2] {
        match self.between {
            Some(between) if self.worst().1 => between.worst_scans,
            _ => self.within.worst_scans,
        }
    }
}

/// `scan 7`, or `scans 120 to 160`.
fn scans_in_words([first, last]: [u64; 2]) -> String {
    if first == last { format!("scan {first}") } else { format!("scans {first} to {last}") }
}

/// `up to 1.2 cm apart along the way, 41 cm between visits (scans 120 to 160)`: at the worst place, and which that is.
impl fmt::Display for Apart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (_, is_between) = self.worst();
        let at = |is_there| {
            if is_there { format!(" ({})", scans_in_words(self.worst_scans())) } else { String::new() }
        };
        write!(f, "up to {} apart along the way{}", short_length(self.within.worst_m), at(!is_between))?;
        let Some(between) = &self.between else { return Ok(()) };
        write!(f, ", {} between visits{}", short_length(between.worst_m), at(is_between))
    }
}

/// A length with two digits: below a metre in centimetres.
pub fn short_length(length_m: f64) -> String {
    match length_m {
        m if m < 5e-5 => "0 cm".to_owned(),
        m if m < 0.0995 => format!("{:.1} cm", 100.0 * m),
        m if m < 0.995 => format!("{:.0} cm", 100.0 * m),
        m if m < 9.95 => format!("{m:.1} m"),
        m => format!("{m:.0} m"),
    }
}

#[cfg(test)]
mod tests;
