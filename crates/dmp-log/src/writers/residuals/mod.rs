//! Scored returns, written for people to look at.

mod play;
mod point;
mod writer;

pub use point::{ScoredPoint, ScoredScan};
pub use writer::{ResidualFormat, ResidualHead, ResidualWriter};
