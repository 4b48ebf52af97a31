//! Whether what is expected holds.

use std::fmt;

use dmp::{PairReport, Report, Verdict};
use serde::Serialize;

use super::expect::{Bound, Expect, Limit, What};
use crate::console::Usage;

/// The result of a gate for one run, or for one pair. Part of the command's JSON.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct GateReport {
    /// The option, as it was given.
    pub(super) gate: String,
    /// The run that it is about.
    pub(super) run: String,
    /// The run that this one was compared with; null for a limit.
    pub(super) against: Option<String>,
    /// The score; null where two runs were compared.
    pub(super) score: Option<String>,
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

/// Rejects a gate on a run, or a version of a suite, that is not there.
pub(super) fn check_name(gate: &str, kind: &str, name: &str, names: &[&str]) -> Result<(), Usage> {
    if names.contains(&name) {
        return Ok(());
    }
    let known = names.join(", ");
    Err(Usage(format!("--expect {gate}: no {kind} is called `{name}`; the {kind}s are {known}")))
}

impl Expect {
    /// The runs that it names.
    fn names(&self) -> Vec<&str> {
        match &self.what {
            What::Limit(limit) => limit.run.iter().map(String::as_str).collect(),
            What::Best(name) | What::Unbeaten(name) => vec![name],
            What::Same(pair) => pair.iter().flat_map(|(a, b)| [a.as_str(), b.as_str()]).collect(),
        }
    }

    /// Rejects what these runs can never pass or fail.
    pub(super) fn check_names(&self, runs: &[&str]) -> Result<(), Usage> {
        let names = self.names();
        names.iter().try_for_each(|name| check_name(&self.text, "run", name, runs))?;
        if let [a, b] = names.as_slice()
            && a == b
        {
            return Err(Usage(format!("--expect {}: a run is always the same as itself", self.text)));
        }
        if runs.len() < 2 && !matches!(self.what, What::Limit(_)) {
            return Err(Usage(format!("--expect {}: there is no other run to compare with", self.text)));
        }
        Ok(())
    }

    /// Its result for each run, or each pair, that it is about. It fails for runs that were excluded.
    pub(super) fn check(&self, report: &Report) -> Vec<GateReport> {
        let names = self.names();
        let gone =
            report.left_out.iter().filter(|run| names.is_empty() || names.contains(&run.name.as_str()));
        let mut gates: Vec<GateReport> =
            gone.map(|run| GateReport { reason: run.reason.clone(), ..self.of_run(&run.name) }).collect();
        let is_known = gates.is_empty() || names.is_empty();
        match &self.what {
            What::Limit(limit) => gates.extend(self.check_limit(limit, report)),
            _ if !is_known => {}
            What::Best(name) => {
                gates.extend(self.check_pairs(name, report, |verdict| verdict.better() == Some(name)));
            }
            What::Unbeaten(name) => {
                let holds = |verdict: &Verdict| verdict.better().is_none_or(|better| better == name);
                gates.extend(self.check_pairs(name, report, holds));
            }
            What::Same(Some((a, b))) => {
                gates.push(self.check_pair(a, b, report, |verdict| *verdict == Verdict::Same));
            }
            What::Same(None) => {
                for (k, a) in report.order.iter().enumerate() {
                    let others = report.order.iter().skip(k + 1);
                    gates.extend(
                        others.map(|b| self.check_pair(a, b, report, |verdict| *verdict == Verdict::Same)),
                    );
                }
            }
        }
        gates
    }

    fn of_run(&self, run: &str) -> GateReport {
        GateReport { gate: format!("--expect {}", self.text), run: run.to_owned(), ..GateReport::default() }
    }

    fn check_limit(&self, limit: &Limit, report: &Report) -> Vec<GateReport> {
        let runs = report.runs.iter().filter(|run| limit.run.as_ref().is_none_or(|name| run.name == *name));
        let check = |run: &dmp::RunReport| {
            let score = limit.score;
            let value = score.of(run);
            let (passed, reason) = match &value {
                Err(why) => (false, format!("{} is not given: {why}", score.title())),
                Ok(value) => {
                    let (passed, side) = match limit.bound {
                        Bound::Most => (*value <= limit.value, "above"),
                        Bound::Least => (*value >= limit.value, "below"),
                    };
                    let mut shown = [*value, limit.value].map(|value| score.show(value));
                    // Rounded they may look alike.
                    if shown[0] == shown[1] && *value != limit.value {
                        shown = [*value, limit.value].map(|value| score.show_exactly(value));
                    }
                    let [shown, limit] = shown;
                    let not = if passed { "not " } else { "" };
                    (passed, format!("{} is {shown}, {not}{side} {limit}", score.title()))
                }
            };
            GateReport {
                score: Some(score.name()),
                value: value.ok(),
                limit: Some(limit.value),
                unit: Some(score.unit()),
                passed,
                reason,
                ..self.of_run(&run.name)
            }
        };
        runs.map(check).collect()
    }

    /// The pair with each other run; it fails where no other is left.
    fn check_pairs(&self, name: &str, report: &Report, passes: impl Fn(&Verdict) -> bool) -> Vec<GateReport> {
        let others = report.order.iter().filter(|other| *other != name);
        let gates: Vec<GateReport> =
            others.map(|other| self.check_pair(name, other, report, &passes)).collect();
        match report.left_out.first() {
            Some(gone) if gates.is_empty() => {
                let reason = format!("there is no other run to compare with: {}", gone.reason);
                vec![GateReport { reason, ..self.of_run(name) }]
            }
            _ => gates,
        }
    }

    /// The pair of two runs; it fails where they were not compared.
    fn check_pair(
        &self,
        name: &str,
        other: &str,
        report: &Report,
        passes: impl Fn(&Verdict) -> bool,
    ) -> GateReport {
        let pair = report.pair(name, other);
        let reason = match (pair, &self.what) {
            (None, _) => format!("not compared with {other}: no result holds both, nor was each kept"),
            (Some(pair), What::Same(_)) => how_same(pair, other),
            (Some(pair), _) => in_words(pair, name, other),
        };
        let passed = pair.is_some_and(|pair| passes(&pair.verdict));
        GateReport { against: Some(other.to_owned()), passed, reason, ..self.of_run(name) }
    }
}

/// How far a run is apart from another one.
fn how_same(pair: &PairReport, other: &str) -> String {
    let apart = pair.apart.as_ref().map_or("no two scans have poses in both".to_owned(), ToString::to_string);
    let is = if pair.verdict == Verdict::Same { "the same as" } else { "not the same as" };
    format!("{is} {other}: {apart}")
}

/// The verdict of a pair, from the side of the run `name`.
fn in_words(pair: &PairReport, name: &str, other: &str) -> String {
    let at = |scale_m: &f64| format!("at {} {scale_m} m", pair.basis);
    match &pair.verdict {
        Verdict::Better { run, decided_at_m, .. } => {
            let word = if run == name { "better" } else { "worse" };
            let by = decided_at_m.as_ref().map_or("by drift".to_owned(), at);
            format!("{word} than {other}, {by}")
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
    use super::super::expect::parse;
    use dmp::{Apart, Spread};

    use super::*;
    use crate::example_reports;

    fn results(what: &str, report: &Report) -> Vec<String> {
        let word = |gate: &GateReport| format!("{} {gate}", if gate.passed { "passed" } else { "FAILED" });
        parse(what).unwrap().check(report).iter().map(word).collect()
    }

    /// What is expected of three runs, and of two with given maps, and the lines that are printed without the gate itself.
    #[test]
    fn gates_pass_and_fail() {
        let (three, given) = (example_reports::three_runs(), example_reports::given_maps());
        let cases: [(&Report, &str, &[&str]); 9] = [
            (
                &three,
                "R_cv<1.5",
                &[
                    "FAILED drift: R_cv 10 m is not given: coverage is 0.431, below 0.5",
                    "FAILED größe: R_cv 10 m is 1.57 m, above 1.50 m",
                    "passed truth: R_cv 10 m is 1.50 m, not above 1.50 m",
                ],
            ),
            // Not a limit that reads like the score.
            (&three, "drift:coverage>43.11%", &["FAILED drift: coverage is 43.1 %, below 43.11 %"]),
            (&three, "truth:DMP<3.4", &["FAILED truth: DMP mean is 3.46 m², above 3.40 m²"]),
            (&given, "a:coverage>1%", &["FAILED a: coverage is not given: the map was given"]),
            (
                &given,
                "R_near_0.5<3cm",
                &[
                    "passed a: R_near 0.5 m is 2.00 cm, not above 3.00 cm",
                    "FAILED b: R_near 0.5 m is 4.00 cm, above 3.00 cm",
                ],
            ),
            (
                &three,
                "best:truth",
                &["FAILED truth: undecided against größe", "passed truth: better than drift, at R_cv 10 m"],
            ),
            (
                &three,
                "best:größe",
                &[
                    "FAILED größe: undecided against truth",
                    "FAILED größe: mixed against drift: better on the whole, at R_cv 10 m, worse at places",
                ],
            ),
            // Undecided and mixed do not beat anyone.
            (
                &three,
                "unbeaten:größe",
                &[
                    "passed größe: undecided against truth",
                    "passed größe: mixed against drift: better on the whole, at R_cv 10 m, worse at places",
                ],
            ),
            (
                &three,
                "unbeaten:drift",
                &[
                    "FAILED drift: worse than truth, at R_cv 10 m",
                    "passed drift: mixed against größe: worse on the whole, at R_cv 10 m, better at places",
                ],
            ),
        ];
        for (report, what, expected) in cases {
            let expected: Vec<String> =
                expected.iter().map(|line| format!("{line} (--expect {what})")).collect();
            assert_eq!(results(what, report), expected);
        }
        let gate = &parse("drift:coverage>43.11%").unwrap().check(&three)[0];
        assert_eq!((gate.value, gate.limit, gate.unit), (Some(0.431), Some(0.4311), Some("share")));
        assert_eq!(gate.score.as_deref(), Some("coverage"));
    }

    #[test]
    fn the_same_is_more_than_undecided() {
        let mut report = example_reports::three_runs();
        let spread =
            |worst_m| Spread { pairs: 9, median_m: 0.01, most_m: 0.02, worst_m, worst_scans: [3, 7] };
        for pair in &mut report.pairs {
            let (within, between) = (spread(0.021), Some(spread(0.3)));
            pair.apart = Some(Apart { scans: 99, scans_of_one: 0, within, between });
        }
        let apart =
            "not the same as größe: up to 2.1 cm apart along the way, 30 cm between visits (scans 3 to 7)";
        assert_eq!(
            results("same:truth,größe", &report),
            [format!("FAILED truth: {apart} (--expect same:truth,größe)")]
        );
        for pair in &mut report.pairs {
            pair.verdict = Verdict::Better { run: "truth".into(), decided_at_m: None };
        }
        assert_eq!(
            results("best:truth", &report)[0],
            "passed truth: better than größe, by drift (--expect best:truth)"
        );
        for pair in &mut report.pairs {
            pair.verdict = Verdict::Same;
        }
        let same = &results("same:truth,größe", &report)[0];
        assert!(same.starts_with("passed truth: the same as größe: up to 2.1 cm apart"), "{same}");
        assert_eq!(results("same", &report).len(), 3);
        report.pairs.clear();
        let gates = parse("best:truth").unwrap().check(&report);
        assert!(gates.len() == 2 && gates.iter().all(|gate| !gate.passed), "{gates:?}");
        assert_eq!(gates[0].reason, "not compared with größe: no result holds both, nor was each kept");
    }

    #[test]
    fn runs_must_be_there() {
        for (what, runs, error) in [
            ("c:R_cv<1", ["a", "b"].as_slice(), "no run is called `c`; the runs are a, b"),
            ("best:a", &["a"], "there is no other run to compare with"),
            ("same:a,c", &["a", "b"], "no run is called `c`; the runs are a, b"),
            ("same:a,a", &["a", "b"], "a run is always the same as itself"),
        ] {
            let found = parse(what).unwrap().check_names(runs).unwrap_err().to_string();
            assert_eq!(found, format!("--expect {what}: {error}"));
        }
        for (what, runs) in [("R_cv<1", ["a"].as_slice()), ("same", &["a", "b"]), ("same:b,a", &["a", "b"])] {
            assert!(parse(what).unwrap().check_names(runs).is_ok(), "{what}");
        }
    }
}
