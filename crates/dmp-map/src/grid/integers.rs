//! Exact rounding and division that are fast on every processor.

/// From 2⁵² to 2⁵³ every f64 is an integer counted by its last bits: adding this rounds halves to even.
pub(crate) const SHIFT: f64 = 1.5 * (1u64 << 52) as f64;

/// The nearest integer, halves away from zero, of a number below 2⁵¹. It replaces `f64::round`, which is a library call
/// with the oldest instruction set.
#[inline]
pub(crate) fn rounded(x: f64) -> i64 {
    let shifted = x + SHIFT;
    let to_even = shifted.to_bits() as i64 - SHIFT.to_bits() as i64;
    let rest = x - (shifted - SHIFT);
    to_even + i64::from(rest == 0.5 && x > 0.0) - i64::from(rest == -0.5 && x < 0.0)
}

/// Division by a fixed number, as a multiplication.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Reciprocal(u64);

impl Reciprocal {
    pub(crate) fn of(divisor: u32) -> Self {
        Self(u64::MAX / u64::from(divisor) + 1)
    }

    /// ⌊n / d⌋ for n · d < 2⁶⁴. The factor m is 2⁶⁴ / d rounded up: m d = 2⁶⁴ + e with e < d.
    /// So n m / 2⁶⁴ exceeds n / d by n e / (2⁶⁴ d) < 1 / d, too little to reach the next integer.
    #[inline]
    pub(crate) fn quotient(self, n: u64) -> u64 {
        ((u128::from(n) * u128::from(self.0)) >> 64) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rounding_is_that_of_the_library(x in -5e11..5e11_f64, unit in -1000..1000i64, ulps in -3..=3i64) {
            prop_assert_eq!(rounded(x), x.round() as i64);
            // Halves, integers and their neighbours.
            let half = unit as f64 / 2.0;
            let beside = f64::from_bits((half.to_bits() as i64 + ulps).max(0) as u64);
            for x in [half, beside, -beside, 0.499_999_999_999_999_94].into_iter().filter(|x| x.abs() < 1e15) {
                prop_assert_eq!(rounded(x), x.round() as i64);
            }
        }

        #[test]
        fn multiplying_by_the_reciprocal_divides(n: u64, d in 1u32.., near in 0..3u64) {
            let n = n % (u64::MAX / u64::from(d) + 1);
            let reciprocal = Reciprocal::of(d);
            // Near a multiple, where the quotient changes, and anywhere.
            let beside = (n / u64::from(d) * u64::from(d)).saturating_add(near).saturating_sub(1);
            for n in [n, beside] {
                prop_assert_eq!(reciprocal.quotient(n), n / u64::from(d));
            }
        }
    }
}
