//! The ranking, told to somebody who knows neither residuals nor squares.

use dmp::{Best, Reach, Report, ScaleReport, Scales, Verdict};

use crate::plot::escape;
use crate::text::{count, digits};
use crate::told::{ToldPair, told_pairs};

fn strong(name: &str) -> String {
    format!("<strong>{}</strong>", escape(name))
}

/// How the first run of the order may stand to another one: in words, and whether it does, by what is decided between
/// them and its name.
type Standing = (&'static str, fn(Option<&Verdict>, &str) -> bool);

const STANDINGS: [Standing; 6] = [
    ("it is better than", |verdict, best| verdict.and_then(Verdict::better) == Some(best)),
    ("it is the same as", |verdict, _| matches!(verdict, Some(Verdict::Same))),
    ("nothing is decided against", |verdict, _| matches!(verdict, Some(Verdict::Undecided))),
    ("at some places better, at others worse than", |verdict, _| {
        matches!(verdict, Some(Verdict::Mixed { .. }))
    }),
    ("worse than", |verdict, best| verdict.and_then(Verdict::better).is_some_and(|better| better != best)),
    ("not compared with", |verdict, _| verdict.is_none()),
];

/// The one sentence that everybody reads, as HTML. It claims of the first run what its pairs say, no more.
pub(super) fn answer(report: &Report) -> String {
    let (best, others) = match report.order.as_slice() {
        [] => return "No run was scored.".to_owned(),
        [only] => {
            return format!(
                "{} was scored alone. Its numbers say where its map is wrong; whether it is a good one shows beside another \
                 run of this log.",
                strong(only)
            );
        }
        [best, others @ ..] => (best, others),
    };
    let against = |other: &str| report.verdict_between(best, other);
    if let [other] = others {
        let (best, other) = (strong(best), strong(other));
        return match against(&others[0]) {
            Some(Verdict::Better { run, .. }) => format!("{} made the better map of the two.", strong(run)),
            Some(Verdict::Mixed { run, .. }) => {
                let better = strong(run);
                let worse = if better == best { other } else { best };
                format!(
                    "{better} made the better map of the two on the whole, but {worse} is better at some places."
                )
            }
            Some(Verdict::Same) => format!("{best} and {other} made the same map, for practical purposes."),
            Some(Verdict::Undecided) => format!("Nothing is decided between {best} and {other}."),
            None => format!("{best} and {other} were not compared."),
        };
    }
    let all = others.len() + 1;
    if let Some(Best::Run(_)) = report.best() {
        return format!("{} made the best map of {all} runs.", strong(best));
    }
    let mut clauses = Vec::new();
    for (words, is_so) in STANDINGS {
        let names = others.iter().filter(|other| is_so(against(other), best)).map(|other| strong(other));
        let names: Vec<String> = names.collect();
        if !names.is_empty() {
            clauses.push(format!("{words} {}", listed(&names)));
        }
    }
    format!("No run is clearly the best of {all}. {} stands first: {}.", strong(best), clauses.join("; "))
}

fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// A sentence for each pair that matters, as HTML.
pub(super) fn pairs(report: &Report) -> Vec<String> {
    told_pairs(report).iter().map(|told| of_pair(told, report.config.scales)).collect()
}

fn of_pair(told: &ToldPair<'_>, scales: Scales) -> String {
    let (pair, first, second) = (told.pair, strong(told.first), strong(told.second));
    let Some(scale) = pair.decided_at() else {
        let more = pair.frames_needed.map(|needed| (needed, "scans"));
        let more = more.or(pair.places_needed.map(|needed| (needed, "places")));
        let more = more.map_or_else(String::new, |(needed, what)| {
            format!("; about {} {what} in all would decide", count(needed))
        });
        return format!("{first} and {second}: {}{more}.", escape(&pair.reason));
    };
    let is_mixed = matches!(pair.verdict, Verdict::Mixed { .. });
    let verb = if is_mixed { "is better on the whole than" } else { "is better than" };
    let mut sentence = format!("{first} {verb} {second}: {}.", reach(scale.scale_m, scales));
    if let Some(numbers) = numbers(told, scale) {
        sentence.push(' ');
        sentence.push_str(&numbers);
    }
    if pair.verdict.is_same() {
        sentence.push_str(" The difference is too small to matter.");
    }
    if is_mixed {
        sentence.push_str(" Not everywhere: ");
        sentence.push_str(&escape(&pair.reason));
        sentence.push('.');
    }
    sentence
}

/// What a scale says about the maps.
fn reach(scale_m: f64, scales: Scales) -> String {
    let (what, unit) = match scales.lengths().reach(scale_m) {
        Reach::Global => return "its map as a whole fits together better".to_owned(),
        Reach::Middle(unit) => ("its map fits together better", unit),
        Reach::Local(unit) | Reach::Fine(unit) => ("its surfaces are sharper", unit),
    };
    format!("{what} at the scale of {unit}s, beyond which nothing is decided")
}

/// By how much one is better, and whether that may be chance.
fn numbers(told: &ToldPair<'_>, scale: &ScaleReport) -> Option<String> {
    let [own_m2, other_m2] = told.means_m2(scale);
    let (own_m2, other_m2) = (own_m2?, other_m2?);
    // How much worse the other is: positive.
    let [to_m2, from_m2] = told.interval_m2(scale)?.map(|end_m2| -end_m2);
    Some(format!(
        "It predicts what the sensor measured to {} m, the other to {} m (root mean square, errors counted up to {} m); the mean \
         squares differ by {} to {} m².",
        digits(own_m2.sqrt()),
        digits(other_m2.sqrt()),
        scale.scale_m,
        digits(from_m2),
        digits(to_m2)
    ))
}
