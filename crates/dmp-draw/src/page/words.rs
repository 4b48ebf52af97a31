//! The pairs of runs in words, for readers who know neither residuals nor squares.

use dmp_reduce::{Reach, Scales};
use dmp_report::{Report, Verdict};

use crate::plot::escape;
use crate::words::{OrderedPair, main_pairs, metres, metres_between};

/// A name that stands out.
pub(super) fn strong(name: &str) -> String {
    format!("<strong>{}</strong>", escape(name))
}

/// A line for each pair that matters, as HTML.
pub(super) fn pairs(report: &Report) -> Vec<String> {
    main_pairs(report).iter().map(|ordered| of_pair(ordered, report.config.scales)).collect()
}

/// One line: who is better, by how much, and at which truncation; or why nothing is decided.
fn of_pair(ordered: &OrderedPair<'_>, scales: Scales) -> String {
    let (pair, first, second) = (ordered.pair, strong(ordered.first), strong(ordered.second));
    let Some(scale) = pair.decided_at() else {
        let reason = escape(&pair.reason);
        let better = pair.verdict.better().map(|better| (strong(better), strong(pair.other(better))));
        return better.map_or_else(
            || format!("{first} and {second}: {reason}."),
            |(better, other)| format!("{better} is better than {other} {reason}."),
        );
    };
    let by = match ordered.rms_behind_m(scale) {
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
    let is_any_decided = main_pairs(report).iter().any(|ordered| ordered.pair.decided_at().is_some());
    is_any_decided.then_some(
        "A length is how much larger the RMS residual is over the returns that both maps predict, with its interval. The ranking \
         below uses all returns, so its rows differ by other amounts. Residuals are truncated at the second length: a larger \
         one sees more of the map as a whole.",
    )
}
