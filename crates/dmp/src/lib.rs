//! Score LiDAR SLAM runs without ground truth: the Dense Map Posterior, out of core.
//!
//! # Brief overview
//! [`evaluate`] takes a log of scans and the [`Run`]s to compare; a run is a trajectory and optionally a map.
//! It returns a [`Report`]: every run's scores, every pair's verdict and the ranking. First it plans: which
//! scans, returns, voxels and segments count, the same for all runs. Then it fuses each run's map, casts
//! a share of the returns into every map, and reduces the residuals. It reads every scan once, and a few before that to
//! plan, on any number of threads and in bounded memory. Reading order, threads and memory change no number.
//!
//! The pieces:
//! - [`Config`] holds every setting; its default fits a drive. [`Config::on`] resolves it for a log into
//!   [`Settings`], which change numbers, and [`Means`] (memory, threads, folders), which do not.
//! - [`evaluate`] scores all scans. [`evaluate_quick`] scores few scans and reads little of the
//!   log. [`PlannedScore`] runs the passes apart. [`fuse_maps`] only makes the maps; [`map_of_cloud`] makes the map of a cloud or a mesh;
//!   [`check_cloud`] says how good a cloud is alone.
//! - [`Progress`] receives the progress and may stop the evaluation. A [`Sink`] receives returns, scans,
//!   places and maps as they are scored. A [`Watch`] is one of them, both, or `()`.
//! - A [`Report`] answers queries by name: [`Report::best`], [`Report::ranked`], [`Report::verdict_between`],
//!   [`Report::score_of`]. It is the JSON of `dmp score --json`, read and written with serde.
//!   The crate `dmp-suite` joins reports of one log, and sums up those of several logs.
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

mod check;
mod drawn;
mod evaluate;
mod maps;
mod means;
mod passes;
mod planned;
mod posed;
pub mod prelude;
mod quick;
mod results;

pub use check::{check_cloud, check_store};
pub use evaluate::{check_memory, evaluate};
pub use maps::{CloudMap, RunMaps, fuse_maps, map_of_cloud};
pub use means::{machine_memory_bytes, peak_anonymous_bytes, peak_bytes};
pub use passes::{
    Casting, CopiedScans, OddScans, Oddity, Revisits, Surveyed, TilesInReach, VisitPair, measure_drift,
};
#[doc(hidden)]
pub use planned::{PlacedRun, PlannedScore};
pub use posed::{PosedLog, PosedScan};
pub use quick::{evaluate_quick, quick_steps};

pub use dmp_log::{LengthUnit, is_printable, printable};
pub use dmp_reduce::{
    Basis, Confidence, DepthResidual, FrameSums, HitKind, KeptReturn, Lengths, MissPrice, Reach, Residuals,
    RunSums, Scales, SurfaceGroup,
};
pub use dmp_report::{
    Best, COLUMNS, Column, ColumnUnit, ConfigReport, ConventionsReport, DepthNoiseReport, DropReport, Ego,
    EgoReport, EstimateReport, InputReport, LeftOutReport, MapReport, MemoryReport, PairReport, Pairing,
    PassTimes, PoseAt, PromiseReport, QuickReport, Report, RunInputReport, RunReport, SamplingReport,
    ScaleReport, ScaleScores, SegmentLength, SegmentReport, TileReport, Verdict, Withheld, columns_by_rank,
};
pub use dmp_revisit::apart::{Apart, Moments, Spread};
pub use dmp_revisit::calibrate::{Axis, Calibration, Estimate, Silence};
pub use dmp_revisit::drift::{
    Displacement, DriftBin, DriftComparison, DriftReport, Measured, RunDrift, VisitPairReport, VisitReport,
};
pub use dmp_runs::{
    CastReturns, Config, Doubt, DoubtTest, DriftPairs, DriftReach, EvaluateError, Found, Frame, FrameOrder,
    MapSource, Means, Mend, Note, PointTimes, PosesAs, Profile, Progress, Remedy, Run, RunSource,
    ScoredReturns, ScoredRun, SettingName, Settings, Sink, Stage, Unposed, VetSummary, Vetted, Watch,
    file_stem_of, in_threads, profiles, so_far, vet, vet_outline,
};
