//! What a reader must know before believing a report: each a sentence in the JSON.

use dmp_lengths::thousands;
use dmp_log::StampJump;
use serde::{Deserialize, Serialize};

use super::withheld::Withheld;
use crate::cast::{CopiedScans, OddScans};
use crate::error::in_voxels;

/// What a reader must know before believing a report, or a run in it. Shares are of 1.
///
/// In the JSON it is a sentence, and two that say the same are equal. What is read back is [`Self::Other`].
#[derive(Debug, Clone, thiserror::Error, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
#[non_exhaustive]
pub enum Warning {
    /// So many ranges are of no LiDAR: the numbers of the points are hardly coordinates in metres.
    #[error(
        "{:.0} % of the ranges are below 1 mm or above 100 km, which no LiDAR measures: are the points' bytes in the order \
         that the log says (is_bigendian), and their fields where it says?",
        100.0 * .share
    )]
    ImplausibleRanges {
        /// Share of all returns.
        share: f64,
    },
    /// Scans of a log without checksums are unlike the others.
    #[error(
        "{} {} unlike the others, and the log has no checksums: {}; did bytes change?",
        thousands(.count),
        if *.count == 1 { "scan is" } else { "scans are" },
        in_words(.first, *.more)
    )]
    OddScans {
        /// How many.
        count: usize,
        /// The first of them.
        first: Vec<OddScans>,
        /// How many scans or rows of them come after those.
        more: usize,
    },
    /// Scans hold the same returns as others.
    #[error(
        "{}: what two scans measure is never the same to the last bit; did the driver stop, or a file take another's place?",
        in_words(.first, *.more)
    )]
    CopiedScans {
        /// The first of them.
        first: Vec<CopiedScans>,
        /// How many scans or rows of them come after those.
        more: usize,
    },
    /// The fused map of a run has nothing for a ray to meet.
    #[error(
        "its map has nothing for a ray to meet: in {} returns span no surface: are the voxels large enough (--voxel), and is the \
         trajectory that of this log and this frame (--extrinsic, --time-offset)?",
        in_voxels(*.thin_voxels)
    )]
    EmptyMap {
        /// The voxels.
        thin_voxels: u64,
    },
    /// So many rays of a run hit nothing.
    #[error(
        "{:.0} % of the returns hit nothing: is the trajectory that of this log and this frame (--extrinsic, --time-offset)?",
        100.0 * .share
    )]
    Misses {
        /// Share of the run's returns.
        share: f64,
    },
    /// So many rays of a run hit something too early.
    #[error(
        "{:.0} % of the returns have something in front of them: a map this inconsistent is ruined, or the trajectory is not \
         that of this log and frame (--extrinsic, --time-offset, order of the quaternion)",
        100.0 * .share
    )]
    Blocked {
        /// Share of the run's returns.
        share: f64,
    },
    /// A run has no `R_cv`, as too few returns have an independent crossing.
    #[error("R_cv is not given: {why}; pairs are still compared on common returns")]
    LowCoverage {
        /// Why.
        why: Withheld,
    },
    /// So few returns of a run see a place again.
    #[error(
        "only {:.1} % of the returns see a place again on another visit: drift and bends of the whole cannot be judged",
        100.0 * .share
    )]
    FewRevisits {
        /// Share of the run's returns.
        share: f64,
    },
    /// Parts of a given map cannot be used.
    #[error("{} points or triangles of the given map are not finite and were left out", thousands(.count))]
    MapPointsDropped {
        /// How many.
        count: u64,
    },
    /// Something of the log is lost.
    #[error("lost from the log: {what}")]
    Lost {
        /// Where and what.
        what: String,
    },
    /// Scans have no pose in a run.
    #[error(
        "{} of {} scans have no pose in `{run}`; all runs are compared on the {} scans that have one in every run",
        thousands(.without),
        thousands(.scans),
        thousands(.used)
    )]
    ScansWithoutPose {
        /// Name of the run.
        run: String,
        /// Scans without a pose in it.
        without: usize,
        /// Scans that can be read.
        scans: usize,
        /// Scans used.
        used: usize,
    },
    /// A run's poses are too far apart in time to say where scans between them were made.
    #[error(
        "`{run}` has poses up to {gap_s:.1} s apart; between them the sensor may be {:.0} cm off by the run's own poses, so {} \
         scans there are left out for all runs: poses for every scan, or its odometry between them, would tell more",
        100.0 * .off_m,
        thousands(.scans)
    )]
    SparsePoses {
        /// Name of the run.
        run: String,
        /// The longest time between two poses, seconds.
        gap_s: f64,
        /// How far the sensor may be off there, metres.
        off_m: f64,
        /// Scans left out for it.
        scans: usize,
    },
    /// The log is not in the order of time.
    #[error("the log's stamps go backwards {} times; scans were put in order of time", thousands(.times))]
    OutOfOrder {
        /// How often stamps go backwards.
        times: usize,
    },
    /// The segment length asked for cuts the drive into too few.
    #[error(
        "the segment length asked for cuts {} scans and {travel_m:.1} m of travel into fewer than 8: every scan is a \
         segment of its own",
        thousands(.scans)
    )]
    SegmentsTooLong {
        /// Scans used.
        scans: usize,
        /// The way, metres.
        travel_m: f64,
    },
    /// Scans share their stamps.
    #[error("{} scans have the stamp of another scan: a log that holds scans twice counts them twice", thousands(.scans))]
    SameStamp {
        /// How many.
        scans: usize,
    },
    /// Single scans are stamped at another time than those around them.
    #[error("{}: did the clock jump, or a stamp change?", in_words(.first, *.more))]
    StampsOff {
        /// The first of them.
        first: Vec<StampJump>,
        /// How many come after those.
        more: usize,
    },
    /// For some time, far longer than elsewhere in the log, there is no scan.
    #[error("{}: a pause, or are scans lost or stamps changed?", in_words(.first, *.more))]
    StampGaps {
        /// The first of them.
        first: Vec<StampJump>,
        /// How many come after those.
        more: usize,
    },
    /// The times of points are of no use to a run.
    #[error(
        "the poses of `{run}` have no stamps, so the times of points are not used: each scan has one pose"
    )]
    PosesWithoutStamps {
        /// Name of the run.
        run: String,
    },
    /// Much was taken for the vehicle.
    #[error(
        "{:.0} % of the returns were taken for the vehicle: if that is too many, give --ego a box, or none",
        100.0 * .share
    )]
    Vehicle {
        /// Share of the returns read to be scored.
        share: f64,
    },
    /// Much was dropped.
    #[error("{:.0} % of the returns were dropped: {reason}", 100.0 * .share)]
    Dropped {
        /// Why, as [`DropReport`](crate::DropReport) has it.
        reason: String,
        /// Share of the returns read to be scored.
        share: f64,
    },
    /// A sample is too small for intervals.
    #[error("a sample of {} scans has no intervals: {needed} are needed", thousands(.scored))]
    SmallSample {
        /// Scans scored.
        scored: u64,
        /// Scans from which on there are intervals.
        needed: u64,
    },
    /// There are few scans.
    #[error("few scans ({scans}): intervals are wide, if there are any")]
    FewScans {
        /// How many.
        scans: u64,
    },
    /// Nothing is known of what a given map is made of.
    #[error("a map was given: returns may be compared with surfels made of themselves")]
    MapGiven,
    /// Only some of the maps were given.
    #[error(
        "maps that were given stand beside maps that were fused: the one with more scans in it looks better"
    )]
    MapsOfBothKinds,
    /// No place is seen twice.
    #[error(
        "the way comes back to no place: the scores tell how well scans within {within_m:.0} m of each other fit together, \
         and nothing of drift and bends of the whole"
    )]
    NoPlaceRevisited {
        /// What one place spans, metres.
        within_m: f64,
    },
    /// Places are seen twice, but none of those drawn.
    #[error(
        "the way comes back to {} of {} places, and none of these was drawn: nothing is told of drift and bends of the \
         whole; a larger --quick or another --seed may draw some",
        thousands(.revisited),
        thousands(.places)
    )]
    NoRevisitedPlaceDrawn {
        /// Places that the way comes back to.
        revisited: u64,
        /// Places along the way.
        places: u64,
    },
    /// Not all scans of some places were read.
    #[error(
        "at {} of the places lie more scans than are read for one: a run that lost its way, or many passes",
        thousands(.places)
    )]
    PlacesCut {
        /// How many places.
        places: u64,
    },
    /// The fewest places that are ever drawn take more of the log than was asked for.
    #[error(
        "{:.1} % of the log's bytes were read, more than asked for: {} places are the fewest, and the log is short or \
         has no index",
        100.0 * .share,
        thousands(.places)
    )]
    FewestPlacesRead {
        /// Share of the log's bytes.
        share: f64,
        /// Places drawn.
        places: u64,
    },
    /// Places take more of the log than was asked for.
    #[error(
        "{:.1} % of the log's bytes were read, more than asked for: the places drawn are larger than most, or the log has no \
         index",
        100.0 * .share
    )]
    LargePlacesRead {
        /// Share of the log's bytes.
        share: f64,
    },
    /// A run is decided to be better although its `R_cv` over all returns is larger.
    #[error(
        "`{better}` is better than `{worse}` on the returns that both predict, though its R_cv at {scale_m} m over all \
         returns is larger: believe the pair"
    )]
    PairAgainstColumn {
        /// The better run.
        better: String,
        /// The other.
        worse: String,
        /// The truncation of that column, metres.
        scale_m: f64,
    },
    /// One run alone says what a trail is.
    #[error(
        "only `{run}` says what a trail is, and nobody vouches for what its rays contradict: --free-space also hides its \
         own doubled walls"
    )]
    OneVote {
        /// Its name.
        run: String,
    },
    /// Much was kept out of the maps.
    #[error(
        "{:.0} % of the returns were kept out of the maps: that is more than traffic; are all runs wrong?",
        100.0 * .share
    )]
    ManyTrails {
        /// Share of the returns fused.
        share: f64,
    },
    /// What one of several reports warns of that stand beside each other.
    #[error("{report}: {warning}")]
    OfReport {
        /// What the report is called.
        report: String,
        /// What it warns of.
        warning: Box<Warning>,
    },
    /// Any other sentence: what other parts of an evaluation say, and what is read back.
    #[error("{0}")]
    Other(String),
}

impl PartialEq for Warning {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

impl From<Warning> for String {
    fn from(warning: Warning) -> Self {
        warning.to_string()
    }
}

impl From<String> for Warning {
    fn from(sentence: String) -> Self {
        Self::Other(sentence)
    }
}

/// The first, and how many more there are.
fn in_words(first: &[impl ToString], more: usize) -> String {
    let mut words: Vec<String> = first.iter().map(ToString::to_string).collect();
    if more > 0 {
        words.push(format!("and {} more", thousands(more)));
    }
    words.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_its_sentence_and_comes_back_equal() {
        let vehicle = Warning::Vehicle { share: 0.123 };
        let of_report = Warning::OfReport { report: "monday".into(), warning: Box::new(vehicle.clone()) };
        let sentence =
            "12 % of the returns were taken for the vehicle: if that is too many, give --ego a box, or none";
        for (warning, sentence) in [
            (vehicle, sentence.to_owned()),
            (of_report, format!("monday: {sentence}")),
            (
                Warning::MapGiven,
                "a map was given: returns may be compared with surfels made of themselves".into(),
            ),
            (Warning::Other("so".into()), "so".into()),
        ] {
            let json = serde_json::to_string(&warning).unwrap();
            assert_eq!(json, serde_json::to_string(&sentence).unwrap());
            assert_eq!(serde_json::from_str::<Warning>(&json).unwrap(), warning);
        }
    }

    #[test]
    fn why_a_score_is_withheld_comes_back() {
        for (why, sentence) in [
            (dmp_reduce::Withheld::NoReturns, "no returns"),
            (
                dmp_reduce::Withheld::MapGiven,
                "the map was given, so no crossing is known to be independent of the return",
            ),
            (dmp_reduce::Withheld::LowCoverage { coverage: 0.4312 }, "coverage is 0.431, below 0.5"),
        ] {
            let json = serde_json::to_string(&Withheld::Known(why)).unwrap();
            assert_eq!(json, format!("\"{sentence}\""));
            let back: Withheld = serde_json::from_str(&json).unwrap();
            assert!(matches!(back, Withheld::Known(_)) && back == Withheld::Known(why), "{back:?}");
        }
        for sentence in ["coverage is low", "coverage is 0.4312, below 0.5", "the moon"] {
            let back: Withheld = serde_json::from_str(&format!("\"{sentence}\"")).unwrap();
            assert!(matches!(&back, Withheld::Other(other) if other == sentence), "{back:?}");
        }
    }
}
