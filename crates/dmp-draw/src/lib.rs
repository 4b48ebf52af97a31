//! What an evaluation found, drawn: plots, maps from above, close-ups of the worst places, and one HTML page of it all.
//!
//! # Brief overview
//! [`page`] makes a page of a [`Report`](dmp_report::Report): one file that needs no network, and no scripts to be read. What the report
//! does not hold, where and when a run's map is wrong, comes as [`Pictures`]. They are made of what is seen while an
//! evaluation runs: the sums of every frame ([`SeenFrame`]) tell the [worst places](WorstPlace) of each run, a [`Painter`]
//! takes a sample of the returns in the order of the log and the surfels around the worst places.
//!
//! [`suite_page`] does the same for a [`SuiteReport`](dmp_suite::SuiteReport).
//!
//! [`map_check_page`] shows one map alone. [`truth_page`] and [`truth_picture`] show runs beside ground truth ([`TruthPlots`]).
//!
//! [`plot`] draws points and lines as SVG, [`text`] writes numbers for people. Nothing here opens a file or starts a
//! thread; the same input gives the same bytes.

mod colour;
mod image;
mod page;
mod pictures;
pub mod plot;
#[cfg(test)]
mod sample_data;
pub mod text;
mod truth;
mod words;

pub use colour::{colour_of_residual, colour_of_size};
pub use page::{PageInput, map_check_page, page, suite_page, truth_page};
pub use pictures::{
    DiscInWorld, FrameScore, Painter, Pass, Pictures, SampledReturn, SeenFrame, WorstPlace, worst_places,
};
pub use truth::{TruthPlots, TruthPose, TruthRun, TruthStats, truth_picture};
pub use words::{
    BesideColumn, DRIFT_HEADS, Mood, OrderedPair, OrderedVersions, Ranking, RankingRow, ScoreColumn,
    Standing, answer, beside, drift_beside_scores, drift_compared, drift_in_words, drift_row, every_pair,
    laid_onto, legend, log_word, main_pairs, map_check, metres, not_in_a_cloud, ordered_versions, p_value,
    pairs_in_words, places, promise, ranking, standing, suite_answer, suite_promise, warnings, worse_between,
    worse_by,
};
