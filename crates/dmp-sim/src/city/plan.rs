//! Where the streets of a city run, and what its blocks are: each a function of the seed and of whole
//! numbers, so that any part of the city is known without the rest.

use crate::parts::building::Storeys;
use crate::random::Random;

/// Mean distance between neighbouring streets, metres.
pub(crate) const PITCH_M: f64 = 84.0;
/// No street lies farther than this from its place in the even pattern, metres.
pub(crate) const JITTER_M: f64 = 9.0;
/// Widths of streets from façade to façade, metres; the last is an avenue.
const WIDTHS_M: [f64; 6] = [12.0, 14.0, 14.0, 16.0, 18.0, 27.0];
/// So many blocks each way are built alike.
const DISTRICT: i64 = 5;

/// A street that leads through the whole city.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Street {
    /// Its middle, metres along the axis that it crosses.
    pub(crate) middle_m: f64,
    /// From façade to façade, metres.
    pub(crate) width_m: f64,
}

/// What a block is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Use {
    /// Rows of houses along its four sides.
    Houses(Storeys),
    /// Four groups of houses with lanes between them.
    Lanes(Storeys),
    /// A few large buildings on a yard.
    Halls,
    /// Trees, paths' lamps and benches.
    Park,
    /// An open place with a hall, and cars parked on it.
    Square,
}

/// The plan of a city.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Plan {
    pub(crate) seed: u64,
}

impl Plan {
    /// A stream of random numbers of its own for a thing of some kind at a place.
    pub(crate) fn random(self, kind: u8, place: &[i64]) -> Random {
        let path: Vec<u64> = [u64::from(kind)].into_iter().chain(place.iter().map(|&k| k as u64)).collect();
        Random::new(self.seed, &path)
    }

    /// Street number `index` of those that cross an axis, east (0) or north (1).
    pub(crate) fn street(self, axis: usize, index: i64) -> Street {
        let mut random = self.random(b'l', &[axis as i64, index]);
        let middle_m = index as f64 * PITCH_M + random.between(-JITTER_M, JITTER_M);
        Street { middle_m, width_m: WIDTHS_M[random.index(WIDTHS_M.len())] }
    }

    /// Middle of a crossing.
    pub(crate) fn crossing(self, node: [i64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.street(axis, node[axis]).middle_m)
    }

    /// What stands on the block north-east of a crossing.
    pub(crate) fn usage(self, cell: [i64; 2]) -> Use {
        let district = self.random(b'h', &cell.map(|k| k.div_euclid(DISTRICT))).index(4);
        let storeys = [
            Storeys { least: 1, choices: 2 },
            Storeys { least: 2, choices: 3 },
            Storeys { least: 3, choices: 4 },
            Storeys { least: 5, choices: 5 },
        ][district];
        match self.random(b'u', &cell).index(20) {
            0..11 => Use::Houses(storeys),
            11..14 => Use::Lanes(storeys),
            14..16 => Use::Halls,
            16..18 => Use::Park,
            _ => Use::Square,
        }
    }
}
