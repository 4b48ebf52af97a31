//! Files of points without a header: how their rows are laid out, as said or as their values show.

mod layout;
mod sound;
#[cfg(test)]
mod tests;

pub use layout::{BinLayout, BinLayoutError};
pub(super) use sound::layout_of;
