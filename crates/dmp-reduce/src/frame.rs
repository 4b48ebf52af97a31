use crate::Basis;
use crate::fixed::FixedSum;
use crate::residuals::{Residuals, Squares};
use crate::run::RunSums;
use crate::scales::{CV, Scales, TRUNCATED_BITS};

/// Returns after which the 64-bit sums of pairs are carried into wide ones: 2^14 squares below 2^50
/// stay below 2^64.
const BLOCK: u32 = 1 << 14;
const _: () = assert!(BLOCK.ilog2() + TRUNCATED_BITS == u64::BITS);

/// The sums of all runs over one frame, and of every pair of them over the returns both predict.
///
/// One return is added for all runs at once. Give the same rays to every run: what is compared is
/// their answer to the same question. Cleared and filled again, it allocates nothing.
#[derive(Debug, Clone)]
pub struct FrameSums {
    scales: Scales,
    bases: Vec<Basis>,
    runs: Vec<RunSums>,
    /// The pairs (a, b) with a < b: (0, 1), (0, 2), …, (1, 2), …
    pairs: Vec<PairSums>,
    blocks: Vec<Block>,
    in_block: u32,
    squares: Vec<Squares>,
}

/// Sums of a pair not yet carried: as the pair's, in 64 bits.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    returns: u64,
    a: [u64; CV],
    b: [u64; CV],
}

/// The sums of a pair of runs over their common returns: those with zc in both, or with z1 in both
/// where the pair is judged by [`Basis::Near`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairSums {
    basis: Basis,
    returns: u64,
    a: [FixedSum; CV],
    b: [FixedSum; CV],
}

impl FrameSums {
    /// Empty sums for runs judged by `bases`, on the scales of a LiDAR.
    pub fn new(bases: &[Basis]) -> Self {
        Self::on_scales(bases, Scales::default())
    }

    /// Empty sums for runs judged by `bases` and by these lengths.
    pub fn on_scales(bases: &[Basis], scales: Scales) -> Self {
        let pairs: Vec<_> = pairs_of(bases.len())
            .map(|(a, b)| PairSums {
                basis: bases[a].of_pair(bases[b]),
                returns: 0,
                a: Default::default(),
                b: Default::default(),
            })
            .collect();
        Self {
            scales,
            bases: bases.to_vec(),
            runs: vec![RunSums::new(scales); bases.len()],
            blocks: vec![Block::default(); pairs.len()],
            pairs,
            in_block: 0,
            squares: vec![Squares::default(); bases.len()],
        }
    }

    /// Forgets all returns, keeps the buffers.
    pub fn clear(&mut self) {
        self.runs.fill(RunSums::new(self.scales));
        self.blocks.fill(Block::default());
        self.in_block = 0;
        for pair in &mut self.pairs {
            *pair = PairSums { basis: pair.basis, returns: 0, a: Default::default(), b: Default::default() };
        }
    }

    /// Adds one return: what each run's map predicts for it.
    ///
    /// # Panics
    /// Where there are not as many residuals as runs.
    #[inline]
    pub fn add_return(&mut self, residuals: &[Residuals]) {
        for (run, residuals) in self.runs.iter_mut().zip(residuals) {
            run.add(residuals);
        }
        self.add_to_pairs(residuals);
    }

    /// Adds one return to the sums of the pairs alone: those of the runs are to come by [`Self::add_to_run`], from
    /// sums that were made of the same returns anyway.
    ///
    /// # Panics
    /// Where there are not as many residuals as runs.
    #[inline]
    pub fn add_to_pairs(&mut self, residuals: &[Residuals]) {
        assert_eq!(residuals.len(), self.runs.len(), "one set of residuals for each run");
        if self.pairs.is_empty() {
            return;
        }
        for (squares, residuals) in self.squares.iter_mut().zip(residuals) {
            *squares = Squares::of(residuals, self.scales);
        }
        let mut blocks = self.blocks.iter_mut().zip(&self.pairs);
        for (i, a) in self.squares.iter().enumerate() {
            for (b, (block, pair)) in self.squares[i + 1..].iter().zip(&mut blocks) {
                if let (Some(a), Some(b)) = (a.on(pair.basis), b.on(pair.basis)) {
                    block.add(a, b);
                }
            }
        }
        self.in_block += 1;
        if self.in_block == BLOCK {
            self.carry();
        }
    }

    /// Adds the sums of some of the frame's returns to those of the `run`-th run, without any of the pairs.
    ///
    /// # Panics
    /// Where there is no such run.
    pub fn add_to_run(&mut self, run: usize, sums: &RunSums) {
        self.runs[run].merge(sums);
    }

    /// Adds the sums of another part of the same frame.
    ///
    /// # Panics
    /// Where the two are not of the same runs.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!(
            (&self.bases, self.scales),
            (&other.bases, other.scales),
            "parts of a frame are of the same runs"
        );
        self.carry();
        for (mine, theirs) in self.runs.iter_mut().zip(&other.runs) {
            mine.merge(theirs);
        }
        for (mine, theirs) in self.pairs.iter_mut().zip(other.pair_sums()) {
            mine.merge(&theirs);
        }
    }

    /// The lengths by which returns are judged.
    pub fn scales(&self) -> Scales {
        self.scales
    }

    /// By what each run is judged.
    pub fn bases(&self) -> &[Basis] {
        &self.bases
    }

    /// The sums of each run.
    pub fn runs(&self) -> &[RunSums] {
        &self.runs
    }

    /// Every pair (a, b) with a < b in the order (0, 1), (0, 2), …, (1, 2), …
    pub fn pair_sums(&self) -> impl Iterator<Item = PairSums> {
        self.pairs.iter().zip(&self.blocks).map(|(pair, block)| {
            let mut sums = *pair;
            sums.carry(block);
            sums
        })
    }

    fn carry(&mut self) {
        for (pair, block) in self.pairs.iter_mut().zip(&mut self.blocks) {
            pair.carry(block);
            *block = Block::default();
        }
        self.in_block = 0;
    }
}

/// The pairs of `runs` runs, in the order in which they are kept everywhere.
pub(crate) fn pairs_of(runs: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..runs).flat_map(move |a| (a + 1..runs).map(move |b| (a, b)))
}

impl Block {
    #[inline]
    fn add(&mut self, a: &[u64; CV], b: &[u64; CV]) {
        self.returns += 1;
        for k in 0..CV {
            self.a[k] += a[k];
            self.b[k] += b[k];
        }
    }
}

impl PairSums {
    /// By what the pair is judged.
    pub fn basis(&self) -> Basis {
        self.basis
    }

    /// Common returns.
    pub fn returns(&self) -> u64 {
        self.returns
    }

    /// The sums of the truncated squares over the common returns, of the first and of the second run,
    /// at the `scale`-th of [`Basis::scales_m`].
    ///
    /// # Panics
    /// Where the basis has fewer scales.
    pub fn at(&self, scale: usize) -> (FixedSum, FixedSum) {
        let scales = self.basis.scales_m(Scales::default()).len();
        assert!(scale < scales, "scale {scale} of {:?}", self.basis);
        (self.a[scale], self.b[scale])
    }

    fn carry(&mut self, block: &Block) {
        self.returns += block.returns;
        for k in 0..CV {
            self.a[k] += FixedSum::from_units(block.a[k].into());
            self.b[k] += FixedSum::from_units(block.b[k].into());
        }
    }

    fn merge(&mut self, other: &Self) {
        self.returns += other.returns;
        for k in 0..CV {
            self.a[k] += other.a[k];
            self.b[k] += other.b[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_common_returns_are_compared() {
        let mut frame = FrameSums::new(&[Basis::CrossValidated, Basis::CrossValidated, Basis::Near]);
        let near = |m| Residuals { first_m: Some(m), nearest_m: Some(m), ..Residuals::MISS };
        frame.add_return(&[Residuals::all(1.0), Residuals::all(3.0), near(1.0)]);
        frame.add_return(&[Residuals::all(1.0), Residuals::MISS, near(2.0)]);
        frame.add_return(&[Residuals::all(1.0), near(0.1), Residuals::MISS]);
        let pairs: Vec<_> = frame.pair_sums().collect();
        assert_eq!(
            pairs.iter().map(PairSums::basis).collect::<Vec<_>>()[..],
            [Basis::CrossValidated, Basis::Near, Basis::Near]
        );
        assert_eq!(pairs.iter().map(PairSums::returns).collect::<Vec<_>>(), [1, 2, 1]);
        let m2 = |k: usize, scale| (pairs[k].at(scale).0.to_m2(), pairs[k].at(scale).1.to_m2());
        assert_eq!((m2(0, 0), m2(0, 2), m2(0, 3)), ((1.0, 9.0), (1.0, 4.0), (0.25, 0.25)));
        assert_eq!((m2(1, 0), m2(1, 1), m2(2, 0)), ((2.0, 5.0), (2.0, 5.0), (9.0, 1.0)));
    }

    #[test]
    fn the_longest_frame_of_the_worst_residuals_does_not_overflow() {
        let mut frame = FrameSums::new(&[Basis::CrossValidated; 2]);
        let returns = 5 * u64::from(BLOCK) / 2;
        for _ in 0..returns {
            frame.add_return(&[Residuals::all(1e4), Residuals::all(-1e9)]);
        }
        let pair = frame.pair_sums().next().unwrap();
        assert_eq!(pair.returns(), returns);
        assert_eq!(pair.at(0).0.to_m2(), 900.0 * returns as f64);
        assert_eq!(pair.at(0).0, pair.at(0).1);
        assert_eq!(frame.runs()[0].dmp_sum_m2(), 1e8 * returns as f64);
    }

    #[test]
    fn runs_and_pairs_may_be_added_to_by_themselves() {
        let bases = [Basis::CrossValidated, Basis::Near];
        let (mut whole, mut apart) = (FrameSums::new(&bases), FrameSums::new(&bases));
        let mut tiles = [[RunSums::default(); 2]; 3];
        for k in 0..20_000 {
            let returned = [Residuals::all(f64::from(k) * 1e-3), Residuals::all(-0.3)];
            whole.add_return(&returned);
            apart.add_to_pairs(&returned);
            for (run, residuals) in returned.iter().enumerate() {
                tiles[k as usize % 3][run].add(residuals);
            }
        }
        for (run, sums) in tiles.iter().flat_map(|of_tile| of_tile.iter().enumerate()) {
            apart.add_to_run(run, sums);
        }
        assert_eq!(apart.runs(), whole.runs());
        assert!(apart.pair_sums().eq(whole.pair_sums()));
    }

    #[test]
    fn parts_of_a_frame_merge_and_clear_empties() {
        let mut whole = FrameSums::new(&[Basis::CrossValidated, Basis::Near]);
        let mut parts = [whole.clone(), whole.clone()];
        for k in 0..40_000 {
            let returned = [Residuals::all(f64::from(k) * 1e-3), Residuals::all(-0.3)];
            whole.add_return(&returned);
            parts[usize::from(k % 3 == 0)].add_return(&returned);
        }
        let [mut first, second] = parts;
        first.merge(&second);
        assert_eq!(first.runs(), whole.runs());
        assert!(first.pair_sums().eq(whole.pair_sums()));
        whole.clear();
        assert_eq!(whole.runs(), [RunSums::default(); 2]);
        assert!(whole.pair_sums().eq(FrameSums::new(whole.bases()).pair_sums()));
    }
}
