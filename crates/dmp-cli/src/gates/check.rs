//! Whether what was asked for holds.

use std::fmt;

use dmp::{LeftOutReport, PairReport, Report, ScaleReport, Verdict};
use dmp_draw::text::plain_digits;
use serde::Serialize;

use super::limit::{Bound, Limit};
use crate::exit::Usage;

/// A gate that was asked for.
#[derive(Debug, Clone)]
pub(super) enum Asked {
    /// A score on the right side of a limit.
    Limit(Limit, Bound),
    /// The run decided to be better than each other.
    Best(String),
    /// No run decided to be better than this.
    Unbeaten(String),
    /// Two runs the same, or all of them.
    Same(Option<(String, String)>),
}

/// What became of a gate for one run, or for one pair. Part of the command's JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct GateReport {
    /// The option, as it was given.
    pub(super) gate: String,
    /// The run that it is about.
    pub(super) run: String,
    /// The run that this one was compared with; null for a limit.
    pub(super) against: Option<String>,
    /// The score; null where two runs were compared.
    pub(super) score: Option<&'static str>,
    /// Its value, as the table has it; null where it is not given. Of a suite, a number of logs.
    pub(super) value: Option<f64>,
    /// Its limit.
    pub(super) limit: Option<f64>,
    /// The unit of both: `m`, `m2`, `share` or `logs`.
    pub(super) unit: Option<&'static str>,
    /// Whether it holds.
    pub(super) passed: bool,
    /// Why, in words.
    pub(super) reason: String,
}

impl fmt::Display for GateReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} ({})", self.run, self.reason, self.gate)
    }
}

impl Asked {
    fn text(&self) -> String {
        match self {
            Self::Limit(limit, Bound::Above) => format!("--fail-above {}", limit.text),
            Self::Limit(limit, Bound::Below) => format!("--fail-below {}", limit.text),
            Self::Best(name) => format!("--expect-best {name}"),
            Self::Unbeaten(name) => format!("--expect-unbeaten {name}"),
            Self::Same(None) => "--expect-same".to_owned(),
            Self::Same(Some((a, b))) => format!("--expect-same={a},{b}"),
        }
    }

    /// Refuses what these runs can never pass or fail.
    pub(super) fn refuse_unknown(&self, runs: &[&str]) -> Result<(), Usage> {
        let (names, compares) = match self {
            Self::Limit(limit, _) => (limit.run.iter().collect(), false),
            Self::Best(name) | Self::Unbeaten(name) => (vec![name], true),
            Self::Same(None) => (Vec::new(), true),
            Self::Same(Some((a, b))) => (vec![a, b], true),
        };
        if let Some(name) = names.iter().find(|name| !runs.contains(&name.as_str())) {
            return Err(unknown_run(&self.text(), name, runs));
        }
        if let [a, b] = names.as_slice()
            && a == b
        {
            return Err(Usage(format!("{}: a run is always the same as itself", self.text())));
        }
        if compares && runs.len() < 2 {
            return Err(Usage(format!("{}: there is no other run to compare with", self.text())));
        }
        Ok(())
    }

    /// What became of it for each run, or each pair, that it is about.
    pub(super) fn check(&self, report: &Report) -> Vec<GateReport> {
        let gone = report.left_out.iter().filter(|run| self.is_about(&run.name));
        let failed = |run: &LeftOutReport| GateReport {
            gate: self.text(),
            run: run.name.clone(),
            against: None,
            score: None,
            value: None,
            limit: None,
            unit: None,
            passed: false,
            reason: run.reason.clone(),
        };
        gone.map(failed).chain(self.check_scored(report)).collect()
    }

    /// Whether it fails where this run is not scored.
    fn is_about(&self, run: &str) -> bool {
        match self {
            Self::Limit(limit, _) => limit.run.as_ref().is_none_or(|name| name == run),
            Self::Best(name) | Self::Unbeaten(name) => name == run,
            Self::Same(pair) => pair.as_ref().is_none_or(|(a, b)| a == run || b == run),
        }
    }

    fn check_scored(&self, report: &Report) -> Vec<GateReport> {
        let is_gone = |name: &String| report.left_out.iter().any(|run| run.name == *name);
        match self {
            Self::Best(name) | Self::Unbeaten(name) if is_gone(name) => Vec::new(),
            Self::Same(Some((a, b))) if is_gone(a) || is_gone(b) => Vec::new(),
            Self::Limit(limit, bound) => self.check_limit(limit, *bound, report),
            Self::Best(name) => self.check_pairs(name, report, |verdict| verdict.better() == Some(name)),
            Self::Unbeaten(name) => {
                self.check_pairs(name, report, |verdict| verdict.better().is_none_or(|better| better == name))
            }
            Self::Same(Some((a, b))) => vec![self.check_pair(a, b, report, Verdict::is_same)],
            Self::Same(None) => {
                let all = report.order.iter().enumerate();
                let each = |(k, a): (usize, &String)| {
                    let others = report.order.iter().skip(k + 1);
                    others.map(|b| self.check_pair(a, b, report, Verdict::is_same)).collect::<Vec<_>>()
                };
                all.flat_map(each).collect()
            }
        }
    }

    fn check_limit(&self, limit: &Limit, bound: Bound, report: &Report) -> Vec<GateReport> {
        let runs = report.runs.iter().filter(|run| limit.run.as_ref().is_none_or(|name| run.name == *name));
        let check = |run| {
            let score = limit.score;
            let value = score.of(run);
            let (passed, reason) = match &value {
                Err(why) => (false, format!("{} is not given: {why}", score.title)),
                Ok(value) => {
                    let (passed, side) = match bound {
                        Bound::Above => (*value <= limit.value, "above"),
                        Bound::Below => (*value >= limit.value, "below"),
                    };
                    let mut shown = [*value, limit.value].map(|value| score.show(value));
                    // Rounded they may look alike.
                    if shown[0] == shown[1] && *value != limit.value {
                        shown = [*value, limit.value].map(|value| score.show_exactly(value));
                    }
                    let [shown, limit] = shown;
                    let not = if passed { "not " } else { "" };
                    (passed, format!("{} is {shown}, {not}{side} {limit}", score.title))
                }
            };
            GateReport {
                gate: self.text(),
                run: run.name.clone(),
                against: None,
                score: Some(score.name),
                value: value.ok(),
                limit: Some(limit.value),
                unit: Some(score.unit.name()),
                passed,
                reason,
            }
        };
        runs.map(check).collect()
    }

    /// The pair with each other run, as far as there is one.
    fn check_pairs(&self, name: &str, report: &Report, passes: impl Fn(&Verdict) -> bool) -> Vec<GateReport> {
        let others = report.order.iter().filter(|other| *other != name);
        others.map(|other| self.check_pair(name, other, report, &passes)).collect()
    }

    /// The pair of two runs, as far as there is one.
    fn check_pair(
        &self,
        name: &str,
        other: &str,
        report: &Report,
        passes: impl Fn(&Verdict) -> bool,
    ) -> GateReport {
        let pair = report.pair(name, other);
        GateReport {
            gate: self.text(),
            run: name.to_owned(),
            against: Some(other.to_owned()),
            score: None,
            value: None,
            limit: None,
            unit: None,
            passed: pair.is_some_and(|pair| passes(&pair.verdict)),
            reason: match (pair, self) {
                (None, _) => format!("not compared with {other}: no result holds both, nor was each kept"),
                (Some(pair), Self::Same(_)) => how_same(pair, other),
                (Some(pair), _) => told(pair, name, other),
            },
        }
    }
}

/// A run that no gate can speak of.
fn unknown_run(option: &str, name: &str, runs: &[&str]) -> Usage {
    Usage(format!("{option}: no run is called `{name}`; the runs are {}", runs.join(", ")))
}

/// How far a run may be apart from another one, at the scale that says most.
fn how_same(pair: &PairReport, other: &str) -> String {
    let of_margin = |scale: &ScaleReport| Some(scale.apart_at_most_m? / scale.margin_m?);
    let most = pair.scales.iter().filter_map(|scale| Some((scale, of_margin(scale)?)));
    let most = most.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(scale, _)| scale);
    let Some(scale) = most else { return format!("nothing is known of how far it is from {other}") };
    let length = |m: Option<f64>| format!("{} cm", plain_digits(100.0 * m.unwrap_or_default()));
    let (apart, margin) = (length(scale.apart_at_most_m), length(scale.margin_m));
    let at = format!("at {} {} m", pair.basis, scale.scale_m);
    match pair.verdict.is_same() {
        true => format!("the same as {other}: at most {apart} apart {at}, {margin} would be"),
        false if scale.apart_at_most_m <= scale.margin_m => {
            format!("not the same as {other}: one of the two predicts far fewer returns")
        }
        false => {
            format!("not the same as {other}: up to {apart} apart {at}, where {margin} count as the same")
        }
    }
}

/// What a pair says of the run `name`.
fn told(pair: &PairReport, name: &str, other: &str) -> String {
    let at = |scale_m: &f64| format!("at {} {scale_m} m", pair.basis);
    match &pair.verdict {
        Verdict::Better { run, decided_at_m, .. } => {
            let word = if run == name { "better" } else { "worse" };
            format!("{word} than {other}, {}", at(decided_at_m))
        }
        Verdict::Mixed { run, decided_at_m, .. } => {
            let [word, else_word] = if run == name { ["better", "worse"] } else { ["worse", "better"] };
            let at = at(decided_at_m);
            format!("mixed against {other}: {word} on the whole, {at}, {else_word} at places")
        }
        Verdict::Same => format!("the same as {other}"),
        Verdict::Undecided => format!("undecided against {other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::limit::{above, below};
    use super::*;
    use crate::example_reports;

    fn told(asked: &Asked, report: &Report) -> Vec<String> {
        let word = |gate: &GateReport| format!("{} {gate}", if gate.passed { "passed" } else { "FAILED" });
        asked.check(report).iter().map(word).collect()
    }

    #[test]
    fn a_limit_is_for_one_run_or_all() {
        let report = example_reports::three_runs();
        let all = Asked::Limit(above("R_cv=1.5").unwrap(), Bound::Above);
        let expected = [
            "FAILED drift: R_cv 10 m is not given: coverage is 0.431, below 0.5 (--fail-above R_cv=1.5)",
            "FAILED größe: R_cv 10 m is 1.57 m, above 1.50 m (--fail-above R_cv=1.5)",
            "passed truth: R_cv 10 m is 1.50 m, not above 1.50 m (--fail-above R_cv=1.5)",
        ];
        assert_eq!(told(&all, &report), expected);
        let one = Asked::Limit(below("drift:coverage=43.11%").unwrap(), Bound::Below);
        let gates = one.check(&report);
        assert_eq!(gates.len(), 1);
        // Not a limit that reads like the score.
        assert_eq!(gates[0].reason, "coverage is 43.1 %, below 43.11 %");
        assert_eq!(
            (gates[0].value, gates[0].limit, gates[0].unit),
            (Some(0.431), Some(0.4311), Some("share"))
        );
        let squares = Asked::Limit(above("truth:DMP=3.4").unwrap(), Bound::Above);
        assert_eq!(
            told(&squares, &report),
            ["FAILED truth: DMP mean is 3.46 m², above 3.40 m² (--fail-above truth:DMP=3.4)"]
        );
        let given = example_reports::given_maps();
        let coverage = Asked::Limit(below("a:coverage=1%").unwrap(), Bound::Below);
        let withheld = "FAILED a: coverage is not given: the map was given (--fail-below a:coverage=1%)";
        assert_eq!(told(&coverage, &given), [withheld]);
        let near = Asked::Limit(above("R_near_0.5=3cm").unwrap(), Bound::Above);
        let expected = [
            "passed a: R_near 0.5 m is 2.00 cm, not above 3.00 cm (--fail-above R_near_0.5=3cm)",
            "FAILED b: R_near 0.5 m is 4.00 cm, above 3.00 cm (--fail-above R_near_0.5=3cm)",
        ];
        assert_eq!(told(&near, &given), expected);
    }

    #[test]
    fn the_best_is_decided_against_every_other() {
        let report = example_reports::three_runs();
        let expected = [
            "FAILED truth: undecided against größe (--expect-best truth)",
            "passed truth: better than drift, at R_cv 10 m (--expect-best truth)",
        ];
        assert_eq!(told(&Asked::Best("truth".into()), &report), expected);
        let expected = [
            "FAILED größe: undecided against truth (--expect-best größe)",
            "FAILED größe: mixed against drift: better on the whole, at R_cv 10 m, worse at places (--expect-best größe)",
        ];
        assert_eq!(told(&Asked::Best("größe".into()), &report), expected);
        // Undecided and mixed do not beat anyone.
        assert!(Asked::Unbeaten("größe".into()).check(&report).iter().all(|gate| gate.passed));
        let expected = [
            "FAILED drift: worse than truth, at R_cv 10 m (--expect-unbeaten drift)",
            "passed drift: mixed against größe: worse on the whole, at R_cv 10 m, better at places (--expect-unbeaten drift)",
        ];
        assert_eq!(told(&Asked::Unbeaten("drift".into()), &report), expected);
    }

    #[test]
    fn the_same_is_more_than_undecided() {
        let mut report = example_reports::three_runs();
        let asked = Asked::Same(Some(("truth".into(), "größe".into())));
        // The scale is told at which most is left possible, in parts of what counts as the same.
        for pair in &mut report.pairs {
            pair.scales.iter_mut().for_each(|scale| {
                scale.margin_m = Some(if scale.scale_m == 0.5 { 0.01 } else { 0.015 });
            });
        }
        let apart = "FAILED truth: not the same as größe: up to 2.00 cm apart at R_cv 0.5 m, where 1.00 cm count as the same \
                     (--expect-same=truth,größe)";
        assert_eq!(told(&asked, &report)[0], apart);
        for pair in &mut report.pairs {
            pair.verdict = Verdict::Same;
            pair.scales.iter_mut().for_each(|scale| scale.margin_m = Some(0.03));
        }
        assert!(
            told(&asked, &report)[0].starts_with("passed truth: the same as größe: at most 2.00 cm apart")
        );
        assert_eq!(told(&Asked::Same(None), &report).len(), 3);
        let refused = |pair: Option<(&str, &str)>| {
            let pair = pair.map(|(a, b)| (a.to_owned(), b.to_owned()));
            Asked::Same(pair).refuse_unknown(&["a", "b"]).err().map(|usage| usage.to_string())
        };
        assert_eq!((refused(None), refused(Some(("b", "a")))), (None, None));
        assert!(refused(Some(("a", "c"))).unwrap().contains("no run is called `c`"));
        assert!(refused(Some(("a", "a"))).unwrap().ends_with("a run is always the same as itself"));
    }

    #[test]
    fn runs_that_were_not_compared_fail() {
        let mut report = example_reports::three_runs();
        report.pairs.clear();
        for asked in [Asked::Best("truth".into()), Asked::Unbeaten("truth".into())] {
            let gates = asked.check(&report);
            assert!(gates.len() == 2 && gates.iter().all(|gate| !gate.passed), "{gates:?}");
            assert_eq!(gates[0].reason, "not compared with größe: no result holds both, nor was each kept");
        }
    }

    #[test]
    fn runs_must_be_there() {
        let refused = |asked: &Asked, runs: &[&str]| asked.refuse_unknown(runs).unwrap_err().to_string();
        let limit = Asked::Limit(above("c:R_cv=1").unwrap(), Bound::Above);
        assert_eq!(
            refused(&limit, &["a", "b"]),
            "--fail-above c:R_cv=1: no run is called `c`; the runs are a, b"
        );
        let alone = "--expect-best a: there is no other run to compare with";
        assert_eq!(refused(&Asked::Best("a".into()), &["a"]), alone);
        assert!(Asked::Limit(above("R_cv=1").unwrap(), Bound::Above).refuse_unknown(&["a"]).is_ok());
    }
}
