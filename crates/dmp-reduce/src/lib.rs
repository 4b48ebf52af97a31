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
//! - An [`Interval`] is at 99 %. Over all frames it comes from batches of consecutive frames or from
//!   single frames, whichever is wider, as neighbouring frames are alike; of sampled frames it is the
//!   error of the sampling. A pair is looked at at several scales, each at 99 %: that is several looks.
//! - The values depend on the place and on the settings. They compare runs of one log under one setting,
//!   nothing else, and [`log_likelihood_raw`] is never a probability.
//!
//! Nothing here knows of maps, rays, files or threads. Lengths are metres, squares m².
//!
//! ```
//! use dmp_reduce::{Basis, Confidence, FrameSums, Layout, Reducer, Residuals, Verdict};
//!
//! let layout = Layout::new(8, vec![Basis::CrossValidated; 2]);
//! let mut reducer = Reducer::new(layout.clone());
//! let mut frame = FrameSums::new(layout.bases());
//! for ordinal in 0..8 {
//!     frame.clear();
//!     for k in 0..100 {
//!         let off_m = 0.01 + 0.001 * f64::from(k % 7);
//!         frame.add_return(&[Residuals::all(off_m), Residuals::all(off_m + 0.05)]);
//!     }
//!     reducer.add_frame(ordinal, &frame)?;
//! }
//! let pair = reducer.compare(0, 1, Confidence::P99);
//! assert!(matches!(pair.verdict, Verdict::Better { which: 0, .. }));
//! assert_eq!(reducer.order(&[pair])[0].run, 0);
//! # Ok::<(), dmp_reduce::ReduceError>(())
//! ```

mod basis;
mod error;
mod fixed;
mod frame;
mod guard;
mod likelihood;
mod order;
mod pair;
mod price;
mod ratio;
mod reducer;
mod residuals;
mod run;
mod scales;
mod student;
mod verdict;
mod wide;

pub use basis::Basis;
pub use error::ReduceError;
pub use fixed::FixedSum;
pub use frame::{FrameSums, PairSums};
pub use guard::{GuardCheck, Place};
pub use likelihood::log_likelihood_raw;
pub use order::{Ranked, order_runs};
pub use price::MissPrice;
pub use ratio::{Estimate, Interval, IntervalFrom};
pub use reducer::{Layout, Reducer, RunScores, Seen};
pub use residuals::{DepthResidual, HitKind, Residuals};
pub use run::{RunSums, Withheld};
pub use scales::{Reach, Scales};
pub use student::Confidence;
pub use verdict::{Comparison, ScaleComparison, UndecidedReason, Verdict};
