//! What a score is made with: the settings, and each run on the scans of a log.
//!
//! - `asked`: [`Config`] and what it becomes on a log, who watches, and every error.
//! - `runs`: the poses of a [`Run`] on the log's clock and in its own frame, its path and segments, the rays of its returns.
//! - `vet`: whether a run belongs to the log, and its conventions ([`fn@vet`]).
//!
//! What is found of one run depends on no other. Programs use these types as those of the crate `dmp`.

mod asked;
pub mod own_frame {
    //! The frame in which a run is scored.
    pub use crate::runs::own_frame::{place, tilt};
}
mod runs;
mod vet;

pub use asked::{
    CastReturns, Config, DriftPairs, DriftReach, EvaluateError, Frame, FrameOrder, MapSource, Means, Note,
    POSE_BYTES, Progress, Remedy, ReturnDraw, Run, RunSource, ScoredReturns, ScoredRun, SettingName,
    Settings, Sink, Stage, Unposed, Watch, as_asked_m, check_runs, in_threads, in_voxels, in_words, pool,
    so_far,
};
pub use runs::{
    BLOCK_RAYS, Block, Drawn, Heads, KNOWN_TIMES, MIN_BLOCK_RETURNS, OfReturn, PlannedFrame, PosedRun, Poser,
    RunPath, RunPoses, Selection, WorldPoint, apart_of, back_of, drawn_by, file_stem_of, on_log_clock, posed,
};
pub use vet::{
    Doubt, DoubtTest, Found, Mend, PointTimes, PosesAs, Profile, VetSummary, Vetted, profiles, vet,
    vet_outline,
};
