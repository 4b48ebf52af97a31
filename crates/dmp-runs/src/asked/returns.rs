//! Selects which returns of a scored scan are cast. The maps use all of them.

use dmp_reduce::mixed;
use serde::{Deserialize, Serialize};

use crate::asked::error::EvaluateError;
use crate::asked::setting_name::SettingName;

/// By default one of this many consecutive returns is cast, where the log has returns enough: as many are cast, at least.
const ONE_IN: u64 = 8;
const FEWEST_CAST: u64 = 500_000;
/// Where scans have so many returns that more than these are cast of each, one of up to so many is enough.
const FEWEST_OF_SCAN: u64 = 3_000;
const ONE_IN_DENSE: u64 = 64;

/// How many of the returns of a scored scan are cast.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum CastReturns {
    /// By their number: one of 2 to 64 consecutive ones, or every one where these are too few.
    #[default]
    ByNumber,
    /// One of so many consecutive ones; 1: every one.
    OneIn(u32),
}

/// Draws one of every few consecutive returns of a scan. What it draws follows from the seed, the scan's number in the log
/// and the returns' places in the scan alone: it is the same for every run, order and part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReturnDraw {
    one_in: usize,
    seed: u64,
}

impl CastReturns {
    /// The draw where `returns` of so many `scans` could be cast.
    pub fn draw(self, (returns, scans): (u64, usize), seed: u64) -> ReturnDraw {
        let one_in = match self {
            Self::OneIn(one_in) => one_in as usize,
            Self::ByNumber => {
                let of_scan = returns / scans.max(1) as u64;
                let most = (of_scan / FEWEST_OF_SCAN).clamp(ONE_IN, ONE_IN_DENSE);
                1 << (returns / FEWEST_CAST).clamp(1, most).ilog2()
            }
        };
        ReturnDraw { one_in, seed: mixed(seed) }
    }

    pub(crate) fn check(self) -> Result<(), EvaluateError> {
        match self {
            Self::OneIn(one_in) if !(1..=1000).contains(&one_in) => Err(EvaluateError::setting(
                SettingName::Returns,
                format!("1/{one_in}"),
                "it must lie between 1/1000 and 1/1",
            )),
            _ => Ok(()),
        }
    }
}

impl ReturnDraw {
    /// Every return.
    pub const ALL: Self = Self { one_in: 1, seed: 0 };

    /// Of how many consecutive returns one is drawn.
    pub fn one_in(self) -> usize {
        self.one_in
    }

    /// The places of the drawn ones among the `returns` of the scan with this number in the log, in order.
    pub fn of_scan(self, number: usize, returns: usize) -> impl Iterator<Item = usize> {
        let Self { one_in, seed } = self;
        let of_scan = mixed(seed ^ number as u64);
        let place = move |group: usize| {
            let within = if one_in > 1 { mixed(of_scan ^ group as u64) % one_in as u64 } else { 0 };
            group * one_in + within as usize
        };
        (0..returns.div_ceil(one_in)).map(place).filter(move |&place| place < returns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_log_is_thinned_and_a_short_one_is_not() {
        let one_in = |returns, scans| CastReturns::ByNumber.draw((returns, scans), 0).one_in();
        let of_short = |returns| one_in(returns, 1);
        assert_eq!([0, 999_999, 1_000_000, 1_999_999, 2_000_000].map(of_short), [1, 1, 2, 2, 4]);
        // Of 16 and 64 beams, and of a depth camera.
        assert_eq!([3_999_999, 4_000_000].map(|returns| one_in(returns, 400)), [4, 8]);
        assert_eq!(
            [24_000, 47_999, 48_000, 96_000, 307_200].map(|n| one_in(1000 * n, 1000)),
            [8, 8, 16, 32, 64]
        );
        assert_eq!((one_in(0, 0), one_in(u64::MAX, 1)), (1, 64));
        assert_eq!(CastReturns::OneIn(3).draw((5, 1), 0).one_in(), 3);
        assert!(CastReturns::OneIn(0).check().is_err() && CastReturns::OneIn(1001).check().is_err());
    }

    #[test]
    fn one_of_eight_consecutive_returns_is_drawn_each_as_often() {
        assert!(ReturnDraw::ALL.of_scan(3, 5).eq(0..5));
        let draw = |seed| CastReturns::OneIn(8).draw((0, 0), seed);
        let mut drawn = [0_u32; 20];
        for scan in 0..4000 {
            let places: Vec<usize> = draw(1).of_scan(scan, 20).collect();
            assert!(places[..2].iter().map(|place| place / 8).eq(0..2));
            places.iter().for_each(|&place| drawn[place] += 1);
        }
        // 500 expected, with a standard deviation of 21: also in the last group, which is short.
        assert!(drawn.iter().all(|count| count.abs_diff(500) < 105), "{drawn:?}");
        assert!(!draw(1).of_scan(7, 800).eq(draw(2).of_scan(7, 800)));
        assert!(!draw(1).of_scan(7, 800).eq(draw(1).of_scan(8, 800)));
    }
}
