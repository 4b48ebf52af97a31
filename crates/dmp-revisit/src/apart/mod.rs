//! How far apart two runs of one log put the same point, by their poses alone.
//!
//! Two runs place scan j against scan i by `A = A_i⁻¹ A_j` and `B = B_i⁻¹ B_j`. A return p of scan j is then put
//! `|A p − B p|` apart.
//! No map, no residual and nothing that moves takes part, and a rigid motion of a run changes nothing.

mod between;
mod moments;
mod within;

pub use moments::{MomentSums, Moments};

use std::fmt;

use dmp_sensor::{Isometry3, along_m};
use serde::{Deserialize, Serialize};

/// A scan for which both runs have a pose.
#[derive(Debug, Clone, Copy)]
pub struct ScanInBoth {
    /// Its number in the log.
    pub scan: u64,
    /// The pose of the sensor in each run, in any frame of the run.
    pub run_from_sensor: [Isometry3<f64>; 2],
}

/// The same, with the travel up to it, metres: the mean of both runs.
struct OnWay<'a> {
    scan: &'a ScanInBoth,
    along_m: f64,
}

/// What is compared, beside the poses.
#[derive(Debug, Clone, Copy)]
pub struct Ruler {
    /// How long what is a metre on a drive is here, metres.
    pub metre_m: f64,
    /// Scans with at least so much travel between them belong to different visits, metres.
    pub visits_m: f64,
    /// Whether scans see the same only in the same direction: those of a camera.
    pub is_camera: bool,
    /// Where the returns of a scan lie.
    pub returns: Moments,
}

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

impl Apart {
    /// Of the scans that both runs have, in the order of time; `None` where these are fewer than two.
    pub fn of(scans: &[ScanInBoth], scans_of_one: u64, ruler: &Ruler) -> Option<Self> {
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

    /// Whether the runs are the same for practical purposes: at every place 95 % lie within this length in one visit, metres,
    /// and within twice as much between visits; and one run alone has a pose for no more than one scan in ten.
    pub fn is_within(&self, within_m: f64) -> bool {
        let is_alike = 10 * self.scans_of_one <= self.scans;
        is_alike
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
}

/// `up to 1.2 cm apart within a visit, 41 cm between visits (scans 120 to 160)`: at the worst place, and which that is.
impl fmt::Display for Apart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "up to {} apart within a visit", short_length(self.within.worst_m))?;
        let mut worst = self.within;
        if let Some(between) = self.between {
            write!(f, ", {} between visits", short_length(between.worst_m))?;
            worst = if between.worst_m > worst.worst_m { between } else { worst };
        }
        match worst.worst_scans {
            [first, last] if first == last => write!(f, " (scan {first})"),
            [first, last] => write!(f, " (scans {first} to {last})"),
        }
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

/// Of distances with their places and scans, ordered by place.
struct Distances {
    all_m: Vec<f32>,
    of_place_m: Vec<f32>,
    scans: [u64; 2],
    worst: Option<(f64, [u64; 2])>,
}

impl Distances {
    fn new() -> Self {
        Self { all_m: Vec::new(), of_place_m: Vec::new(), scans: [u64::MAX, 0], worst: None }
    }

    fn add(&mut self, distance_m: f64, scans: [u64; 2]) {
        self.of_place_m.push(distance_m as f32);
        self.scans = [self.scans[0].min(scans[0]), self.scans[1].max(scans[1])];
    }

    fn end_place(&mut self) {
        if let Some(most_m) = quantile(&mut self.of_place_m, 0.95)
            && self.worst.is_none_or(|(worst_m, _)| most_m > worst_m)
        {
            self.worst = Some((most_m, self.scans));
        }
        self.all_m.append(&mut self.of_place_m);
        self.scans = [u64::MAX, 0];
    }

    fn spread(mut self) -> Option<Spread> {
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

/// The number of the place that a scan is in.
fn place_of(scan: &OnWay<'_>, ruler: &Ruler) -> i64 {
    (scan.along_m / (PLACE_M * ruler.metre_m)).floor() as i64
}

/// Travel that is a place, and that two scans of a visit are apart at most, metres.
const PLACE_M: f64 = 20.0;

impl Ruler {
    /// How far apart two scans' points are put, metres: the root mean square over the returns of the second.
    fn distance_m(&self, first: &OnWay<'_>, second: &OnWay<'_>) -> f64 {
        let [first, second] = [first, second].map(|on_way| on_way.scan.run_from_sensor);
        let [a, b] = [0, 1].map(|run| first[run].inv_mul(&second[run]));
        self.returns.moved_by_m(&a.inv_mul(&b))
    }
}

#[cfg(test)]
mod tests;
