//! The sums of all runs, and of all pairs of them, over one frame.

use super::narrow::NarrowSums;
use super::narrow_pairs::NarrowPairs;
use super::run::RunSums;
use crate::numbers::{FixedSum, Total};
#[cfg(doc)]
use crate::residual::KeptReturn;
use crate::residual::{Basis, CV, GROUPS, Residuals, Scales, Squares, SurfaceGroup};

/// The sums of all runs over one frame, and of every pair of them over the returns both predict; each by groups of
/// surface.
///
/// One return is added for all runs at once. Give the same rays to every run: what is compared is
/// their answer to the same question. Pairs are compared by residuals as they are [kept](KeptReturn), so that runs scored
/// apart compare as runs scored together. Cleared and filled again, it allocates nothing.
#[derive(Debug, Clone)]
pub struct FrameSums {
    scales: Scales,
    bases: Vec<Basis>,
    /// For every run its groups of surface.
    runs: Vec<NarrowSums>,
    pairs: NarrowPairs,
    /// Of the current return, for every run; none where there are no pairs.
    squares: Vec<Squares>,
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
        Self {
            scales,
            bases: bases.to_vec(),
            runs: vec![NarrowSums::new(scales); bases.len() * GROUPS],
            pairs: NarrowPairs::new(bases),
            squares: if bases.len() > 1 { vec![Squares::default(); bases.len()] } else { Vec::new() },
        }
    }

    /// Memory of the sums of `runs` runs, bytes.
    pub fn bytes_of(runs: usize) -> usize {
        GROUPS * runs * size_of::<NarrowSums>() + NarrowPairs::bytes_of(runs)
    }

    /// Forgets all returns, keeps the buffers.
    pub fn clear(&mut self) {
        self.runs.fill(NarrowSums::new(self.scales));
        self.pairs.clear();
    }

    /// Adds one return: what each run's map predicts for it.
    ///
    /// # Panics
    /// Where there are not as many residuals as runs.
    #[inline]
    pub fn add_return<'r>(&mut self, residuals: impl IntoIterator<Item = &'r Residuals>) {
        self.add_return_to(residuals.into_iter().map(Some), |_, _| {});
    }

    /// The same where runs may have no pose for the return, `None`: it does not count for these. Hands over each run's
    /// squares, which belong into other sums, too.
    ///
    /// # Panics
    /// Where there are not as many residuals as runs.
    #[inline]
    pub fn add_return_to<'r>(
        &mut self,
        residuals: impl IntoIterator<Item = Option<&'r Residuals>>,
        mut to: impl FnMut(usize, &Squares),
    ) {
        let mut residuals = residuals.into_iter();
        let mut runs = 0;
        for (groups, of_run) in self.runs.as_chunks_mut::<GROUPS>().0.iter_mut().zip(residuals.by_ref()) {
            let basis = self.bases[runs];
            let squares = of_run.map(|of_run| {
                let squares = Squares::of(of_run, self.scales);
                groups[squares.surface_on(basis).index()].add(&squares);
                to(runs, &squares);
                (squares, of_run)
            });
            if let Some(of_pairs) = self.squares.get_mut(runs) {
                *of_pairs = squares.map_or(Squares::default(), |(squares, of_run)| {
                    squares.as_kept(of_run, basis, self.scales)
                });
            }
            runs += 1;
        }
        let is_one_each = runs == self.bases.len() && residuals.next().is_none();
        assert!(is_one_each, "one set of residuals for each run");
        self.pairs.add(&self.squares);
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
        for (mine, theirs) in self.runs.iter_mut().zip(&other.runs) {
            mine.merge(theirs);
        }
        self.pairs.merge(&other.pairs);
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
    pub fn runs(&self) -> Vec<RunSums> {
        let whole = |groups: &[NarrowSums; GROUPS]| {
            let mut run = RunSums::new(self.scales);
            groups.iter().for_each(|group| run.merge(&group.sums()));
            run
        };
        self.runs.as_chunks().0.iter().map(whole).collect()
    }

    /// The sums of one run by groups of surface.
    pub(crate) fn groups_of_run(&self, run: usize) -> impl Iterator<Item = (SurfaceGroup, RunSums)> {
        let groups = &self.runs[run * GROUPS..(run + 1) * GROUPS];
        SurfaceGroup::all().zip(groups.iter().map(NarrowSums::sums))
    }

    /// Every pair (a, b) with a < b in the order (0, 1), (0, 2), …, (1, 2), …
    pub fn pair_sums(&self) -> impl ExactSizeIterator<Item = PairSums> {
        self.pairs.bases().iter().enumerate().map(|(pair, &basis)| {
            let (returns, [a, b]) = self.pairs.sums(pair);
            PairSums { basis, returns, a: a.map(FixedSum::from_units), b: b.map(FixedSum::from_units) }
        })
    }

    /// The differences of the `pair`-th pair at the `scale`-th of its scales, by groups of surface.
    pub(crate) fn differences(
        &self,
        pair: usize,
        scale: usize,
    ) -> impl Iterator<Item = (SurfaceGroup, Total)> {
        SurfaceGroup::all().map(move |group| (group, self.pairs.difference(pair, scale, group.index())))
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[should_panic(expected = "one set of residuals for each run")]
    fn fewer_residuals_than_runs_are_a_fault() {
        FrameSums::new(&[Basis::Near; 2]).add_return(&[Residuals::MISS]);
    }

    #[test]
    fn the_longest_frame_of_the_worst_residuals_does_not_overflow() {
        let mut frame = FrameSums::new(&[Basis::CrossValidated; 2]);
        let returns = 40_960;
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
    fn groups_add_up_to_the_whole_and_a_difference_belongs_to_the_worse_prediction() {
        let group = |x| SurfaceGroup::of_cube([x, 0, 0]);
        let mut frame = FrameSums::new(&[Basis::CrossValidated; 2]);
        let on = |residual_m, cube| Residuals { surfaces: [group(cube); 2], ..Residuals::all(residual_m) };
        assert_ne!(group(1), group(2));
        frame.add_return(&[on(0.3, 1), on(0.1, 2)]);
        frame.add_return(&[on(0.1, 1), on(-0.4, 2)]);
        let of = |wanted| {
            let total = frame.differences(0, 0).find(|(group, _)| *group == wanted).unwrap().1;
            (total.returns, total.mean_m2().unwrap())
        };
        let near = |(returns, mean_m2): (u64, f64), m2: f64| returns == 1 && (mean_m2 - m2).abs() < 1e-4;
        assert!(near(of(group(1)), 0.08) && near(of(group(2)), -0.15));
        let pair = frame.pair_sums().next().unwrap();
        let sum: i128 = frame.differences(0, 3).map(|(_, total)| total.sum).sum();
        assert_eq!(sum, pair.at(3).0.units() - pair.at(3).1.units());
        let returns = |run| frame.groups_of_run(run).map(|(_, sums)| sums.returns()).max();
        assert_eq!((returns(0), returns(1)), (Some(2), Some(2)));
    }

    #[test]
    fn a_pair_is_grouped_by_the_predictions_that_it_is_judged_by() {
        let group = |x| SurfaceGroup::of_cube([x, 0, 0]);
        // A fused run beside one with a given map: both count by R_near there.
        let mut frame = FrameSums::new(&[Basis::CrossValidated, Basis::Near]);
        let on = |residual_m, of_cv, of_near| Residuals {
            surfaces: [group(of_cv), group(of_near)],
            ..Residuals::all(residual_m)
        };
        frame.add_return(&[on(0.3, 1, 2), on(0.1, 3, 4)]);
        let of_pair = frame.differences(0, 0).find(|(_, total)| total.returns > 0).unwrap();
        assert_eq!(of_pair.0, group(2));
        let of_run = |run| frame.groups_of_run(run).find(|(_, sums)| sums.returns() > 0).unwrap().0;
        assert_eq!((of_run(0), of_run(1)), (group(1), group(4)));
    }

    #[test]
    fn parts_of_a_frame_merge_and_clear_empties() {
        let mut whole = FrameSums::new(&[Basis::CrossValidated, Basis::Near]);
        let mut parts = [whole.clone(), whole.clone()];
        for k in 0..40_000 {
            let surface = SurfaceGroup::of_cube([k / 100, 0, 0]);
            let returned = [f64::from(k) * 1e-3, -0.3]
                .map(|m| Residuals { surfaces: [surface; 2], ..Residuals::all(m) });
            whole.add_return(&returned);
            parts[usize::from(k % 3 == 0)].add_return(&returned);
        }
        let [mut first, second] = parts;
        first.merge(&second);
        assert_eq!(first.runs(), whole.runs());
        assert!(first.pair_sums().eq(whole.pair_sums()));
        assert!(first.differences(0, 1).eq(whole.differences(0, 1)));
        whole.clear();
        assert_eq!(whole.runs(), [RunSums::default(); 2]);
        assert!(whole.pair_sums().eq(FrameSums::new(whole.bases()).pair_sums()));
        assert!(whole.differences(0, 1).all(|(_, total)| total == Total::default()));
    }
}
