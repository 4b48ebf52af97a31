use crate::fixed::units_of;

/// Truncations τ at which `R_cv` is summed, metres. The first serves the place guard alone.
pub const CV_SCALES_M: [f64; 5] = [30.0, 10.0, 2.0, 0.5, 0.2];
/// Truncations τ at which `R_near` is summed, metres.
pub const NEAR_SCALES_M: [f64; 3] = [5.0, 2.0, 0.5];

/// As many as the longer list of scales has.
pub(crate) const SCALES: usize = CV_SCALES_M.len();
/// Where in [`CV_SCALES_M`] the scale of the score `R_cv(10)` stands.
pub(crate) const CV_10: usize = 1;

/// τ² of [`CV_SCALES_M`] in units of 2^-40 m².
pub(crate) const CV_LIMITS: [u64; SCALES] = [
    units_of(CV_SCALES_M[0] * CV_SCALES_M[0]),
    units_of(CV_SCALES_M[1] * CV_SCALES_M[1]),
    units_of(CV_SCALES_M[2] * CV_SCALES_M[2]),
    units_of(CV_SCALES_M[3] * CV_SCALES_M[3]),
    units_of(CV_SCALES_M[4] * CV_SCALES_M[4]),
];
/// τ² of [`NEAR_SCALES_M`] in the same units.
pub(crate) const NEAR_LIMITS: [u64; NEAR_SCALES_M.len()] = [
    units_of(NEAR_SCALES_M[0] * NEAR_SCALES_M[0]),
    units_of(NEAR_SCALES_M[1] * NEAR_SCALES_M[1]),
    units_of(NEAR_SCALES_M[2] * NEAR_SCALES_M[2]),
];
/// No truncated square is larger than this many bits, nor is the difference of two.
pub(crate) const TRUNCATED_BITS: u32 = 50;
const _: () = assert!(CV_LIMITS[0] < 1 << TRUNCATED_BITS);

/// By which crossings a run is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub enum Basis {
    /// The map was fused from the log: only crossings of independent surfels count (`R_cv`), so that no
    /// scan vouches for itself.
    CrossValidated,
    /// The map was given: nothing is known of what made it, and the crossing nearest to the measured
    /// range counts (`R_near`).
    Near,
}

impl Basis {
    /// How two runs are compared: on `R_near` where either map was given.
    #[must_use]
    pub fn of_pair(self, other: Self) -> Self {
        self.max(other)
    }

    /// The scales of its sums, metres, largest first.
    pub fn scales_m(self) -> &'static [f64] {
        match self {
            Self::CrossValidated => &CV_SCALES_M,
            Self::Near => &NEAR_SCALES_M,
        }
    }

    /// The scales at which a pair is decided, metres, in the order in which they are asked.
    pub fn cascade_m(self) -> &'static [f64] {
        match self {
            Self::CrossValidated => &CV_SCALES_M[CV_10..],
            Self::Near => &NEAR_SCALES_M,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_given_map_makes_the_pair_near() {
        assert_eq!(Basis::CrossValidated.of_pair(Basis::CrossValidated), Basis::CrossValidated);
        assert_eq!(Basis::CrossValidated.of_pair(Basis::Near), Basis::Near);
        assert_eq!(Basis::Near.of_pair(Basis::CrossValidated), Basis::Near);
    }

    #[test]
    fn the_score_of_ten_metres_stands_where_it_is_said_to() {
        assert_eq!(CV_SCALES_M[CV_10], 10.0);
        assert_eq!(Basis::CrossValidated.cascade_m(), [10.0, 2.0, 0.5, 0.2]);
    }
}
