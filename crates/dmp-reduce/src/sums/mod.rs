//! Sums over returns: of a run, of a pair of runs, of a frame; means of them with their errors.

mod frame;
mod frame_set;
mod narrow;
mod narrow_pairs;
mod pair;
mod ratio;
mod run;

pub use frame::{FrameSums, PairSums};
pub use frame_set::FrameSet;
pub use narrow::NarrowSums;
pub(crate) use narrow_pairs::pairs_of;
pub(crate) use pair::{PairTotals, ScaleTotals, place_count};
pub use ratio::{Estimate, Interval};
pub(crate) use ratio::{FRAMES_NEEDED, Frames, GROUPS_NEEDED, Mean, Ratio};
pub use run::{REVISIT_NEEDED, RunSums, Withheld};
