//! The streaming residual reducer: exact, mergeable, order-free sums; intervals and verdicts.
//!
//! # Brief overview
//! What a run's map predicts for one return arrives as [`Residuals`]. [`RunSums`] adds up the residuals
//! of one run and derives its scores, the paper's among them (Zhang & Chen 2021, eq. 13). [`FrameSums`]
//! does so for all runs of a frame at once, and compares every pair on the returns *both* predict.
//! A [`Reducer`] takes the frames in any order, in memory that does not grow with their number, and
//! answers with [`RunScores`], a [`Comparison`] for each pair with its [`Verdict`], and the order of
//! the runs.
//!
//! - Squared residuals are integers in units of 2^-40 m² ([`FixedSum`]); every sum is a sum of integers.
//!   So the same frames give the same bits whatever the order, the threads and the shards.
//! - An [`Interval`] comes from two kinds of units: stretches of the log, as neighbouring frames are alike, and pieces of
//!   surface ([`SurfaceGroup`]), as all frames that see one share its errors.
//! - The verdicts on all pairs at all scales share one error ([`Confidence`]): where runs are equal, the chance that any
//!   two are declared different is 1 % if nothing else is asked for.
//! - What several logs say together is a count of signs: [`sign_test`], [`Median`] of differences, [`Holm`] for several pairs.
//! - The values depend on the place and on the settings. They compare runs of one log under one setting,
//!   nothing else, and [`log_likelihood_raw`] is never a probability.
//!
//! Nothing here knows of maps, rays, files or threads. Lengths are metres, squares m².
//!
//! ```
//! use dmp_reduce::{Basis, Confidence, FrameSums, Layout, Reducer, Residuals, SurfaceGroup, Verdict};
//!
//! let layout = Layout::new(8, vec![Basis::CrossValidated; 2]);
//! let mut reducer = Reducer::new(layout.clone());
//! let mut frame = FrameSums::new(layout.bases());
//! for ordinal in 0..8 {
//!     frame.clear();
//!     for k in 0..100 {
//!         let off_m = 0.01 + 0.001 * f64::from(k % 7);
//!         let surface = SurfaceGroup::of_cube([k % 10, 0, 0]);
//!         let of_runs = [off_m, off_m + 0.05].map(|m| Residuals { surfaces: [surface; 2], ..Residuals::all(m) });
//!         frame.add_return(&of_runs);
//!     }
//!     reducer.add_frame(ordinal, &frame)?;
//! }
//! let pairs = reducer.comparisons(Confidence::P99).pairs;
//! assert!(matches!(pairs[0].verdict, Verdict::Better { which: 0, .. }));
//! # Ok::<(), dmp_reduce::ReduceError>(())
//! ```

mod error;
mod numbers;
mod reducer;
mod residual;
mod sums;
mod verdicts;

pub use error::ReduceError;
pub use numbers::{Confidence, FixedSum, Holm, Median, log_likelihood_raw, mixed, sign_test, signs_needed};
pub use reducer::{Layout, Reducer, Seen};
pub use residual::{
    Basis, DepthResidual, HitKind, KeptReturn, Lengths, MissPrice, Reach, Residuals, Scales, Squares,
    SurfaceGroup, floor,
};
pub use sums::{
    Estimate, FrameSet, FrameSums, Interval, NarrowSums, PairSums, REVISIT_NEEDED, RunSums, Withheld,
};
pub use verdicts::{
    Comparison, Comparisons, GuardCheck, Ranked, RunScores, ScaleComparison, Stretch, UndecidedReason,
    Verdict, order_runs,
};
