//! How each run stands to the first of the order: in a word, by how much, and at which truncation that is decided.

use dmp::{Best, Report, ScaleReport, Verdict};
use dmp_draw::text::NONE;
use dmp_draw::{OrderedPair, metres, metres_between};

use crate::console::Tone;

/// How a run stands to the first one.
#[derive(Debug)]
pub(super) struct Standing {
    /// As `2.79 cm worse at 2 m`.
    pub(super) text: String,
    /// From where to where the difference may be.
    pub(super) interval: String,
    /// What colour says of it.
    pub(super) tone: Option<Tone>,
}

/// How the run `name` stands to the run `first`.
pub(super) fn standing(report: &Report, first: &str, name: &str) -> Standing {
    let alone = |text: &str, tone| Standing { text: text.to_owned(), interval: NONE.to_owned(), tone };
    if name == first {
        return match report.best() {
            Some(Best::Run(_)) => alone("best", Some(Tone::Good)),
            _ => alone(of_first(report), None),
        };
    }
    let Some(shown) = OrderedPair::of(report, first, name) else {
        return alone("not compared", Some(Tone::Open));
    };
    // Around a cycle the first may be worse.
    let word = if shown.first == first { "worse" } else { "better" };
    match &shown.pair.verdict {
        Verdict::Better { .. } => {
            let tone = if word == "worse" { Tone::Bad } else { Tone::Good };
            decided(&shown, "", word, tone)
        }
        Verdict::Mixed { .. } => decided(&shown, "mixed, ", word, Tone::Open),
        Verdict::Same => alone("the same", None),
        Verdict::Undecided => alone("undecided", Some(Tone::Open)),
    }
}

/// How the first run stands to the others of its rank.
fn of_first(report: &Report) -> &'static str {
    let leaders = report.leaders();
    let Some((first, others)) = leaders.split_first().filter(|(_, others)| !others.is_empty()) else {
        return "first";
    };
    let are =
        |verdict: &Verdict| others.iter().all(|other| report.verdict_between(first, other) == Some(verdict));
    match () {
        () if are(&Verdict::Same) => "the same",
        () if are(&Verdict::Undecided) => "undecided",
        () => "first",
    }
}

fn decided(shown: &OrderedPair<'_>, mixed: &str, word: &str, tone: Tone) -> Standing {
    let behind_m = |scale: &ScaleReport| shown.rms_behind_m(scale);
    let (text, interval_m) = match shown.pair.decided_at().map(|scale| (scale, behind_m(scale))) {
        Some((ScaleReport { scale_m, .. }, Some((by_m, interval_m)))) => {
            (format!("{mixed}{} {word} at {scale_m} m", metres(by_m)), interval_m)
        }
        _ => (format!("{mixed}{word}"), None),
    };
    let interval = interval_m.map_or(NONE.to_owned(), metres_between);
    Standing { text, interval, tone: Some(tone) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example_reports;

    fn of(report: &Report, name: &str) -> String {
        standing(report, &report.order[0], name).text
    }

    #[test]
    fn a_standing_is_a_word_and_a_length() {
        let mut report = example_reports::three_runs();
        assert_eq!(of(&report, "truth"), "undecided");
        assert_eq!(of(&report, "größe"), "undecided");
        // Mean squares of 1 and 1.254 m²: roots of 1 and 1.12 m.
        assert_eq!(of(&report, "drift"), "12.0 cm worse at 10 m");
        assert_eq!(standing(&report, "truth", "drift").interval, "9.59 to 14.3 cm");
        assert_eq!(standing(&report, "größe", "drift").text, "mixed, 10.8 cm worse at 10 m");
        report.pairs.iter_mut().for_each(|pair| pair.verdict = Verdict::Same);
        assert_eq!(of(&report, "drift"), "the same");
        report.pairs.clear();
        assert_eq!(of(&report, "drift"), "not compared");
        let many = example_reports::many_runs(3);
        assert_eq!(of(&many, "run 0"), "best");
    }

    #[test]
    fn who_stands_first_around_a_cycle_may_be_worse() {
        let mut report = example_reports::many_runs(3);
        report.order.reverse();
        assert_eq!(of(&report, "run 0"), "better by 12.0 cm at 10 m");
        assert_eq!(of(&report, "run 2"), "first");
    }
}
