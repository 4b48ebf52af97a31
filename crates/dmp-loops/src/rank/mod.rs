//! What each loop candidate makes of a graph, and of its map.

mod accept;
mod ranker;
mod scorer;
#[cfg(test)]
mod tests;

pub(crate) use accept::Compared;
pub use accept::{Acceptance, Decision, Verdict};
pub use ranker::{Failed, Ranker, Ranking, Tried, TryFault, Without, in_threads, optimised};
pub use scorer::Scorer;
