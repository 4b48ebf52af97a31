//! Scoring a sample of places: what a report says of it.

use dmp::{PairReport, PlacesReport, Report, SamplingReport, ScaleReport};
use dmp_draw::text::{self, NONE, counted, digits};
use dmp_draw::{Ranking, RankingRow};

/// At which places, and what was read for them.
pub(super) fn places_in_words(sampling: &SamplingReport, places: &PlacesReport) -> String {
    let bytes = places
        .bytes_read
        .map_or(String::new(), |bytes| format!(", {} of the log in all", text::bytes(bytes)));
    let drawn = if places.drawn < places.total {
        format!("{} of {}, evenly spread", text::count(places.drawn), counted(places.total, "place"))
    } else {
        format!("all {}", counted(places.total, "place"))
    };
    format!(
        "scored: {} at {drawn}, {} of them passed more than once; each has a map of its own, of the scans within {:.0} m: \
         {} read for them{bytes}",
        counted(sampling.frames_scored, "scan"),
        text::count(places.revisited),
        places.radius_m,
        counted(places.scans_read, "scan")
    )
}

/// The larger distance of an end of the interval of a run's first column from its value, as that column is shown.
pub(super) fn half_width(ranking: &Ranking<'_>, row: &RankingRow<'_>) -> String {
    let root = |square_m2: f64| ranking.root_of(square_m2);
    row.value_m2.zip(row.interval_m2).map_or(NONE.to_owned(), |(value, [low, high])| {
        digits((root(high) - root(value)).max(root(value) - root(low)))
    })
}

/// What to do about a pair that a sample of places does not decide.
pub(super) fn more_needed(report: &Report, pair: &PairReport) -> String {
    // Without an interval, or without any difference, nobody knows what more of the log would show.
    let is_known = |scale: &ScaleReport| scale.interval_m2.is_some() && scale.difference_m2 != Some(0.0);
    if !pair.scales.iter().any(is_known) {
        return String::new();
    }
    let places = report.sampling.places;
    places
        .map_or(String::new(), |places| more_places_needed(&places, report.inputs.bytes, pair.places_needed))
}

/// How many places more would decide, as far as they are known to.
fn more_places_needed(places: &PlacesReport, log_bytes: u64, needed: Option<u64>) -> String {
    let Some(needed) = needed else { return "; all places would hardly decide either".to_owned() };
    // What was read may be more than was asked for.
    let read = places.bytes_read.map_or(0.0, |bytes| bytes as f64 / log_bytes.max(1) as f64);
    let share =
        100.0 * read.max(places.share_asked.unwrap_or(0.0)) * needed as f64 / places.drawn.max(1) as f64;
    if 10 * needed < 9 * places.total && share < 50.0 {
        format!(
            "; about {} more places would decide: --quick={}%",
            text::count(needed - places.drawn),
            share.ceil()
        )
    } else {
        "; if anything decides, it is the whole log, without --quick".to_owned()
    }
}
