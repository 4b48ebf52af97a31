//! How each run stands to the first of the order: in a word, by how much, and at which truncation that is decided.

use dmp_report::{Best, Report, ScaleReport, Verdict};

use super::{OrderedPair, metres, metres_between};
use crate::text::NONE;

/// How a run stands to the first one.
#[derive(Debug)]
pub struct Standing {
    /// As `2.79 cm worse at 2 m`.
    pub text: String,
    /// From where to where the difference may be.
    pub interval: String,
    /// How to colour it.
    pub mood: Option<Mood>,
}

/// What a standing means for a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mood {
    /// It is better.
    Good,
    /// It is worse.
    Bad,
    /// That is not decided, or not everywhere.
    Open,
}

/// How the run `name` stands to the run `first`.
pub fn standing(report: &Report, first: &str, name: &str) -> Standing {
    let alone = |text: &str, mood| Standing { text: text.to_owned(), interval: NONE.to_owned(), mood };
    if name == first {
        return match report.best() {
            Some(Best::Run(_)) => alone("best", Some(Mood::Good)),
            _ => alone(of_first(report), None),
        };
    }
    let Some(shown) = OrderedPair::of(report, first, name) else {
        return alone("not compared", Some(Mood::Open));
    };
    // Around a cycle the first may be worse.
    let word = if shown.first == first { "worse" } else { "better" };
    match &shown.pair.verdict {
        Verdict::Better { decided_at_m, .. } => {
            let mood = if word == "worse" { Mood::Bad } else { Mood::Good };
            match decided_at_m {
                Some(_) => decided(&shown, "", word, mood),
                None => alone(&by_drift(report, &shown, word), Some(mood)),
            }
        }
        Verdict::Mixed { .. } => decided(&shown, "mixed, ", word, Mood::Open),
        Verdict::Same => alone("the same", None),
        Verdict::Undecided => alone("undecided", Some(Mood::Open)),
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

/// How much more the run drifts, RMS where both come back.
fn by_drift(report: &Report, shown: &OrderedPair<'_>, word: &str) -> String {
    let mut compared = report.drift.iter().flat_map(|drift| &drift.comparisons);
    let more = if word == "worse" { "more" } else { "less" };
    match compared
        .find(|drift| shown.pair.is_of(&drift.a, &drift.b))
        .map(|drift| (drift.rms_a_m, drift.rms_b_m))
    {
        Some((Some(a_m), Some(b_m))) => format!("{} {more} drift", metres((a_m - b_m).abs())),
        _ => format!("{more} drift"),
    }
}

fn decided(shown: &OrderedPair<'_>, mixed: &str, word: &str, mood: Mood) -> Standing {
    let behind_m = |scale: &ScaleReport| shown.rms_behind_m(scale);
    let (text, interval_m) = match shown.pair.decided_at().map(|scale| (scale, behind_m(scale))) {
        Some((ScaleReport { scale_m, .. }, Some((by_m, interval_m)))) => {
            (format!("{mixed}{} {word} at {scale_m} m", metres(by_m)), interval_m)
        }
        _ => (format!("{mixed}{word}"), None),
    };
    let interval = interval_m.map_or(NONE.to_owned(), metres_between);
    Standing { text, interval, mood: Some(mood) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_data::sample;

    #[test]
    fn what_drift_decides_is_said_by_how_much_it_drifts() {
        let mut report = sample();
        let pair = report.pairs.iter_mut().find(|pair| pair.is_of("truth", "drift")).unwrap();
        pair.verdict = Verdict::Better { run: "truth".into(), decided_at_m: None };
        let by_drift = standing(&report, "truth", "drift");
        assert_eq!((by_drift.text.as_str(), by_drift.mood), ("1.20 m more drift", Some(Mood::Bad)));
        assert_eq!(standing(&report, "drift", "truth").text, "1.20 m less drift");
        report.drift = None;
        assert_eq!(standing(&report, "truth", "drift").text, "more drift");
    }
}
