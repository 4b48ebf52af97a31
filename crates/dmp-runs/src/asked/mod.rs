//! What is asked: the runs, every setting, who watches, and what is wrong with any of it.

mod check;
mod config;
mod drift;
mod error;
mod note;
mod progress;
mod returns;
mod setting_name;
mod settings;
mod sink;
mod threads;
mod unposed;
mod watch;

pub use check::POSE_BYTES;
pub use config::{Config, Frame, FrameOrder, MapSource, Run, RunSource};
pub use drift::{DriftPairs, DriftReach};
pub use error::{EvaluateError, Remedy};
pub use error::{as_asked_m, in_voxels, in_words};
pub use note::Note;
pub use progress::{Progress, Stage, so_far};
pub use returns::{CastReturns, ReturnDraw};
pub use setting_name::SettingName;
pub use settings::{Means, Settings, check_runs};
pub use sink::{ScoredReturns, ScoredRun, Sink};
pub use threads::{in_threads, pool};
pub use unposed::Unposed;
pub use watch::Watch;
