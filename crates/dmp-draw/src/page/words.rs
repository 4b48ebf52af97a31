//! The pairs of runs, told to somebody who knows neither residuals nor squares.

use dmp::{Reach, Report, ScaleReport, Scales, Verdict};

use crate::plot::escape;
use crate::text::{count, digits};
use crate::told::{ToldPair, told_pairs};

/// A name that stands out.
pub(super) fn strong(name: &str) -> String {
    format!("<strong>{}</strong>", escape(name))
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
