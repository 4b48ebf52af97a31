//! In which order unknowns are solved for.

use std::collections::BTreeSet;

/// In which order the variables of a sparse symmetric system are eliminated, and which numbers of its Cholesky factor
/// are not zero.
#[derive(Debug)]
pub(super) struct Elimination {
    /// The place of each variable in the order.
    pub(super) place: Vec<usize>,
    /// By place: the later places in whose rows the factor's column is not zero, increasing.
    pub(super) below: Vec<Vec<usize>>,
}

impl Elimination {
    /// The order of least degree: always the variable next that fewest of those left are tied to, the first of equal
    /// ones. Those that it was tied to are tied to each other from then on; they are its column of the factor. A chain of
    /// poses with a few loops stays nearly as sparse as it is.
    pub(super) fn new(variables: usize, ties: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let mut tied: Vec<Vec<usize>> = vec![Vec::new(); variables];
        for (a, b) in ties {
            tied[a].push(b);
            tied[b].push(a);
        }
        for others in &mut tied {
            others.sort_unstable();
            others.dedup();
        }
        let mut queue: BTreeSet<(usize, usize)> =
            tied.iter().enumerate().map(|(variable, others)| (others.len(), variable)).collect();
        let mut place = vec![0; variables];
        let mut below = Vec::with_capacity(variables);
        while let Some((_, variable)) = queue.pop_first() {
            let column = std::mem::take(&mut tied[variable]);
            for &other in &column {
                queue.remove(&(tied[other].len(), other));
                tied[other] = union(&tied[other], &column, [variable, other]);
                queue.insert((tied[other].len(), other));
            }
            place[variable] = below.len();
            below.push(column);
        }
        for column in &mut below {
            column.iter_mut().for_each(|variable| *variable = place[*variable]);
            column.sort_unstable();
        }
        Self { place, below }
    }
}

/// The values in one of two increasing lists, without two of them.
fn union(a: &[usize], b: &[usize], without: [usize; 2]) -> Vec<usize> {
    let mut all = Vec::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.iter().copied().peekable(), b.iter().copied().peekable());
    loop {
        let next = match (a.peek(), b.peek()) {
            (Some(x), Some(y)) if x == y => {
                b.next();
                a.next()
            }
            (Some(x), Some(y)) if y < x => b.next(),
            (Some(_), _) => a.next(),
            (None, _) => b.next(),
        };
        let Some(next) = next else { return all };
        if !without.contains(&next) {
            all.push(next);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows that are not zero, found by eliminating with a full matrix of bits.
    fn fill(variables: usize, ties: &[(usize, usize)], place: &[usize]) -> Vec<Vec<usize>> {
        let mut set = vec![vec![false; variables]; variables];
        for &(a, b) in ties {
            let (a, b) = (place[a], place[b]);
            (set[a][b], set[b][a]) = (true, true);
        }
        for k in 0..variables {
            for (i, j) in (k + 1..variables).flat_map(|i| (k + 1..variables).map(move |j| (i, j))) {
                set[i][j] |= set[i][k] && set[k][j];
            }
        }
        (0..variables).map(|k| (k + 1..variables).filter(|&i| set[i][k]).collect()).collect()
    }

    #[test]
    fn the_pattern_is_that_of_elimination() {
        let mut state = 7_u64;
        let mut random = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below
        };
        for _ in 0..100 {
            let variables = 1 + random(25);
            let ties: Vec<(usize, usize)> = (0..random(50))
                .map(|_| (random(variables), random(variables)))
                .filter(|(a, b)| a != b)
                .collect();
            let found = Elimination::new(variables, ties.iter().copied());
            let mut places = found.place.clone();
            places.sort_unstable();
            assert!(places.into_iter().eq(0..variables));
            assert_eq!(found.below, fill(variables, &ties, &found.place));
        }
    }

    #[test]
    fn a_chain_with_a_loop_stays_sparse() {
        let ties = (0..999).map(|k| (k, k + 1)).chain([(0, 999), (200, 700)]);
        let found = Elimination::new(1000, ties);
        let blocks: usize = found.below.iter().map(Vec::len).sum();
        assert!(blocks < 2010, "{blocks}");
    }
}
