//! Puts the runs in order, by what is decided between them.

use dmp_reduce::{Basis, order_runs};
use dmp_revisit::apart::short_length;
use dmp_revisit::drift::{DriftComparison, DriftReport, RunDrift};

use crate::contents::Report;
use crate::pair::PairReport;
use crate::run::RunReport;
use crate::verdict::Verdict;

/// A run that predicts less than this share of what the other predicts, or finds less than this share of what the other finds again,
/// is not better by its drift either.
const LEAST_OF_OTHER: f64 = 0.5;

impl Report {
    /// Adds what was measured where runs come back.
    pub fn add_drift(&mut self, drift: Option<DriftReport>) {
        self.drift = drift;
        self.rank();
    }

    /// Orders the runs by the decided pairs, else by their first score. Neighbours are tied if their own pair exists and is
    /// undecided, or contradicts others. Pairs that the scores leave undecided are decided by drift, where it does.
    pub fn rank(&mut self) {
        self.decide_by_drift();
        let near = self.runs.iter().any(|run| run.coverage.is_none());
        let score = |run: &RunReport| if near { run.r_near_m2[0] } else { run.r_cv_m2[0] };
        let scores_m2: Vec<Option<f64>> = self.runs.iter().map(score).collect();
        let name = |run: usize| self.runs[run].name.clone();
        let names = self.names();
        let ranked = order_runs(&scores_m2, &self.among(&names, |pair| pair.verdict.better()));
        let tied = ranked.windows(2).filter(|pair| pair[0].tied_with_next);
        let ties = tied.map(|pair| [name(pair[0].run), name(pair[1].run)]);
        self.ties = ties.filter(|[a, b]| self.pair(a, b).is_some()).collect();
        self.order = ranked.iter().map(|ranked| name(ranked.run)).collect();
        self.list_equals();
    }

    fn decide_by_drift(&mut self) {
        let names = self.names();
        let by_scores = self.among(&names, |pair| pair.verdict.better());
        let place = |name: &str| names.iter().position(|run| run == name);
        let mut pairs = std::mem::take(&mut self.pairs);
        for pair in pairs.iter_mut().filter(|pair| pair.verdict == Verdict::Undecided) {
            let Some((drift, better)) = self.drifts_less(pair) else { continue };
            // What the scores decide about other pairs stands.
            let Some(both) = place(pair.other(&better)).zip(place(&better)) else { continue };
            if is_chain(&by_scores, both) {
                continue;
            }
            let [least_m, most_m] = if drift.a == better {
                [drift.rms_a_m, drift.rms_b_m]
            } else {
                [drift.rms_b_m, drift.rms_a_m]
            };
            let lost = |name: &str| self.drift_of(name).is_some_and(|run| run.pairs_lost > 0);
            let at_least = if lost(pair.other(&better)) { "at least " } else { "" };
            let off = |rms_m: Option<f64>| rms_m.map_or("an unknown length".to_owned(), short_length);
            pair.reason = format!(
                "by drift: {} against {at_least}{} (RMS at {} visits where both come back); the score is undecided",
                off(least_m),
                off(most_m),
                drift.pairs
            );
            pair.verdict = Verdict::Better { run: better, decided_at_m: None };
        }
        self.pairs = pairs;
    }

    /// The run of a pair that surely drifts less than the other, where both come back. Of a given map, poses say nothing.
    fn drifts_less(&self, pair: &PairReport) -> Option<(&DriftComparison, String)> {
        let mut compared = self.drift.iter().flat_map(|drift| &drift.comparisons);
        let drift = compared.find(|drift| pair.is_of(&drift.a, &drift.b))?;
        let better = drift.better.as_deref().filter(|name| *name == pair.a || *name == pair.b)?;
        let [of_better, of_other] = [self.seen_by(better)?, self.seen_by(pair.other(better))?];
        let is_enough = of_better.iter().zip(of_other).all(|(seen, other)| *seen >= LEAST_OF_OTHER * other);
        (is_enough && pair.basis == Basis::CrossValidated).then(|| (drift, better.to_owned()))
    }

    /// Returns that a run predicts, those that it finds on another visit, and the pairs of visits that it finds.
    fn seen_by(&self, name: &str) -> Option<[f64; 3]> {
        let (run, drift) = (self.run(name)?, self.drift_of(name)?);
        let returns = run.returns as f64;
        Some([returns * run.coverage?, returns * run.coverage_revisit?, drift.pairs_found as f64])
    }

    fn drift_of(&self, name: &str) -> Option<&RunDrift> {
        self.drift.as_ref()?.runs.iter().find(|run| run.name == name)
    }

    fn names(&self) -> Vec<String> {
        self.runs.iter().map(|run| run.name.clone()).collect()
    }

    /// Lists the runs that share a rank along what is better on the whole, where verdicts are mixed, else by name: nothing is
    /// decided between them, so their scores are no order.
    fn list_equals(&mut self) {
        let mut ranks: Vec<Vec<String>> = Vec::new();
        for (rank, run) in self.ranked() {
            match ranks.last_mut() {
                Some(shared) if rank.is_none() => shared.push(run.name.clone()),
                _ => ranks.push(vec![run.name.clone()]),
            }
        }
        let in_order = |mut runs: Vec<String>| {
            runs.sort();
            let ranked = order_runs(&vec![None; runs.len()], &self.among(&runs, |pair| pair.verdict.ahead()));
            ranked.into_iter().map(|ranked| runs[ranked.run].clone()).collect::<Vec<_>>()
        };
        let ranks: Vec<Vec<String>> = ranks.into_iter().map(in_order).collect();
        let is_tied = |[a, b]: &[String; 2]| {
            let is_open = |pair: &PairReport| pair.verdict.better().is_none();
            self.ties.iter().any(|tie| tie == &[a.clone(), b.clone()]) || self.pair(a, b).is_some_and(is_open)
        };
        // Ranks stay apart, whichever of their runs are neighbours now.
        let neighbours = ranks.iter().flat_map(|rank| rank.windows(2));
        self.ties = neighbours.map(|pair| [pair[0].clone(), pair[1].clone()]).filter(is_tied).collect();
        self.order = ranks.concat();
    }

    /// Of the pairs of these runs, which of them stands above which, by their places.
    fn among(
        &self,
        runs: &[String],
        above: impl for<'p> Fn(&'p PairReport) -> Option<&'p str>,
    ) -> Vec<(usize, usize)> {
        let place = |name: &str| runs.iter().position(|run| run == name);
        let both = |pair: &PairReport| {
            let better = above(pair)?;
            Some((place(better)?, place(pair.other(better))?))
        };
        self.pairs.iter().filter_map(both).collect()
    }
}

/// Whether a chain of decided pairs leads from the one run down to the other.
fn is_chain(decided: &[(usize, usize)], (from, to): (usize, usize)) -> bool {
    let (mut below, mut next) = (vec![from], 0);
    while let Some(&run) = below.get(next) {
        next += 1;
        let of_run = decided.iter().filter(|(better, _)| *better == run).map(|(_, worse)| *worse);
        let more: Vec<usize> = of_run.filter(|worse| !below.contains(worse)).collect();
        below.extend(more);
    }
    below[1..].contains(&to)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_data::scores;

    /// What drift says of the two last runs of the sample.
    fn of_last(drift: &mut DriftReport) -> &mut DriftComparison {
        let is_last = |pair: &&mut DriftComparison| {
            [&pair.a, &pair.b].into_iter().all(|name| name != "truth" && name != "noise")
        };
        drift.comparisons.iter_mut().find(is_last).unwrap()
    }

    /// The report of a score whose two last runs have this verdict, and of which drift says so.
    fn report_with(verdict: Verdict, less_drift: Option<&str>) -> Report {
        let mut report = scores();
        let last = report.pairs.iter_mut().find(|pair| pair.is_of("drift", "collapsed")).unwrap();
        last.verdict = verdict;
        let mut drift = report.drift.take().unwrap();
        drift.comparisons.iter_mut().for_each(|pair| pair.better = None);
        of_last(&mut drift).better = less_drift.map(str::to_owned);
        report.add_drift(Some(drift));
        assert_eq!(report.order[..2], ["truth", "noise"]);
        report
    }

    #[test]
    fn equals_are_listed_along_what_is_better_on_the_whole_else_by_name() {
        let listed = |verdict: Verdict| {
            let report = report_with(verdict, None);
            assert!(report.ranked().map(|(rank, _)| rank).eq([Some(1), Some(2), Some(3), None]));
            report.order[2..].join(" ")
        };
        let mixed = |run: &str| listed(Verdict::Mixed { run: run.into(), decided_at_m: 2.0 });
        assert_eq!(mixed("drift"), "drift collapsed");
        assert_eq!(mixed("collapsed"), "collapsed drift");
        assert_eq!(listed(Verdict::Undecided), "collapsed drift");
    }

    #[test]
    fn drift_decides_what_the_scores_leave_undecided_and_nothing_else() {
        let report = report_with(Verdict::Undecided, Some("drift"));
        assert!(report.ranked().map(|(rank, _)| rank).eq((1..=4).map(Some)));
        assert_eq!(report.order[2..], ["drift", "collapsed"]);
        let pair = report.pair("drift", "collapsed").unwrap();
        assert!(pair.verdict.is_by_drift() && pair.reason.starts_with("by drift: "));
        let by_score = Verdict::Better { run: "collapsed".into(), decided_at_m: Some(10.0) };
        for verdict in
            [by_score, Verdict::Same, Verdict::Mixed { run: "collapsed".into(), decided_at_m: 2.0 }]
        {
            let report = report_with(verdict.clone(), Some("drift"));
            assert_eq!(report.pair("drift", "collapsed").unwrap().verdict, verdict);
            assert_eq!(report.order[2..], ["collapsed", "drift"]);
        }
    }

    #[test]
    fn what_the_scores_decide_over_others_stands_and_ranks_do_not_depend_on_names() {
        // The first is better than the second, that than the third, by scores; drift prefers the third to the first.
        assert!(is_chain(&[(0, 1), (1, 2)], (0, 2)) && !is_chain(&[(0, 1), (1, 2)], (2, 0)));
        assert!(!is_chain(&[(0, 1)], (0, 2)) && is_chain(&[(0, 1), (1, 0)], (0, 1)));
        // `truth` is better than `noise`, and `drift` open against both: they do not join whatever they are called.
        for name in ["a", "zz"] {
            let mut report = report_with(Verdict::Undecided, None);
            report.runs.retain(|run| run.name != "collapsed");
            report.pairs.retain(|pair| pair.a != "collapsed" && pair.b != "collapsed");
            for pair in report.pairs.iter_mut().filter(|pair| !pair.is_of("truth", "noise")) {
                pair.verdict = Verdict::Undecided;
            }
            let renamed = |text: &mut String| {
                if text == "drift" {
                    name.clone_into(text);
                }
            };
            report.runs.iter_mut().for_each(|run| renamed(&mut run.name));
            report.pairs.iter_mut().for_each(|pair| [&mut pair.a, &mut pair.b].into_iter().for_each(renamed));
            report.rank();
            let ranks: Vec<(Option<usize>, &str)> =
                report.ranked().map(|(rank, run)| (rank, run.name.as_str())).collect();
            let shared = [(Some(2), "noise"), (None, "zz")];
            let expected = if name == "a" { [(Some(2), "a"), (None, "noise")] } else { shared };
            assert_eq!(ranks[1..], expected, "{ranks:?}");
        }
    }

    #[test]
    fn a_run_that_predicts_little_and_a_given_map_are_not_better_by_drift() {
        let is_decided = |change: &dyn Fn(&mut Report)| {
            let mut report = report_with(Verdict::Undecided, None);
            change(&mut report);
            let mut drift = report.drift.take().unwrap();
            of_last(&mut drift).better = Some("drift".into());
            report.add_drift(Some(drift));
            report.pair("drift", "collapsed").unwrap().verdict.is_by_drift()
        };
        assert!(is_decided(&|_| ()));
        let of = |name: &'static str, coverage: f64| {
            move |report: &mut Report| {
                report.runs.iter_mut().find(|run| run.name == name).unwrap().coverage = Some(coverage);
            }
        };
        assert!(!is_decided(&of("drift", 0.1)) && is_decided(&of("collapsed", 0.1)));
        let finds = |name: &'static str, pairs_found: usize| {
            move |report: &mut Report| {
                let drift = report.drift.as_mut().unwrap();
                drift.runs.iter_mut().find(|run| run.name == name).unwrap().pairs_found = pairs_found;
            }
        };
        assert!(!is_decided(&finds("collapsed", 1000)) && is_decided(&finds("drift", 1000)));
        assert!(!is_decided(&|report| report.pairs.iter_mut().for_each(|pair| pair.basis = Basis::Near)));
    }
}
