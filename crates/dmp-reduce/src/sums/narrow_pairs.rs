//! The sums of every pair of runs, in 64 bits as far as these reach.
//!
//! Of twelve runs there are 66 pairs, and every return belongs into all of them, each into one of 64 groups of surface. Most
//! returns are predicted by all runs, and on one surface: of these each run is added up by itself, which says as much. The
//! others are added to pair after pair; what is added to lies close together, and sums that grow beyond it lie elsewhere.

use super::narrow::MOST;
use crate::numbers::Total;
use crate::residual::{Basis, CV, GROUPS, Squares};

/// The sums of the pairs (a, b) of some runs with a < b: (0, 1), (0, 2), …, (1, 2), …; over the returns that both predict.
#[derive(Debug, Clone)]
pub(crate) struct NarrowPairs {
    /// For every pair its runs, and by what it is judged.
    runs: Vec<[usize; 2]>,
    bases: Vec<Basis>,
    /// By what all pairs are judged, if they are alike.
    basis: Option<Basis>,
    /// Returns that count for all runs and lie on one surface, and for every run their squares; by groups.
    together: Vec<[[u64; CV]; GROUPS]>,
    returns_together: [u32; GROUPS],
    /// Of all other returns: for every pair the squares of both.
    whole: Vec<[[u64; CV]; 2]>,
    /// For every pair its groups: returns, and the differences a − b at each scale.
    returns: Vec<[u32; GROUPS]>,
    differences: Vec<[[i64; CV]; GROUPS]>,
    /// What became too much for these, and how many returns they hold.
    wide: Vec<Wide>,
    count: u64,
    /// Of the current return, for every run by each basis.
    judged: Vec<[Judged; 2]>,
}

#[derive(Debug, Clone)]
struct Wide {
    squares: [[i128; CV]; 2],
    differences: [[Total; CV]; GROUPS],
}

impl Wide {
    const EMPTY: Self =
        Self { squares: [[0; CV]; 2], differences: [[Total { sum: 0, returns: 0 }; CV]; GROUPS] };
}

/// What one run is judged by for one return.
#[derive(Debug, Clone, Copy, Default)]
struct Judged {
    squares: [u64; CV],
    /// The number of its group of surface.
    surface: u8,
    counts: bool,
}

impl Judged {
    #[inline]
    fn of(squares: &Squares, basis: Basis) -> Self {
        let on = squares.on(basis);
        let surface = squares.surface_on(basis).index() as u8;
        Self { squares: on.unwrap_or_default(), surface, counts: on.is_some() }
    }

    /// The surface of the prediction that is further off made the difference; the lesser number where neither is. Without
    /// jumps, which would be guessed wrong every other time.
    #[inline]
    fn surface_of_difference(&self, other: &Self) -> usize {
        let mask = |is: bool| u8::from(is).wrapping_neg();
        let [greater, less] =
            [self.squares[0] > other.squares[0], self.squares[0] < other.squares[0]].map(mask);
        let either = self.surface.min(other.surface);
        usize::from(self.surface & greater | other.surface & less | either & !(greater | less)) % GROUPS
    }
}

impl NarrowPairs {
    /// Empty sums of the pairs of runs that are judged by `bases`.
    pub(crate) fn new(bases: &[Basis]) -> Self {
        let runs = bases.len();
        let bases: Vec<Basis> = pairs_of(runs).map(|(a, b)| bases[a].of_pair(bases[b])).collect();
        let pairs = bases.len();
        Self {
            runs: pairs_of(runs).map(|(a, b)| [a, b]).collect(),
            basis: bases.first().copied().filter(|first| bases.iter().all(|basis| basis == first)),
            bases,
            together: vec![[[0; CV]; GROUPS]; runs],
            returns_together: [0; GROUPS],
            whole: vec![[[0; CV]; 2]; pairs],
            returns: vec![[0; GROUPS]; pairs],
            differences: vec![[[0; CV]; GROUPS]; pairs],
            wide: vec![Wide::EMPTY; pairs],
            count: 0,
            judged: vec![Default::default(); runs],
        }
    }

    /// Memory of those of `runs` runs, bytes.
    pub(crate) fn bytes_of(runs: usize) -> usize {
        let group = size_of::<u32>() + size_of::<[i64; CV]>();
        let pair = size_of::<[[u64; CV]; 2]>() + size_of::<Wide>() + GROUPS * group;
        pairs_of(runs).count() * pair + runs * size_of::<[[u64; CV]; GROUPS]>()
    }

    /// By what each pair is judged.
    pub(crate) fn bases(&self) -> &[Basis] {
        &self.bases
    }

    /// Forgets all returns, keeps the buffers.
    pub(crate) fn clear(&mut self) {
        self.clear_narrow();
        self.wide.fill(Wide::EMPTY);
    }

    fn clear_narrow(&mut self) {
        self.together.fill([[0; CV]; GROUPS]);
        self.returns_together = [0; GROUPS];
        self.whole.fill([[0; CV]; 2]);
        self.returns.fill([0; GROUPS]);
        self.differences.fill([[0; CV]; GROUPS]);
        self.count = 0;
    }

    /// Adds one return, of which these are the squares of each run.
    #[inline]
    pub(crate) fn add(&mut self, squares: &[Squares]) {
        if self.bases.is_empty() {
            return;
        }
        match self.basis {
            Some(basis) if agree(squares, basis) => self.add_together(squares, basis),
            _ => self.add_pair_by_pair(squares),
        }
        self.count += 1;
        if self.count == MOST {
            self.widen();
        }
    }

    #[inline]
    fn add_together(&mut self, squares: &[Squares], basis: Basis) {
        let surface = squares[0].surface_on(basis).index();
        for (groups, squares) in self.together.iter_mut().zip(squares) {
            for (sum, square) in groups[surface].iter_mut().zip(squares.lanes_on(basis)) {
                *sum += square;
            }
        }
        self.returns_together[surface] += 1;
    }

    #[inline]
    fn add_pair_by_pair(&mut self, squares: &[Squares]) {
        for (judged, squares) in self.judged.iter_mut().zip(squares) {
            *judged = [Basis::CrossValidated, Basis::Near].map(|basis| Judged::of(squares, basis));
        }
        for (pair, (&[first, second], &basis)) in self.runs.iter().zip(&self.bases).enumerate() {
            let [a, b] = [first, second].map(|run| &self.judged[run][basis as usize]);
            if a.counts && b.counts {
                let surface = a.surface_of_difference(b);
                let (whole, differences) = (&mut self.whole[pair], &mut self.differences[pair][surface]);
                for k in 0..CV {
                    whole[0][k] += a.squares[k];
                    whole[1][k] += b.squares[k];
                    // Both below 2^50.
                    differences[k] += a.squares[k] as i64 - b.squares[k] as i64;
                }
                self.returns[pair][surface] += 1;
            }
        }
    }

    /// Brings all into the wide sums.
    #[cold]
    fn widen(&mut self) {
        for pair in 0..self.bases.len() {
            let (_, squares) = self.sums(pair);
            let of_group = |group| std::array::from_fn(|scale| self.difference(pair, scale, group));
            self.wide[pair] = Wide { squares, differences: std::array::from_fn(of_group) };
        }
        self.clear_narrow();
    }

    /// Adds the sums of other returns.
    pub(crate) fn merge(&mut self, other: &Self) {
        for pair in 0..self.bases.len() {
            let (_, [a, b]) = other.sums(pair);
            let wide = &mut self.wide[pair];
            for (sums, others) in wide.squares.iter_mut().zip([a, b]) {
                sums.iter_mut().zip(others).for_each(|(sum, other)| *sum += other);
            }
            for (group, totals) in wide.differences.iter_mut().enumerate() {
                for (scale, total) in totals.iter_mut().enumerate() {
                    total.add(other.difference(pair, scale, group));
                }
            }
        }
    }

    /// Common returns of a pair, and the sums of its two runs at each scale.
    pub(crate) fn sums(&self, pair: usize) -> (u64, [[i128; CV]; 2]) {
        let mut squares = self.wide[pair].squares;
        for ((sums, narrow), run) in squares.iter_mut().zip(self.whole[pair]).zip(self.runs[pair]) {
            for (scale, (sum, narrow)) in sums.iter_mut().zip(narrow).enumerate() {
                let together = self.together[run].iter().map(|squares| i128::from(squares[scale]));
                *sum += i128::from(narrow) + together.sum::<i128>();
            }
        }
        let returns = (0..GROUPS).map(|group| self.difference(pair, 0, group).returns).sum();
        (returns, squares)
    }

    /// The difference a − b of a pair at the `scale`-th of its scales, in one group of surface.
    pub(crate) fn difference(&self, pair: usize, scale: usize, group: usize) -> Total {
        let mut total = self.wide[pair].differences[group][scale];
        let [a, b] = self.runs[pair].map(|run| i128::from(self.together[run][group][scale]));
        total.add(Total {
            sum: i128::from(self.differences[pair][group][scale]) + a - b,
            returns: u64::from(self.returns[pair][group]) + u64::from(self.returns_together[group]),
        });
        total
    }
}

/// Whether a return counts for all runs, and on one surface.
#[inline]
fn agree(squares: &[Squares], basis: Basis) -> bool {
    let first = squares[0].surface_on(basis);
    squares.iter().fold(true, |all, run| all & run.counts_on(basis) & (run.surface_on(basis) == first))
}

/// The pairs of `runs` runs, in the order in which they are kept everywhere.
pub(crate) fn pairs_of(runs: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..runs).flat_map(move |a| (a + 1..runs).map(move |b| (a, b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::residual::{Residuals, Scales, SurfaceGroup};

    /// What a return adds to a pair: the squares of both, and the group of surface.
    fn slow(a: &Residuals, b: &Residuals, basis: Basis) -> Option<([[u64; CV]; 2], SurfaceGroup)> {
        let [a, b] = [a, b].map(|residuals| Squares::of(residuals, Scales::Drive));
        let (on_a, on_b) = (a.on(basis)?, b.on(basis)?);
        let (surface_a, surface_b) = (a.surface_on(basis), b.surface_on(basis));
        let surface = match on_a[0].cmp(&on_b[0]) {
            std::cmp::Ordering::Greater => surface_a,
            std::cmp::Ordering::Less => surface_b,
            std::cmp::Ordering::Equal => surface_a.min(surface_b),
        };
        Some(([on_a, on_b], surface))
    }

    /// The k-th of some returns: now all runs agree, now some miss it, see another surface, or are equal.
    fn returned(k: u64, run: u64) -> Residuals {
        let mix = |salt: u64| {
            let mut hash = (k * 31 + salt).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            hash ^= hash >> 29;
            hash.wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 33
        };
        if mix(run) % 9 == 0 && mix(100) % 2 == 0 {
            return Residuals::MISS;
        }
        let other = mix(200 + run) % 5 == 0 && mix(101) % 2 == 0;
        let surface = SurfaceGroup::of_cube([(mix(300) % 90) as i32 + i32::from(other), 0, 0]);
        let metres = if mix(102) % 7 == 0 { 40.0 } else { mix(400 + run) as f64 * 1e-9 };
        Residuals { surfaces: [surface, SurfaceGroup::of_cube([7, run as i32, 0])], ..Residuals::all(metres) }
    }

    #[test]
    fn they_are_the_sums_of_each_pair_by_itself_however_many_returns_there_are() {
        let (cv, near) = (Basis::CrossValidated, Basis::Near);
        for bases in [vec![cv; 4], vec![near; 2], vec![cv, near, cv], vec![cv]] {
            let mut pairs = NarrowPairs::new(&bases);
            let mut parts = [pairs.clone(), pairs.clone()];
            let mut sums = vec![(0, [[0i128; CV]; 2], [[Total::default(); CV]; GROUPS]); pairs.bases().len()];
            for k in 0..3 * MOST + 1000 {
                let residuals: Vec<Residuals> = (0..bases.len() as u64).map(|run| returned(k, run)).collect();
                let squares: Vec<Squares> = residuals.iter().map(|r| Squares::of(r, Scales::Drive)).collect();
                pairs.add(&squares);
                parts[usize::from(k % 3 == 0)].add(&squares);
                for ((a, b), (&basis, sums)) in pairs_of(bases.len()).zip(pairs.bases().iter().zip(&mut sums))
                {
                    let Some((squares, surface)) = slow(&residuals[a], &residuals[b], basis) else {
                        continue;
                    };
                    sums.0 += 1;
                    for (scale, (&of_a, &of_b)) in squares[0].iter().zip(&squares[1]).enumerate() {
                        let [of_a, of_b] = [of_a, of_b].map(i128::from);
                        sums.1[0][scale] += of_a;
                        sums.1[1][scale] += of_b;
                        sums.2[surface.index()][scale].add(Total { sum: of_a - of_b, returns: 1 });
                    }
                }
            }
            let [mut merged, other] = parts;
            merged.merge(&other);
            for (pair, (returns, squares, differences)) in sums.iter().enumerate() {
                assert!(*returns > 2 * MOST);
                for pairs in [&pairs, &merged] {
                    assert_eq!(pairs.sums(pair), (*returns, *squares));
                    for (group, scale) in
                        (0..GROUPS).flat_map(|group| (0..CV).map(move |scale| (group, scale)))
                    {
                        assert_eq!(pairs.difference(pair, scale, group), differences[group][scale]);
                    }
                }
            }
            pairs.clear();
            (0..sums.len()).for_each(|pair| assert_eq!(pairs.sums(pair), (0, [[0; CV]; 2])));
        }
    }
}
