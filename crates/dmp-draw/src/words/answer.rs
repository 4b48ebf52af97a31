//! What a report says of its runs, in one sentence: for terminals and pages alike.

use dmp_report::{Best, Report, Verdict};

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

/// The one sentence that everybody reads; `shown` says how a name is written. It claims of the first run what its pairs say, no
/// more.
pub fn answer(report: &Report, shown: impl Fn(&str) -> String) -> String {
    let (first, others) = match report.order.as_slice() {
        [] => return "No run was scored.".to_owned(),
        [only] => {
            return format!(
                "{} was scored alone. Score another run of this log beside it to rank them.",
                shown(only)
            );
        }
        [first, other] => {
            return of_two(report.verdict_between(first, other), [first.as_str(), other.as_str()], shown);
        }
        [first, others @ ..] => (first, others),
    };
    if let Some(Best::Run(_)) = report.best() {
        let others = match others.len() {
            count if count > LISTED => format!("all {count} others"),
            _ => listed(others.iter().map(|name| shown(name)).collect()),
        };
        return format!("{} is best: better than {others}.", shown(first));
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

fn of_two(verdict: Option<&Verdict>, names: [&str; 2], shown: impl Fn(&str) -> String) -> String {
    let ahead = verdict.and_then(Verdict::ahead);
    // Around a cycle, and where it is better only on the whole, the better run may stand below.
    let [a, b] = if ahead == Some(names[1]) { [names[1], names[0]] } else { names }.map(shown);
    match verdict {
        Some(Verdict::Better { .. }) => format!("{a} is better than {b}."),
        Some(Verdict::Mixed { .. }) => {
            format!("{a} is better than {b} on the whole, but worse at some places.")
        }
        Some(Verdict::Same) => format!("{a} and {b} are the same, for practical purposes."),
        Some(Verdict::Undecided) => format!("Nothing is decided between {a} and {b}."),
        None => format!("{a} and {b} were not compared."),
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

    #[test]
    fn many_names_are_counted() {
        let names = |count: usize| (0..count).map(|k| format!("r{k}")).collect();
        assert_eq!(listed(names(1)), "r0");
        assert_eq!(listed(names(5)), "r0, r1, r2, r3 and r4");
        assert_eq!(listed(names(12)), "r0, r1, r2, r3 and 8 more");
    }
}
