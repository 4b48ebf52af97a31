//! Score LiDAR SLAM runs without ground truth: the Dense Map Posterior, out of core.
//!
//! # Brief overview
//! [`evaluate`] takes a log of scans and the [`Run`]s to compare; a run is a trajectory and optionally a map.
//! It returns a [`Report`]: every run's scores, every pair's verdict and the ranking. First it plans: which
//! scans, returns, voxels and segments count, the same for all runs. Then it fuses each run's map, casts
//! every return into every map, and reduces the residuals. It reads the log twice, or four times with
//! [`Config::free_space`], on any number of threads and in bounded memory. Reading order, threads and memory
//! change no number.
//!
//! The pieces:
//! - [`Config`] holds every setting; its default fits a drive. [`Config::on`] resolves it for a log into
//!   [`Settings`], which change numbers, and [`Means`] (memory, threads, folders), which do not.
//! - [`evaluate`] scores all returns. [`evaluate_quick`] scores a sample of places and reads little of the
//!   log. [`fuse_maps`] only makes the maps; [`map_of_cloud`] makes the map of a cloud or a mesh.
//! - [`Progress`] receives the progress and may stop the evaluation. A [`Sink`] receives returns, scans,
//!   places and maps as they are scored. A [`Watch`] is one of them, both, or `()`.
//! - A [`Report`] answers queries by name: [`Report::best`], [`Report::ranked`], [`Report::verdict_between`],
//!   [`Report::score_of`]. It is the JSON of `dmp score --json`, read and written with serde.
//!   [`join_reports`] joins two reports into one table; [`suite_report`] summarises those of several logs.
//! - [`prelude`] has what most programs need, and a complete example; `crates/dmp/examples` has longer ones.
//!
//! The metric is that of Zhang & Chen, "A metric for evaluating 3D reconstruction and mapping
//! performance with no ground truthing" (ICIP 2021), with what LiDAR needs beyond it; `docs/metric.md`
//! has every definition.
//!
//! ```no_run
//! use dmp::prelude::*;
//!
//! let log = open_log("town.mcap".as_ref(), &LogOptions::default())?;
//! let mut runs = Vec::new();
//! for file in ["truth.tum", "drift.tum"] {
//!     runs.push(Run::new(file, read_trajectory(file.as_ref())?.trajectory));
//! }
//! let report = evaluate(log.as_ref(), &runs, &Config::default(), ())?;
//! match report.best() {
//!     Some(Best::Run(run)) => println!("best: {}", run.name),
//!     _ => println!("no run is clearly the best"),
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cast;
mod check;
mod clock;
mod config;
mod disk;
mod drift;
mod ego;
mod error;
mod evaluate;
mod evaluation;
mod extent;
mod file_stem;
mod frames;
mod fuse;
mod given;
mod heads;
mod in_reach;
mod join;
mod known_poses;
mod maps;
mod memory;
mod note;
mod own_frame;
mod pairing;
mod peak;
mod places;
mod plan;
mod pose_at;
mod posed;
mod poser;
pub mod prelude;
mod progress;
mod report;
mod run_map;
mod run_poses;
mod run_state;
mod sample;
mod sanity;
mod schedule;
mod segment_length;
mod setting_name;
mod settings;
mod seven;
mod shard;
mod sink;
mod sounding;
mod sparse;
mod suite;
mod trails;
mod unposed;
mod vet;
mod watch;
mod work;

pub use cast::{CopiedScans, OddScans, Oddity};
pub use config::{Config, Frame, FrameOrder, MapSource, Run, RunSource};
pub use drift::{
    Displacement, DriftBin, DriftComparison, DriftPairs, DriftReach, DriftReport, Measured, RunDrift,
    VisitPairReport, VisitReport, measure_drift,
};
pub use ego::Ego;
pub use error::{EvaluateError, Remedy};
pub use evaluate::evaluate;
pub use file_stem::file_stem_of;
pub use join::{JoinError, JoinedReport, MadeWith, NamedReport, SavedResult, join_reports, join_results};
pub use maps::{CloudMap, RunMaps, fuse_maps, map_of_cloud};
pub use note::Note;
pub use pairing::Pairing;
pub use peak::{machine_memory_bytes, peak_anonymous_bytes};
#[doc(hidden)]
pub use places::{drawn_places, evaluate_quick, quick_reads};
pub use pose_at::PoseAt;
pub use posed::{PosedLog, PosedScan};
pub use progress::{Progress, Stage};
pub use report::{
    Best, COLUMNS, Column, ColumnUnit, ConfigReport, ConventionsReport, DepthNoiseReport, DropReport,
    EgoReport, EstimateReport, InputReport, LeftOutReport, MapReport, MemoryReport, PairReport, PassTimes,
    PlacesReport, PromiseReport, Report, RunInputReport, RunReport, SamplingReport, ScaleReport, ScaleScores,
    SegmentReport, TileReport, Verdict, Withheld, columns_by_rank,
};
pub use sample::{Decide, Looks, Sample};
pub use segment_length::SegmentLength;
pub use setting_name::SettingName;
pub use settings::{Means, Settings};
pub use shard::{
    Machine, NeededFile, Needs, Part, PlannedRun, Shard, ShardError, ShardPlan, ShardStage, Suggested,
};
pub use sink::{ScoredPlace, ScoredReturns, ScoredRun, Sink};
pub use suite::{
    EffectReport, FailureReport, Failures, LogPairReport, MissingReport, Outcome, SuiteLog, SuiteLogReport,
    SuitePairReport, SuitePromiseReport, SuiteReport, suite_report,
};
pub use unposed::Unposed;
pub use vet::{
    Doubt, DoubtTest, Found, Mend, PointTimes, PosesAs, Profile, VetSummary, Vetted, profiles, vet,
    vet_outline,
};
pub use watch::Watch;
pub use work::in_threads;

pub use dmp_calibrate::{Axis, Calibration, Estimate, Silence};
pub use dmp_log::{LengthUnit, is_printable, printable};
pub use dmp_reduce::{
    Basis, Confidence, DepthResidual, FrameSums, HitKind, KeptReturn, Lengths, Margin, MissPrice, Promise,
    Reach, Residuals, RunSums, Scales, SurfaceGroup,
};
