//! How many pairs of runs can be equal at once: the pairs that share the error.

/// Runs from which on equality is not followed through: numbers alone are counted then, which is safe.
const FOLLOWED: usize = 128;

/// How many pairs of some runs may be equal, where others were found to differ.
///
/// Equality carries over from pair to pair, so the equal pairs are those within groups of equal runs, and their number
/// is Σ g (g − 1) / 2 for groups of g runs. That many share the error when the next pair is looked at
/// (Shaffer 1986, who sharpens Holm 1979).
#[derive(Debug, Clone)]
pub(crate) struct EqualPairs {
    pairs: usize,
    /// Whether so many can be equal; empty where any number is assumed possible.
    possible: Vec<bool>,
}

impl EqualPairs {
    pub(crate) fn among(runs: usize) -> Self {
        let pairs = |runs: usize| runs * runs.saturating_sub(1) / 2;
        if runs > FOLLOWED {
            return Self { pairs: pairs(runs), possible: Vec::new() };
        }
        // Which numbers of equal pairs the first n runs can have: the last group, and those before it.
        let mut of_first = vec![vec![true]];
        for n in 1..=runs {
            let mut possible = vec![false; pairs(n) + 1];
            for last in 1..=n {
                for (equal, _) in of_first[n - last].iter().enumerate().filter(|(_, possible)| **possible) {
                    possible[equal + pairs(last)] = true;
                }
            }
            of_first.push(possible);
        }
        Self { pairs: pairs(runs), possible: of_first.pop().unwrap_or_default() }
    }

    /// The most that can be equal when so many differ; 1 at least, so that an error can be shared by it.
    pub(crate) fn most(&self, differing: usize) -> usize {
        let left = self.pairs - differing.min(self.pairs);
        let is_possible = |&equal: &usize| self.possible.get(equal).is_none_or(|&possible| possible);
        (1..=left).rev().find(is_possible).unwrap_or(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn most<const N: usize>(runs: usize, differing: [usize; N]) -> [usize; N] {
        let equal = EqualPairs::among(runs);
        differing.map(|differing| equal.most(differing))
    }

    #[test]
    fn of_three_runs_only_one_pair_can_be_equal_when_another_differs() {
        assert_eq!(most(3, [0, 1, 2, 3]), [3, 1, 1, 1]);
    }

    #[test]
    fn numbers_are_those_of_groups_of_equal_runs() {
        // Of four runs 6, 3, 2, 1 or no pairs are equal, of five 10, 6, 4, 3, 2, 1 or none.
        assert_eq!(most(4, [0, 1, 3, 4, 5, 6]), [6, 3, 3, 2, 1, 1]);
        assert_eq!(most(5, [0, 1, 4, 5, 6, 7, 8, 9]), [10, 6, 6, 4, 4, 3, 2, 1]);
    }

    #[test]
    fn few_runs_and_many() {
        assert_eq!((most(0, [0]), most(1, [0]), most(2, [0, 1])), ([1], [1], [1, 1]));
        assert_eq!(most(60, [0, 1]), [1770, 1711]);
        assert_eq!(most(200, [0, 1, 7]), [19900, 19899, 19893]);
    }
}
