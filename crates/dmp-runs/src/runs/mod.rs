//! Each run on the scans of a log: its poses on the log's clock, in its own frame, its path and segments, and the rays of its
//! returns. What is found of one run depends on no other.

mod apart;
mod clock;
mod file_stem;
mod frame;
mod heads;
mod known_poses;
mod no_overlap;
pub(crate) mod own_frame;
mod path;
mod posed_run;
mod poser;
mod run_poses;
mod segments;
mod select;
mod sparse;

pub use apart::{apart_of, back_of};
pub use clock::on_log_clock;
pub use file_stem::file_stem_of;
pub use frame::PlannedFrame;
pub use heads::Heads;
pub use known_poses::KNOWN_TIMES;
pub use path::RunPath;
pub use posed_run::{PosedRun, posed};
pub use poser::{BLOCK_RAYS, Block, Drawn, MIN_BLOCK_RETURNS, OfReturn, Poser, WorldPoint, drawn_by};
pub use run_poses::RunPoses;
pub use select::Selection;
