//! The report of what the passes found, and what it warns of.

mod account;
mod findings;
mod warnings;

pub(crate) use findings::{Findings, MapSummary, drops_in_words, map_report, segment_report};
