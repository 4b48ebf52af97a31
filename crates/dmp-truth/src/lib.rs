//! Comparison with ground truth: trajectory errors, surface distance, rank correlation, average precision.
//!
//! # Brief overview
//! [`trajectory`] has the absolute and relative pose errors (APE, RPE) with the association and alignment
//! of `evo` 1.38.1. [`surface`] measures how far a map lies from a reference surface. [`rank`] has the correlation
//! of two orders of the same runs, [`detection`] the precision and recall of a ranked list.

pub mod detection;
pub mod rank;
pub mod surface;
pub mod trajectory;
