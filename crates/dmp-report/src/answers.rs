//! What people ask a report.

use dmp_reduce::Basis;

use crate::contents::Report;
use crate::pair::PairReport;
use crate::run::RunReport;
use crate::verdict::Verdict;

/// Which run made the best map.
#[derive(Debug, Clone, PartialEq)]
pub enum Best<'a> {
    /// This one: it is decided to be better than every other.
    Run(&'a RunReport),
    /// The run that stands first, and those that it is not decided to be better than, in their order.
    Tie(Vec<&'a RunReport>),
}

impl Report {
    /// The run that is called so.
    pub fn run(&self, name: &str) -> Option<&RunReport> {
        self.runs.iter().find(|run| run.name == name)
    }

    /// The runs in their order, best first.
    pub fn in_order(&self) -> impl Iterator<Item = &RunReport> {
        self.order.iter().filter_map(|name| self.run(name))
    }

    /// The runs in their order, each with its rank, from 1; `None` where it shares that of the run above: nothing is decided
    /// between the two, and no run of that rank is decided to be better.
    pub fn ranked(&self) -> impl Iterator<Item = (Option<usize>, &RunReport)> {
        let mut of_rank: Vec<&str> = Vec::new();
        self.in_order().enumerate().map(move |(place, run)| {
            let name = run.name.as_str();
            let is_tied = |above: &&str| self.ties.iter().any(|[a, b]| a == above && b == name);
            let is_better =
                |other: &&str| self.verdict_between(other, name).and_then(Verdict::better) == Some(*other);
            let is_shared = of_rank.last().is_some_and(is_tied) && !of_rank.iter().any(is_better);
            if !is_shared {
                of_rank.clear();
            }
            of_rank.push(name);
            ((!is_shared).then_some(place + 1), run)
        })
    }

    /// Which run made the best map: one that is decided to be better than every other, be it alone, or the first of the
    /// order with those that it is not decided to be better than. `None` where there is no run.
    pub fn best(&self) -> Option<Best<'_>> {
        let mut order = self.in_order();
        let first = order.next()?;
        let is_better = |other: &&RunReport| {
            self.verdict_between(&first.name, &other.name).and_then(Verdict::better) == Some(&first.name)
        };
        let others: Vec<&RunReport> = order.filter(|other| !is_better(other)).collect();
        Some(match others.as_slice() {
            [] => Best::Run(first),
            _ => Best::Tie(std::iter::once(first).chain(others).collect()),
        })
    }

    /// The names of the runs that share the first rank.
    pub fn leaders(&self) -> Vec<&str> {
        let ranked = self.ranked().enumerate();
        ranked
            .take_while(|(place, (rank, _))| *place == 0 || rank.is_none())
            .map(|(_, (_, run))| run.name.as_str())
            .collect()
    }

    /// The comparison of two runs, whichever stands first in it; `None` where they were not compared.
    pub fn pair(&self, one: &str, other: &str) -> Option<&PairReport> {
        self.pairs.iter().find(|pair| pair.is_of(one, other))
    }

    /// What is decided between two runs; `None` where they were not compared.
    ///
    /// ```
    /// use dmp_report::{Report, Verdict};
    ///
    /// fn is_worse(report: &Report, new: &str, old: &str) -> bool {
    ///     report.verdict_between(new, old).and_then(Verdict::better) == Some(old)
    /// }
    /// ```
    pub fn verdict_between(&self, one: &str, other: &str) -> Option<&Verdict> {
        self.pair(one, other).map(|pair| &pair.verdict)
    }

    /// A run's score at a truncation, m²: `R_cv` or `R_near`, by `basis`. `None` also where the run is not there, has no
    /// such score, or none at `scale_m`.
    pub fn score_of(&self, run: &str, basis: Basis, scale_m: f64) -> Option<f64> {
        self.run(run)?.scores(basis).at(scale_m)
    }

    /// Whether at least one run's map was fused from the scans, so that there is `R_cv`.
    pub fn is_cross_validated(&self) -> bool {
        self.runs.iter().any(|run| run.coverage.is_some())
    }

    /// The score whose first truncation leads the table of the runs: `R_cv`, or `R_near` where all maps were given.
    pub fn leading_basis(&self) -> Basis {
        if self.is_cross_validated() { Basis::CrossValidated } else { Basis::Near }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_data::scores;

    #[test]
    fn the_best_is_one_or_a_tie() {
        let mut report = scores();
        assert!(matches!(report.best(), Some(Best::Run(run)) if run.name == "truth"));
        assert_eq!(report.in_order().map(|run| run.name.as_str()).collect::<Vec<_>>(), report.order);
        // The last two share a rank until one is better.
        assert!(report.ranked().map(|(rank, _)| rank).eq([Some(1), Some(2), Some(3), None]));
        let last = report.pairs.iter_mut().find(|pair| pair.is_of("drift", "collapsed")).unwrap();
        last.verdict = Verdict::Better { run: "drift".into(), decided_at_m: Some(10.0) };
        report.ties.clear();
        assert!(report.ranked().map(|(rank, _)| rank).eq((1..=4).map(Some)));
        let pair = report.pairs.iter_mut().find(|pair| pair.is_of("drift", "truth")).unwrap();
        assert_eq!((pair.other("drift"), pair.decided_at().unwrap().scale_m), ("truth", 10.0));
        pair.verdict = Verdict::Undecided;
        let Some(Best::Tie(runs)) = report.best() else { panic!("{:?}", report.pairs) };
        assert_eq!(runs.iter().map(|run| run.name.as_str()).collect::<Vec<_>>(), ["truth", "drift"]);
        let order = report.order.clone();
        let mut undecided = |a: &str, b: &str| {
            report.ties.push([a.into(), b.into()]);
            let pair = report.pairs.iter_mut().find(|pair| pair.is_of(a, b)).unwrap();
            pair.verdict = Verdict::Undecided;
            report.ranked().map(|(rank, _)| rank).collect::<Vec<_>>()
        };
        assert_eq!(undecided(&order[1], &order[2]), [Some(1), Some(2), None, Some(4)]);
        // Undecided against the run above, and yet worse than another one of that rank.
        assert_eq!(undecided(&order[2], &order[3]), [Some(1), Some(2), None, Some(4)]);
        assert_eq!(undecided(&order[1], &order[3]), [Some(1), Some(2), None, None]);
        report.order.clear();
        assert_eq!(report.best(), None);
    }

    #[test]
    fn pairs_and_scores_are_found_by_name() {
        let report = scores();
        assert_eq!(report.verdict_between("noise", "truth"), report.verdict_between("truth", "noise"));
        assert_eq!(report.verdict_between("noise", "truth").and_then(Verdict::better), Some("truth"));
        assert_eq!(report.verdict_between("noise", "x"), None);
        let score_m2 = report.score_of("truth", Basis::CrossValidated, 2.0);
        assert_eq!(score_m2, report.runs[0].r_cv_m2[1]);
        assert_eq!(report.score_of("truth", Basis::Near, 0.5), report.runs[0].r_near_m2[2]);
        assert_eq!(report.score_of("truth", Basis::Near, 3.0), None);
        assert_eq!(report.score_of("x", Basis::Near, 0.5), None);
    }
}
