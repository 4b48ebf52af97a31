//! What a return costs that no independent surfel predicts.

use std::fmt;

use super::scales::{Scales, WIDEST, limits};

/// What a return without an independent crossing costs in `R_cv` at its widest scale: the share κ of the full
/// square, 100 m² for a LiDAR.
///
/// It must cost something, or runs with holes win, but less than a wrong hit at its worst. The default is
/// κ = 0.15; `docs/accuracy.md` has the evidence. Kept in whole thousandths, so that equal prices are equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct MissPrice {
    thousandths: u16,
}

impl MissPrice {
    /// The share κ, from 0 to 1, to the nearest thousandth; `None` outside.
    pub fn new(share: f64) -> Option<Self> {
        (0.0..=1.0).contains(&share).then(|| Self { thousandths: (share * 1000.0).round() as u16 })
    }

    /// κ.
    pub fn share(self) -> f64 {
        f64::from(self.thousandths) / 1000.0
    }

    /// In the units of [`FixedSum`](crate::FixedSum), rounded down.
    pub(crate) fn units(self, scales: Scales) -> i128 {
        i128::from(limits(scales).cv[WIDEST] as u64) * i128::from(self.thousandths) / 1000
    }
}

impl From<MissPrice> for f64 {
    fn from(price: MissPrice) -> Self {
        price.share()
    }
}

impl TryFrom<f64> for MissPrice {
    type Error = String;

    fn try_from(share: f64) -> Result<Self, String> {
        Self::new(share).ok_or_else(|| format!("{share} is no share from 0 to 1"))
    }
}

impl fmt::Display for MissPrice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.share().fmt(f)
    }
}

impl Default for MissPrice {
    fn default() -> Self {
        Self { thousandths: 150 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_price_is_a_share_of_the_full_square() {
        assert_eq!(MissPrice::default(), MissPrice::new(0.15).unwrap());
        for (scales, full) in [(Scales::Drive, 100 << 40), (Scales::Room, 1 << 40)] {
            assert_eq!(MissPrice::new(0.25).unwrap().units(scales), full / 4);
            assert_eq!(MissPrice::new(1.0).unwrap().units(scales), full);
        }
        assert!([-0.1, 1.1, f64::NAN].into_iter().all(|share| MissPrice::new(share).is_none()));
        assert!((MissPrice::new(0.123).unwrap().share() - 0.123).abs() < 1e-12);
    }
}
