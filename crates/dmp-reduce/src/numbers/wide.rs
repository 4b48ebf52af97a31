//! Integers of 256 bits, for exact second moments.

use std::ops::{Add, AddAssign, Neg, Sub};

/// A signed integer of 256 bits: just enough arithmetic for exact second moments.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Wide {
    high: i128,
    low: u128,
}

impl Wide {
    /// a · b, exactly.
    pub(crate) fn product(a: i128, b: i128) -> Self {
        // Both are at most 2^127, so the magnitude is at most 2^254 and its high half a positive `i128`.
        let (low, high) = a.unsigned_abs().carrying_mul(b.unsigned_abs(), 0);
        let magnitude = Self { high: high as i128, low };
        if (a < 0) == (b < 0) { magnitude } else { -magnitude }
    }

    /// The nearest `f64`, up to the last bit.
    pub(crate) fn to_f64(self) -> f64 {
        const TWO_128: f64 = 2.0 * (1u128 << 127) as f64;
        if self.high < 0 {
            return -(-self).to_f64();
        }
        self.high as f64 * TWO_128 + self.low as f64
    }
}

impl Neg for Wide {
    type Output = Self;

    fn neg(self) -> Self {
        Self::default() - self
    }
}

impl Add for Wide {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (low, carry) = self.low.overflowing_add(other.low);
        Self { high: self.high + other.high + i128::from(carry), low }
    }
}

impl Sub for Wide {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        let (low, borrow) = self.low.overflowing_sub(other.low);
        Self { high: self.high - other.high - i128::from(borrow), low }
    }
}

impl AddAssign for Wide {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_largest_products_are_right() {
        assert_eq!(Wide::product(1 << 126, 8), Wide { high: 2, low: 0 });
        assert_eq!(Wide::product(-1, 1), Wide { high: -1, low: u128::MAX });
        assert_eq!(Wide::product(-1, 1).to_f64(), -1.0);
        assert_eq!(Wide::product(i128::MIN, i128::MIN).to_f64(), (2f64).powi(254));
        assert_eq!(Wide::product(i128::MIN, i128::MAX).to_f64(), -(2f64).powi(254));
    }

    proptest! {
        #[test]
        fn it_is_a_ring(a: i64, b: i64, c: i128, d in -(1i128 << 120)..1i128 << 120) {
            let (a, b) = (i128::from(a), i128::from(b));
            prop_assert_eq!(Wide::product(a, b), Wide::product(a * b, 1));
            prop_assert_eq!(Wide::product(a, b).to_f64(), (a * b) as f64);
            let sum = Wide::product(a, d) + Wide::product(b, d);
            prop_assert_eq!(sum, Wide::product(a + b, d));
            prop_assert_eq!(sum - Wide::product(b, d), Wide::product(a, d));
            prop_assert_eq!(Wide::product(c, a) + Wide::product(c, -a), Wide::default());
        }
    }
}
