//! The ranking, told to somebody who knows neither residuals nor squares.

use dmp::{PairReport, Report, ScaleReport};

use crate::plot::escape;
use crate::text::digits;

/// With more runs than this, only neighbours in the order and pairs with the best are told.
const ALL_PAIRS_UP_TO: usize = 5;

fn strong(name: &str) -> String {
    format!("<strong>{}</strong>", escape(name))
}

/// The one sentence that everybody reads, as HTML.
pub(super) fn answer(report: &Report) -> String {
    let count = report.order.len();
    let [best, second] = match report.order.as_slice() {
        [] => return "No run was scored.".to_owned(),
        [only] => {
            return format!(
                "{} was scored alone. Its numbers say where its map is wrong; whether it is a good one shows beside another \
                 run of this log.",
                strong(only)
            );
        }
        [best, second, ..] => [best, second],
    };
    let of = if count == 2 {
        "the better map of the two".to_owned()
    } else {
        format!("the best map of {count} runs")
    };
    match pair_of(report, best, second) {
        None => format!(
            "{} stands first of {count} runs, but was not compared with {}, which stands second.",
            strong(best),
            strong(second)
        ),
        Some(pair) if pair.decided_at_m.is_none() => {
            let tied = tied_with_best(report);
            let names: Vec<String> = tied.iter().map(|name| strong(name)).collect();
            format!("No run is clearly best: nothing is decided between {}.", listed(&names))
        }
        Some(pair) if pair.better_on_the_whole.is_some() => format!(
            "{} made {of} on the whole, but {} is better at some places.",
            strong(best),
            strong(second)
        ),
        Some(_) => format!("{} made {of}.", strong(best)),
    }
}

/// The best run and those right behind it that are not decided against the one above.
fn tied_with_best(report: &Report) -> Vec<&str> {
    let mut names: Vec<&str> = report.order.iter().take(1).map(String::as_str).collect();
    for pair in report.order.windows(2) {
        if !report.ties.iter().any(|tie| tie == pair) {
            break;
        }
        names.push(&pair[1]);
    }
    names
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
        return format!("{} and {}: {}.", strong(high), strong(low), escape(&pair.reason));
    };
    let better = pair.better_on_the_whole.as_deref().unwrap_or(&pair.verdict);
    let worse = if better == pair.a { &pair.b } else { &pair.a };
    let verb =
        if pair.better_on_the_whole.is_some() { "is better on the whole than" } else { "is better than" };
    let mut sentence = format!("{} {verb} {}: {}.", strong(better), strong(worse), reach(scale.scale_m));
    if let Some(numbers) = numbers(report, pair, scale, better) {
        sentence.push(' ');
        sentence.push_str(&numbers);
    }
    if pair.better_on_the_whole.is_some() {
        sentence.push_str(" Not everywhere: ");
        sentence.push_str(&escape(&pair.reason));
        sentence.push('.');
    }
    sentence
}

/// What a scale says about the maps.
fn reach(scale_m: f64) -> &'static str {
    match scale_m {
        m if m >= 5.0 => "its map as a whole fits together better",
        m if m >= 1.0 => "its map fits together better at the scale of a metre",
        m if m >= 0.5 => "as a whole both fit alike, but its surfaces are sharper by decimetres",
        _ => "they differ by centimetres only",
    }
}

/// By how much one is better, and whether that may be chance.
fn numbers(report: &Report, pair: &PairReport, scale: &ScaleReport, better: &str) -> Option<String> {
    let is_a = better == pair.a;
    let (mean_a_m2, mean_b_m2) = (scale.mean_a_m2?, scale.mean_b_m2?);
    let (own_m2, other_m2) = if is_a { (mean_a_m2, mean_b_m2) } else { (mean_b_m2, mean_a_m2) };
    let [low, high] = scale.ci99_m2?;
    // How much worse the other is: positive.
    let [from_m2, to_m2] = if is_a { [-high, -low] } else { [low, high] };
    let percent = (1e4 * report.sampling.confidence).round() / 1e2;
    Some(format!(
        "It predicts what the sensor measured to {} m, the other to {} m (root mean square, errors counted up to {} m); at \
         {percent} % confidence the mean squares differ by {} to {} m².",
        digits(own_m2.sqrt()),
        digits(other_m2.sqrt()),
        scale.scale_m,
        digits(from_m2),
        digits(to_m2)
    ))
}
