//! Part numbers of a stage.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Most parts of a stage: more than any scheduler has tasks.
const MOST: u32 = 1_000_000;

/// One of several parts of a stage. As text, counted from 1: `3/8`.
///
/// ```
/// use dmp_shard::Part;
///
/// let part: Part = "3/8".parse()?;
/// assert_eq!((part.number(), part.of(), part.to_string()), (3, 8, "3/8".to_owned()));
/// assert!("9/8".parse::<Part>().is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Part {
    of: u32,
    number: u32,
}

impl Part {
    /// The only one.
    pub const ALL: Self = Self { number: 1, of: 1 };

    /// The part with this number, from 1, out of `of`; `None` if there is no such part.
    pub fn new(number: u32, of: u32) -> Option<Self> {
        ((1..=of).contains(&number) && of <= MOST).then_some(Self { of, number })
    }

    /// Its number, from 1.
    pub fn number(self) -> u32 {
        self.number
    }

    /// The number of parts.
    pub fn of(self) -> u32 {
        self.of
    }

    /// The consecutive items of this part, given the work of each item. Parts have about equal work, and each
    /// item is in one part.
    pub(crate) fn share(self, work: &[u64]) -> std::ops::Range<usize> {
        let all: u128 = work.iter().map(|&work| u128::from(work.max(1))).sum();
        // An item belongs to the part that its midpoint lies in.
        let end = |parts: u32| {
            let mut before = 0;
            work.iter()
                .take_while(|&&work| {
                    let middle = 2 * before + u128::from(work.max(1));
                    before += u128::from(work.max(1));
                    middle * u128::from(self.of) < 2 * all * u128::from(parts)
                })
                .count()
        };
        end(self.number - 1)..end(self.number)
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers =
            text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        let part = numbers.and_then(|(number, of)| Self::new(number, of));
        part.ok_or_else(|| format!("`{text}` is no part: try 3/8, the third of eight"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn parts_share_the_work(work in prop::collection::vec(0u64..1000, 0..60), of in 1u32..40) {
            let shares: Vec<_> = (1..=of).map(|number| Part::new(number, of).unwrap().share(&work)).collect();
            let mut next = 0;
            for share in &shares {
                prop_assert_eq!(share.start, next);
                next = share.end;
            }
            prop_assert_eq!(next, work.len());
            let of_share = |share: &std::ops::Range<usize>| work[share.clone()].iter().map(|&w| w.max(1)).sum::<u64>();
            let all = of_share(&(0..work.len()));
            let largest = work.iter().copied().max().unwrap_or(0).max(1);
            for share in &shares {
                prop_assert!(of_share(share) <= all / u64::from(of) + largest + 1);
            }
        }
    }

    #[test]
    fn parts_are_counted_from_one() {
        for wrong in ["", "3", "0/8", "9/8", "1/0", "-1/8", "1/8/2", "a/b", "1/1000001", "1 /8"] {
            assert_eq!(
                wrong.parse::<Part>(),
                Err(format!("`{wrong}` is no part: try 3/8, the third of eight"))
            );
        }
    }
}
