//! Scoring a sample of the scans: the options, and how a report tells of it.

use clap::Args;
use dmp::{Config, Decide, PairReport, PlacesReport, Report, Sample, SamplingReport, ScaleReport};
use dmp_draw::text::{self, NONE, counted, digits};
use dmp_draw::{Ranking, RankingRow};

use crate::parse::{Pair, pair};

/// Which of the scans are scored. The maps are made of all scans in use.
#[derive(Debug, Args)]
pub(crate) struct SamplingArgs {
    /// Score only so many scans, as 28, or such a share of them, as 2%, evenly spread from a random start. The maps are
    /// made of all scans. The first score comes with its error too
    #[arg(long, value_name = "N|P%", value_parser = sample, help_heading = "Sampling")]
    sample: Option<Sample>,
    /// Score a sample, of 28 scans or as --sample says, and twice as many as long as not every pair of runs is
    /// decided, or not the two runs of --decide=RUN,RUN; at the end all
    #[arg(long, value_name = "RUN,RUN", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    #[arg(value_parser = pair, help_heading = "Sampling")]
    decide: Option<Pair>,
    /// Answers from a sample of places, of which no more of the log is read than this share of its bytes: the scans near
    /// each place on every pass. Every place has a small map of its own. Needs an index in the log (MCAP, rosbag2, a
    /// folder of scans) that tells when scans were made, or a pose for each scan. Of a short log, of which it would read
    /// more than half, all is scored
    #[arg(long, value_name = "P%", num_args = 0..=1, require_equals = true, default_missing_value = "5%")]
    #[arg(value_parser = share, help_heading = "Sampling")]
    #[arg(conflicts_with_all = ["sample", "decide", "maps", "free_space", "save_maps", "resume"])]
    #[arg(conflicts_with_all = ["residuals", "per_frame", "per_tile", "scene", "keep", "checkpoint"])]
    quick: Option<f64>,
    /// Draws another sample
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Sampling")]
    seed: u64,
}

impl SamplingArgs {
    /// The share of the log that may be read for a quick score, where that is asked for.
    pub(crate) fn quick(&self) -> Option<f64> {
        self.quick
    }

    /// The settings with the sampling that was asked for.
    pub(crate) fn of(&self, config: Config) -> Config {
        let decide = self.decide.clone().map(|pair| Decide { pair: pair.0 });
        Config { sample: self.sample.unwrap_or_default(), seed: self.seed, decide, ..config }
    }
}

/// `5%`, as a share.
fn share(text: &str) -> Result<f64, String> {
    let percent = text.strip_suffix('%').and_then(|percent| percent.trim_end().parse::<f64>().ok());
    let error = || format!("`{text}` is no share of a log: try 5%");
    percent.filter(|&percent| percent > 0.0 && percent <= 100.0).map(|p| p / 100.0).ok_or_else(error)
}

/// `28` or `2%`.
fn sample(text: &str) -> Result<Sample, String> {
    let error = || format!("`{text}` is no sample: try 28 (scans) or 2%");
    match text.strip_suffix('%') {
        Some(percent) => {
            let percent: f64 = percent.trim_end().parse().map_err(|_| error())?;
            (percent > 0.0 && percent <= 100.0).then_some(Sample::Share(percent / 100.0)).ok_or_else(error)
        }
        None => text.parse().ok().filter(|&frames| frames > 0).map(Sample::Frames).ok_or_else(error),
    }
}

/// What was scored, where that is not everything, in a line.
pub(super) fn in_words(sampling: &SamplingReport) -> Option<String> {
    let (scored, all) = (text::count(sampling.frames_scored), counted(sampling.frames_total, "scan"));
    if let Some(places) = &sampling.places {
        return Some(places_in_words(sampling, places));
    }
    let seed = sampling.seed?;
    let looks = sampling.looks.as_ref().map_or(String::new(), |looks| {
        let looks: Vec<String> = looks.iter().copied().map(text::count).collect();
        format!("; looked at {}", looks.join(", "))
    });
    Some(if sampling.frames_scored < sampling.frames_total {
        format!("scored: {scored} of {all}, evenly spread (--seed {seed}){looks}; the maps are made of all")
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
        format!(
            "{} of {}, evenly spread (--seed {})",
            text::count(places.drawn),
            counted(places.total, "place"),
            sampling.seed.unwrap_or_default()
        )
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

/// How far the ends of the interval of a run's first column are from it, the longer way, as that column is shown.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_numbers_or_shares() {
        assert_eq!(sample("28"), Ok(Sample::Frames(28)));
        assert_eq!(sample("100%"), Ok(Sample::Share(1.0)));
        assert_eq!(sample("0.5 %"), Ok(Sample::Share(0.005)));
        for text in ["0", "0%", "101%", "-3", "2.5", "nan%", "x", "", "%"] {
            assert!(sample(text).is_err_and(|e| e.ends_with("no sample: try 28 (scans) or 2%")), "{text}");
        }
    }

    #[test]
    fn a_share_is_in_percent() {
        assert_eq!(share("5%"), Ok(0.05));
        assert_eq!(share("0.5 %"), Ok(0.005));
        for text in ["5", "0%", "101%", "-1%", "nan%", "%", ""] {
            assert!(share(text).is_err_and(|e| e.ends_with("try 5%")), "{text}");
        }
    }
}
