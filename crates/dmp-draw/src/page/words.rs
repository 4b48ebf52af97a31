//! The pairs of runs, told to somebody who knows neither residuals nor squares.

use dmp::{Reach, Report, Scales, Verdict};

use crate::drift::{metres, metres_between};
use crate::plot::escape;
use crate::text::count;
use crate::told::{ToldPair, told_pairs};

/// A name that stands out.
pub(super) fn strong(name: &str) -> String {
    format!("<strong>{}</strong>", escape(name))
}

/// A line for each pair that matters, as HTML.
pub(super) fn pairs(report: &Report) -> Vec<String> {
    told_pairs(report).iter().map(|told| of_pair(told, report.config.scales)).collect()
}

/// One line: who is better, by how much, and at which truncation; or why nothing is decided.
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
    let by = match told.rms_behind_m(scale) {
        Some((by_m, Some(interval_m))) => format!(" by {} ({})", metres(by_m), metres_between(interval_m)),
        Some((by_m, None)) => format!(" by {}", metres(by_m)),
        None => String::new(),
    };
    let (at, reach) = (scale.scale_m, reach(scale.scale_m, scales));
    match &pair.verdict {
        Verdict::Mixed { .. } => {
            let where_not = escape(&pair.reason);
            format!(
                "{first} is better than {second} on the whole{by} at {at} m. Not everywhere: {where_not}."
            )
        }
        verdict if verdict.is_same() => {
            format!("{first} is better than {second}{by} at {at} m: too little to matter.")
        }
        _ => format!("{first} is better than {second}{by} at {at} m: {reach}."),
    }
}

/// What a truncation says about the maps.
fn reach(scale_m: f64, scales: Scales) -> &'static str {
    match scales.lengths().reach(scale_m) {
        Reach::Global => "its map as a whole fits together better",
        Reach::Middle(_) => "its map fits together better",
        Reach::Local(_) | Reach::Fine(_) => "its surfaces are sharper",
    }
}

/// What the lengths of the lines are, and why they are not those of the ranking.
pub(super) fn lengths(report: &Report) -> Option<&'static str> {
    let is_any_decided = told_pairs(report).iter().any(|told| told.pair.decided_at().is_some());
    is_any_decided.then_some(
        "Lengths say how much larger the root mean square of the residuals is, over the returns that both maps predict, with its \
         interval. The ranking below is of all returns, so its rows differ by something else. Residuals are \
         truncated at the second length: the larger it is, the more they see of the map as a whole.",
    )
}
