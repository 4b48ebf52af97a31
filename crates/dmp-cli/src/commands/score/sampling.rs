//! Scoring a sample of the scans or places: what a report says of it.

use dmp::{PairReport, PlacesReport, Report, SamplingReport, ScaleReport};
use dmp_draw::text::{self, NONE, counted, digits};
use dmp_draw::{Ranking, RankingRow};

/// What was scored, where that is not everything, in a line.
pub(super) fn in_words(sampling: &SamplingReport) -> Option<String> {
    let (scored, all) = (text::count(sampling.frames_scored), counted(sampling.frames_total, "scan"));
    if let Some(places) = &sampling.places {
        return Some(places_in_words(sampling, places));
    }
    if sampling.frames_scored == sampling.frames_total && sampling.looks.is_none() {
        return None;
    }
    let looks = sampling.looks.as_ref().map_or(String::new(), |looks| {
        let looks: Vec<String> = looks.iter().copied().map(text::count).collect();
        format!("; looked at {}", looks.join(", "))
    });
    Some(if sampling.frames_scored < sampling.frames_total {
        format!("scored: {scored} of {all}, evenly spread{looks}; the maps are made of all")
    } else {
        format!("scored: all {all}{looks}")
    })
}

/// At which places, and what was read for them.
fn places_in_words(sampling: &SamplingReport, places: &PlacesReport) -> String {
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

/// What to do about a pair that a sample does not decide.
pub(super) fn more_needed(report: &Report, pair: &PairReport) -> String {
    // Without an interval, or without any difference, nobody knows what more of the log would show.
    let is_known = |scale: &ScaleReport| scale.interval_m2.is_some() && scale.difference_m2 != Some(0.0);
    if !pair.scales.iter().any(is_known) {
        return String::new();
    }
    if let Some(places) = &report.sampling.places {
        return more_places_needed(places, report.inputs.bytes, pair.places_needed);
    }
    let SamplingReport { frames_scored, frames_total, .. } = report.sampling;
    match pair.frames_needed {
        // A guess of nearly all is one of all.
        Some(needed) if 10 * needed < 9 * frames_total => {
            format!("; about {} more scans would decide: --decide", text::count(needed - frames_scored))
        }
        Some(_) => "; if anything decides, it is all scans, without --sample".to_owned(),
        None if frames_scored < frames_total => "; all scans would hardly decide either".to_owned(),
        None => String::new(),
    }
}

/// The same of places.
fn more_places_needed(places: &PlacesReport, log_bytes: u64, needed: Option<u64>) -> String {
    let Some(needed) = needed else { return "; all places would hardly decide either".to_owned() };
    // What was read may be more than was asked for.
    let read = places.bytes_read.map_or(0.0, |bytes| bytes as f64 / log_bytes.max(1) as f64);
    let share = 100.0 * read.max(places.share_asked) * needed as f64 / places.drawn.max(1) as f64;
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
