//! The ranking, told to somebody who knows neither residuals nor squares.

use dmp::{PairReport, Reach, Report, ScaleReport, Scales};

use crate::plot::escape;
use crate::text::{count, digits};

/// With more runs than this, only neighbours in the order and pairs with the best are told.
const ALL_PAIRS_UP_TO: usize = 5;

fn strong(name: &str) -> String {
    format!("<strong>{}</strong>", escape(name))
}

/// How the first run of the order stands to another one.
enum Against<'a> {
    Better,
    Worse,
    /// Better on the whole is the run of this name.
    Mixed(&'a str),
    Same,
    Undecided,
    NotCompared,
}

fn against<'a>(report: &'a Report, best: &str, other: &str) -> Against<'a> {
    let Some(pair) = pair_of(report, best, other) else { return Against::NotCompared };
    match (&pair.decided_at_m, &pair.better_on_the_whole) {
        (None, _) if pair.is_same => Against::Same,
        (None, _) => Against::Undecided,
        (_, Some(better)) => Against::Mixed(better),
        (Some(_), None) if pair.verdict == best => Against::Better,
        (Some(_), None) => Against::Worse,
    }
}

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
    let stands = |kind: &dyn Fn(&Against<'_>) -> bool| -> Vec<String> {
        others.iter().filter(|other| kind(&against(report, best, other))).map(|name| strong(name)).collect()
    };
    if let [other] = others {
        return match against(report, best, other) {
            Against::Better => format!("{} made the better map of the two.", strong(best)),
            Against::Worse => format!("{} made the better map of the two.", strong(other)),
            Against::Mixed(better) => {
                let worse = if better == best.as_str() { other } else { best };
                let (better, worse) = (strong(better), strong(worse));
                format!(
                    "{better} made the better map of the two on the whole, but {worse} is better at some places."
                )
            }
            Against::Same => {
                format!("{} and {} made the same map, for practical purposes.", strong(best), strong(other))
            }
            Against::Undecided => {
                format!("Nothing is decided between {} and {}.", strong(best), strong(other))
            }
            Against::NotCompared => format!("{} and {} were not compared.", strong(best), strong(other)),
        };
    }
    let all = others.len() + 1;
    if stands(&|kind| !matches!(kind, Against::Better)).is_empty() {
        return format!("{} made the best map of {all} runs.", strong(best));
    }
    let mut clauses = Vec::new();
    for (words, names) in [
        ("it is better than", stands(&|kind| matches!(kind, Against::Better))),
        ("it is the same as", stands(&|kind| matches!(kind, Against::Same))),
        ("nothing is decided against", stands(&|kind| matches!(kind, Against::Undecided))),
        ("at some places better, at others worse than", stands(&|kind| matches!(kind, Against::Mixed(_)))),
        ("worse than", stands(&|kind| matches!(kind, Against::Worse))),
        ("not compared with", stands(&|kind| matches!(kind, Against::NotCompared))),
    ] {
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

fn pair_of<'a>(report: &'a Report, a: &str, b: &str) -> Option<&'a PairReport> {
    report.pairs.iter().find(|pair| (pair.a == a && pair.b == b) || (pair.a == b && pair.b == a))
}

/// A sentence for each pair that matters, as HTML.
pub(super) fn pairs(report: &Report) -> Vec<String> {
    let order = &report.order;
    let mut said = Vec::new();
    for (i, high) in order.iter().enumerate() {
        for (j, low) in order.iter().enumerate().skip(i + 1) {
            let told = order.len() <= ALL_PAIRS_UP_TO || i == 0 || j == i + 1;
            if let Some(pair) = pair_of(report, high, low).filter(|_| told) {
                said.push(of_pair(report, pair, high, low));
            }
        }
    }
    said
}

fn of_pair(report: &Report, pair: &PairReport, high: &str, low: &str) -> String {
    let scale = pair.scales.iter().find(|scale| Some(scale.scale_m) == pair.decided_at_m);
    let Some(scale) = scale else {
        let more = pair.frames_needed.map(|needed| (needed, "scans"));
        let more = more.or(pair.places_needed.map(|needed| (needed, "places")));
        let more = more.map_or_else(String::new, |(needed, what)| {
            format!("; about {} {what} in all would decide", count(needed))
        });
        return format!("{} and {}: {}{more}.", strong(high), strong(low), escape(&pair.reason));
    };
    let better = pair.better_on_the_whole.as_deref().unwrap_or(&pair.verdict);
    let worse = if better == pair.a { &pair.b } else { &pair.a };
    let verb =
        if pair.better_on_the_whole.is_some() { "is better on the whole than" } else { "is better than" };
    let mut sentence = format!(
        "{} {verb} {}: {}.",
        strong(better),
        strong(worse),
        reach(scale.scale_m, report.config.scales)
    );
    if let Some(numbers) = numbers(pair, scale, better) {
        sentence.push(' ');
        sentence.push_str(&numbers);
    }
    if pair.is_same {
        sentence.push_str(" The difference is too small to matter.");
    }
    if pair.better_on_the_whole.is_some() {
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
fn numbers(pair: &PairReport, scale: &ScaleReport, better: &str) -> Option<String> {
    let is_a = better == pair.a;
    let (mean_a_m2, mean_b_m2) = (scale.mean_a_m2?, scale.mean_b_m2?);
    let (own_m2, other_m2) = if is_a { (mean_a_m2, mean_b_m2) } else { (mean_b_m2, mean_a_m2) };
    let [low, high] = scale.interval_m2?;
    // How much worse the other is: positive.
    let [from_m2, to_m2] = if is_a { [-high, -low] } else { [low, high] };
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
