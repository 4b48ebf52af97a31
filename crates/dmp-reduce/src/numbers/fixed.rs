//! Squared lengths as integers of 2^-40 m², and sums of them that depend on no order.

use std::ops::{Add, AddAssign};

/// Units in a square metre: 2^40.
const UNITS_PER_M2: f64 = (1u64 << 40) as f64;
/// A residual counts as at most this long, metres (2^20, about 1049 km). Its square is 2^80 units, of
/// which an `i128` holds 2^46: more returns than any log has.
const LONGEST_M: f64 = (1u64 << 20) as f64;

/// An area below 2^23 m² in units, for constants.
pub(crate) const fn units_of(area_m2: f64) -> u64 {
    (area_m2 * UNITS_PER_M2 + 0.5) as u64
}

/// A square residual in units, rounded to the nearest. `residual_m` must be finite.
#[inline]
pub(crate) fn square_units(residual_m: f64) -> u128 {
    let length_m = residual_m.abs().min(LONGEST_M);
    let units = length_m * length_m * UNITS_PER_M2;
    // From 2^52 on every f64 is an integer. A residual below 64 m does not come so far.
    if units < INTEGERS_FROM { rounded(units).into() } else { units as u128 }
}

/// A square residual in units, not yet rounded and of any size.
#[inline]
pub(crate) fn unrounded_units(residual_m: f64) -> f64 {
    residual_m * residual_m * UNITS_PER_M2
}

/// As [`square_units`], but at most 2^51 units (2048 m²), which any truncation is below.
#[inline]
pub(crate) fn short_square_units(residual_m: f64) -> u64 {
    const MOST: f64 = (1u64 << 51) as f64;
    let units = unrounded_units(residual_m);
    rounded(if units < MOST { units } else { MOST })
}

/// 2^52: from here to 2^53 every f64 is an integer, and its last 52 bits count them.
const INTEGERS_FROM: f64 = (1u64 << 52) as f64;

/// A number from 0 to below 2^52 rounded to the nearest integer, halves to even: `f64::round_ties_even`, which is a call
/// into a library on processors that are not asked for more than the oldest instructions.
#[inline]
pub(crate) fn rounded(units: f64) -> u64 {
    (units + INTEGERS_FROM).to_bits() - INTEGERS_FROM.to_bits()
}

/// Sum of squared residuals as an integer of 2^-40 m²: exact, so that neither the order of adding nor
/// the way a sum is split over threads changes a bit of it.
///
/// The rounding error of a square is at most 2^-41 m², less than one square micrometre. Beyond 2^20 m a
/// residual counts as 2^20 m.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize,
)]
pub struct FixedSum(i128);

impl FixedSum {
    pub(crate) const fn from_units(units: i128) -> Self {
        Self(units)
    }

    pub(crate) const fn units(self) -> i128 {
        self.0
    }

    /// The sum in square metres, rounded once.
    pub fn to_m2(self) -> f64 {
        units_to_m2(self.0 as f64)
    }

    /// The sum over `count`, square metres; `None` over nothing.
    pub(crate) fn mean_m2(self, count: u64) -> Option<f64> {
        (count > 0).then(|| self.to_m2() / count as f64)
    }
}

/// Units as square metres: exact, as only the exponent changes.
pub(crate) fn units_to_m2(units: f64) -> f64 {
    units / UNITS_PER_M2
}

impl Add for FixedSum {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl AddAssign for FixedSum {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_longest_residual_fits_as_often_as_any_log_has_returns() {
        assert_eq!([f64::MAX, LONGEST_M].map(square_units), [1 << 80; 2]);
        assert!((1_i128 << 80).checked_mul(1 << 46).is_some());
    }

    proptest! {

        #[test]
        fn squares_are_rounded_as_by_the_library(residual_m in -1e6..1e6f64, short_m in -70.0..70.0f64, half in 0..2000u32) {
            // Lengths whose squares are halves of a unit, or next to them.
            let half_m = (f64::from(half) * 0.5).sqrt() * (2f64).powi(-20);
            let beside_m = f64::from_bits(half_m.to_bits() + 1);
            for m in [residual_m, short_m, half_m, beside_m, f64::from(half)] {
                let units = m.abs() * m.abs() * UNITS_PER_M2;
                prop_assert_eq!(square_units(m), units.round_ties_even() as u128);
            }
            for units in [f64::from(half) * 0.5, units_of(short_m * short_m) as f64 + 0.5] {
                prop_assert!(units >= INTEGERS_FROM || rounded(units) == units.round_ties_even() as u64);
            }
        }

        #[test]
        fn the_short_form_agrees(residual_m in -1000.0..1000.0f64, short_m in -50.0..50.0f64) {
            for m in [residual_m, short_m] {
                prop_assert_eq!(u128::from(short_square_units(m)), square_units(m).min(1 << 51));
            }
        }
    }
}
