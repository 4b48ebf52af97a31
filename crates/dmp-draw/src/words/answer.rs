//! What a report says of its runs, in one or two sentences: for terminals and pages alike.

use dmp_report::{Best, Report, RunReport, Verdict, Withheld};
use dmp_revisit::apart::short_length;
use dmp_revisit::drift::{DriftReport, RunDrift};

use crate::text::percent;

/// So many runs are listed by name.
const LISTED: usize = 5;

/// How the first run of the order may stand to another one: in words, and whether it does, by what is decided between
/// them and its name.
type Standing = (&'static str, fn(Option<&Verdict>, &str) -> bool);

const STANDINGS: [Standing; 6] = [
    ("better than", |verdict, best| verdict.and_then(Verdict::better) == Some(best)),
    ("the same as", |verdict, _| matches!(verdict, Some(Verdict::Same))),
    ("undecided against", |verdict, _| matches!(verdict, Some(Verdict::Undecided))),
    ("better at some places and worse at others than", |verdict, _| {
        matches!(verdict, Some(Verdict::Mixed { .. }))
    }),
    ("worse than", |verdict, best| verdict.and_then(Verdict::better).is_some_and(|better| better != best)),
    ("not compared with", |verdict, _| verdict.is_none()),
];

/// The sentences that everybody reads: what is decided, and how near the runs come back to where they were; `shown` says how a
/// name is written. They claim what the pairs and the drift say, no more.
pub fn answer(report: &Report, shown: impl Fn(&str) -> String) -> String {
    let shown = |name: &str| shown(name);
    let decided = decided(report, &shown);
    let said = match revisits(report, &shown) {
        Some(Revisits::OfFirst(first, clause)) => match decided.strip_prefix(&first) {
            Some(rest) => format!("{first} ({clause}){rest}"),
            None => decided,
        },
        Some(Revisits::Sentence(sentence)) => format!("{decided} {sentence}"),
        None => decided,
    };
    [said].into_iter().chain(poor(report, &shown)).collect::<Vec<_>>().join(" ")
}

/// Runs of which a verdict says little: those with poses for few of the scans, and those whose map hardly holds the scans.
fn poor(report: &Report, shown: &dyn Fn(&str) -> String) -> Option<String> {
    let scans = report.runs.iter().map(|run| run.frames).max()?;
    let of_run = |run: &RunReport| {
        if 2 * run.frames < scans {
            return Some(format!("{} has poses for only {} of {scans} scans", shown(&run.name), run.frames));
        }
        let is_low = run.r_cv_withheld.as_ref().is_some_and(Withheld::is_low_coverage);
        let coverage = run.coverage.filter(|_| is_low)?;
        Some(format!(
            "only {} % of the returns of {} meet what other scans saw",
            percent(coverage),
            shown(&run.name)
        ))
    };
    let all: Vec<String> = report.runs.iter().filter_map(of_run).collect();
    (!all.is_empty()).then(|| format!("But {}: see the warnings.", listed(all)))
}

fn decided(report: &Report, shown: &dyn Fn(&str) -> String) -> String {
    let (first, others) = match report.order.as_slice() {
        [] => return "No run was scored.".to_owned(),
        [only] => {
            let drift = report.drift.as_ref().and_then(|drift| run_of(drift, only));
            let error = match drift.and_then(|run| Some((run, run.median_m.value?))) {
                Some((run, _)) if run.pairs_lost > 0 => format!(", and {}", off(run, "")),
                Some((_, median_m)) => format!(", with a revisit error of {}", short_length(median_m)),
                None => String::new(),
            };
            return format!(
                "{} was scored alone{error}. Score another run of this log beside it to rank them.",
                shown(only)
            );
        }
        [first, other] => return of_two(report, [first, other], shown),
        [first, others @ ..] => (first, others),
    };
    if let Some(Best::Run(_)) = report.best() {
        let others = match others.len() {
            count if count > LISTED => format!("all {count} others"),
            _ => listed(others.iter().map(|name| shown(name)).collect()),
        };
        return format!("{} is best: better than {others}.", shown(first));
    }
    let leaders = report.leaders();
    if leaders.len() > 1 {
        return of_leaders(report, &leaders, shown);
    }
    let mut clauses = Vec::new();
    for (words, is_so) in STANDINGS {
        let such = others.iter().filter(|other| is_so(report.verdict_between(first, other), first));
        let names: Vec<String> = such.map(|other| shown(other)).collect();
        if !names.is_empty() {
            clauses.push(format!("{words} {}", listed(names)));
        }
    }
    let (all, clauses) = (report.order.len(), clauses.join("; "));
    format!("No run is clearly the best of {all}. {} stands first: {clauses}.", shown(first))
}

fn of_two(report: &Report, names: [&str; 2], shown: &dyn Fn(&str) -> String) -> String {
    let pair = report.pair(names[0], names[1]);
    let verdict = pair.map(|pair| &pair.verdict);
    let ahead = verdict.and_then(Verdict::ahead);
    // Around a cycle, and where it is better only on the whole, the better run may stand below.
    let [a, b] = if ahead == Some(names[1]) { [names[1], names[0]] } else { names }.map(shown);
    match verdict {
        Some(Verdict::Better { .. }) => format!("{a} is better than {b}."),
        Some(Verdict::Mixed { .. }) => {
            format!("{a} is better than {b} on the whole, but worse at some places.")
        }
        Some(Verdict::Same) => format!("{a} and {b} are the same{}.", apart(report, &names)),
        Some(Verdict::Undecided) => {
            format!("Nothing is decided between {a} and {b}{}.", differing(report, &names))
        }
        None => format!("{a} and {b} were not compared."),
    }
}

/// Of several runs that share the first rank.
fn of_leaders(report: &Report, leaders: &[&str], shown: &dyn Fn(&str) -> String) -> String {
    let pairs = || leaders.iter().enumerate().flat_map(|(k, a)| leaders[..k].iter().map(move |b| (*a, *b)));
    let are_same = pairs().all(|(a, b)| report.verdict_between(a, b) == Some(&Verdict::Same));
    let names = listed(leaders.iter().map(|name| shown(name)).collect());
    let said = if are_same {
        format!("{names} are the same{}", apart(report, leaders))
    } else if pairs().any(|(a, b)| matches!(report.verdict_between(a, b), Some(Verdict::Mixed { .. }))) {
        format!("{names} share the first rank: none is better everywhere")
    } else {
        format!("{names} share the first rank{}", differing(report, leaders))
    };
    let others = report.order.len() - leaders.len();
    let is_worse = |other: &&String| {
        let beats =
            |leader: &&str| report.verdict_between(leader, other).and_then(Verdict::better) == Some(*leader);
        leaders.iter().any(beats)
    };
    let worse = report.order.iter().skip(leaders.len()).filter(is_worse).count();
    match (worse, others) {
        (_, 0) => format!("{said}."),
        (1, 1) => format!("{said}. {} is worse.", shown(&report.order[leaders.len()])),
        (worse, others) if worse == others => format!("{said}. The {others} others are worse."),
        (worse, others) => format!("{said}. {worse} of the {others} others are worse."),
    }
}

/// The most that any two of these runs are apart, and whether between visits.
fn most_apart(report: &Report, names: &[&str]) -> Option<(f64, bool)> {
    let pairs = names.iter().enumerate().flat_map(|(k, a)| names[..k].iter().map(move |b| (a, b)));
    let worst = pairs.filter_map(|(a, b)| Some(report.pair(a, b)?.apart.as_ref()?.worst()));
    worst.max_by(|a, b| a.0.total_cmp(&b.0))
}

fn apart(report: &Report, names: &[&str]) -> String {
    let limit_m = report.promise.same_within_m;
    most_apart(report, names).map_or_else(String::new, |(worst_m, is_between)| {
        let limit = short_length(if is_between { 2.0 * limit_m } else { limit_m });
        match short_length(worst_m).as_str() {
            "0 cm" => ": nowhere apart".to_owned(),
            worst => {
                format!(": nowhere more than {worst} apart, where {limit} count as the same (--same-within)")
            }
        }
    })
}

fn differing(report: &Report, names: &[&str]) -> String {
    let limit_m = report.promise.same_within_m;
    most_apart(report, names).map_or_else(String::new, |(worst_m, is_between)| {
        let at = if is_between { " between visits" } else { "" };
        let why = if worst_m <= if is_between { 2.0 * limit_m } else { limit_m } {
            " where both have a pose, but one has none for many scans"
        } else {
            ", and the scans do not show which is right"
        };
        format!(": they are up to {} apart{at}{why}", short_length(worst_m))
    })
}

/// How near runs come back.
enum Revisits {
    /// Of the run that the sentence before begins with, and its name.
    OfFirst(String, String),
    Sentence(String),
}

/// How near the runs come back to where they were: what drift decides, also where it speaks against the scores.
fn revisits(report: &Report, shown: &dyn Fn(&str) -> String) -> Option<Revisits> {
    let drift = report.drift.as_ref()?;
    let leaders = report.leaders();
    let is_leader = |name: &str| leaders.contains(&name);
    let is_best = matches!(report.best(), Some(Best::Run(_))) && report.order.len() > 1;
    // (better, its error, worse, its error), those with the largest difference first.
    let mut decided: Vec<(&str, f64, &RunDrift)> = Vec::new();
    for pair in &drift.comparisons {
        let Some(better) = pair.better.as_deref() else { continue };
        let worse = if pair.a == better { &pair.b } else { &pair.a };
        let found = run_of(drift, better).and_then(|run| run.median_m.value).zip(run_of(drift, worse));
        decided.extend(found.map(|(median_m, worse)| (better, median_m, worse)));
    }
    let off_m =
        |run: &RunDrift| if run.pairs_lost > 0 { f64::INFINITY } else { run.median_m.value.unwrap_or(0.0) };
    decided.sort_by(|a, b| off_m(b.2).total_cmp(&off_m(a.2)));
    let against = decided.iter().filter(|(better, ..)| !is_leader(better)).find(|(.., w)| is_leader(&w.name));
    let among = decided.iter().find(|(better, _, w)| is_leader(better) && is_leader(&w.name));
    let for_it = decided.iter().find(|(better, _, w)| is_leader(better) && !is_leader(&w.name));
    let said = |(better, median_m, worse): &(&str, f64, &RunDrift)| {
        let [better, worse_name] = [better, worse.name.as_str()].map(shown);
        format!(
            "{better} has a revisit error of {}, {worse_name} {}",
            short_length(*median_m),
            off(worse, "one of ")
        )
    };
    match (against, among, for_it) {
        (Some(against), ..) => Some(Revisits::Sentence(format!("But {}.", said(against)))),
        (None, Some(among), _) => Some(Revisits::Sentence(format!("{}.", said(among)))),
        (None, None, Some((better, median_m, worse))) if is_best => Some(Revisits::OfFirst(
            shown(better),
            format!("revisit error {}, {} {}", short_length(*median_m), shown(&worse.name), off(worse, "")),
        )),
        (None, None, Some(for_it)) => Some(Revisits::Sentence(format!("{}.", said(for_it)))),
        (None, None, None) => {
            let run = leaders.first().and_then(|first| run_of(drift, first)).filter(|_| is_best)?;
            run.median_m.value?;
            let error = off(run, "revisit error ").trim_start_matches("is ").to_owned();
            Some(Revisits::OfFirst(shown(&run.name), error))
        }
    }
}

fn run_of<'d>(drift: &'d DriftReport, name: &str) -> Option<&'d RunDrift> {
    drift.runs.iter().find(|run| run.name == name)
}

/// How far a run is off at revisits, with a word or two before the length: `one of 15.6 cm`, `is lost at 4 of 14 visits`.
fn off(run: &RunDrift, before: &str) -> String {
    match run.median_m.value {
        _ if run.pairs_lost > 0 => format!("is lost at {} of {} visits", run.pairs_lost, run.pairs_measured),
        Some(median_m) => format!("{before}{}", short_length(median_m)),
        None => "has no answer".to_owned(),
    }
}

/// `a, b and c`; of many the first and how many more there are.
fn listed(mut names: Vec<String>) -> String {
    if names.len() > LISTED {
        let more = names.len() - (LISTED - 1);
        names.truncate(LISTED - 1);
        names.push(format!("{more} more"));
    }
    match names.as_slice() {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_data::sample;

    #[test]
    fn many_names_are_counted() {
        let names = |count: usize| (0..count).map(|k| format!("r{k}")).collect();
        assert_eq!(listed(names(1)), "r0");
        assert_eq!(listed(names(5)), "r0, r1, r2, r3 and r4");
        assert_eq!(listed(names(12)), "r0, r1, r2, r3 and 8 more");
    }

    fn said(report: &Report) -> String {
        answer(report, str::to_owned)
    }

    #[test]
    fn scores_and_drift_are_both_said_and_neither_overrules() {
        let mut report = sample();
        assert_eq!(
            said(&report),
            "truth (revisit error 0.4 cm) is best: better than noise, collapsed and drift."
        );
        let drift = report.drift.as_mut().unwrap();
        let of = |drift: &mut DriftReport, a: &str, b: &str, better: &str| {
            let pair = drift.comparisons.iter_mut().find(|pair| pair.a == a && pair.b == b).unwrap();
            pair.better = Some(better.to_owned());
        };
        of(drift, "truth", "drift", "truth");
        assert!(said(&report).contains(" (revisit error 0.4 cm, drift 1.0 m) "), "{}", said(&report));
        report.drift.as_mut().unwrap().runs[1].pairs_lost = 2;
        assert!(said(&report).contains("(revisit error 0.4 cm, drift is lost at 2 of "), "{}", said(&report));
        let drift_before = report.drift.clone();
        let alone = DriftReport { comparisons: Vec::new(), ..report.drift.clone().unwrap() };
        let lost = alone.runs.iter().position(|run| run.name == "truth").unwrap();
        report.drift = Some(alone);
        report.drift.as_mut().unwrap().runs[lost].pairs_lost = 3;
        assert!(said(&report).contains("truth (lost at 3 of "), "{}", said(&report));
        report.drift = drift_before;
        of(report.drift.as_mut().unwrap(), "truth", "noise", "noise");
        let against = " But noise has a revisit error of 2.6 cm, truth one of 0.4 cm.";
        assert!(said(&report).ends_with(against), "{}", said(&report));
    }

    #[test]
    fn equal_runs_are_the_same_and_open_ones_so_far_apart() {
        let mut report = sample();
        report.drift = None;
        for pair in &mut report.pairs {
            let are_first = pair.is_of("truth", "noise");
            pair.verdict = if are_first { Verdict::Same } else { pair.verdict.clone() };
        }
        report.rank();
        let start = "noise and truth are the same: nowhere more than 16 cm apart, where 4.0 cm count as the same (--same-within).";
        assert!(said(&report).starts_with(start), "{}", said(&report));
        assert!(said(&report).ends_with(" The 2 others are worse."), "{}", said(&report));
        for pair in &mut report.pairs {
            pair.verdict =
                if pair.is_of("truth", "noise") { Verdict::Undecided } else { pair.verdict.clone() };
        }
        let open = "noise and truth share the first rank: they are up to 16 cm apart, and the scans do not show which is right.";
        assert!(said(&report).starts_with(open), "{}", said(&report));
    }
}
