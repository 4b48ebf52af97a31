//! The plan of a score in parts, as a document.

use std::path::{Path, PathBuf};

use dmp::{
    Config, EvaluateError, MapSource, PlannedScore, Run, SettingName, Settings, Surveyed, VetSummary, Watch,
};
use dmp_disk::ContentHash;
use dmp_log::{LogIndex, ScanLog};
use dmp_report::SegmentReport;
use dmp_sensor::ReturnFilter;
use serde::{Deserialize, Serialize};

use super::error::ShardError;
use super::suggest::{Machine, Suggested};

/// Everything of a score that is common to all parts: the log and the positions of its scans, the returns
/// used, the voxels, the settings, the vetting results. The runs are stored in a separate file,
/// [`Self::runs_bytes`].
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShardPlan {
    schema: String,
    dmp_version: String,
    /// Hash of the content.
    hash: String,
    suggested: Suggested,
    /// The path of the log when planned.
    log: PathBuf,
    pub(super) content: Content,
}

/// The part of a plan on which all parts of the score must agree.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Content {
    pub(super) runs: Vec<PlannedRun>,
    pub(super) runs_hash: String,
    /// Scans in use, and returns of them.
    pub(super) scans: u64,
    pub(super) returns: u64,
    /// For each run.
    pub(super) segments: Vec<SegmentReport>,
    pub(super) voxel: Surveyed,
    pub(super) filter: ReturnFilter,
    pub(super) settings: Settings,
    /// The vetting results.
    pub(super) vetted: VetSummary,
    /// Whether part of the log or of a run is lost.
    pub(super) is_damaged: bool,
    pub(super) index: LogIndex,
}

/// A run of a plan, for display.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedRun {
    /// Its name.
    pub name: String,
    /// The file of its trajectory.
    pub file: Option<String>,
    /// Its number of poses.
    pub poses: usize,
}

/// The BLAKE3 hash of some bytes, as text.
pub(super) fn hash_of(bytes: &[u8]) -> String {
    ContentHash::of(bytes).to_string()
}

impl ShardPlan {
    /// The name of the JSON format.
    pub const SCHEMA: &'static str = "dmp-plan/1";

    /// Rejects settings that need all returns at once.
    ///
    /// # Errors
    /// [`EvaluateError::Setting`] with the first of them.
    pub fn check_settings(config: &Config) -> Result<(), EvaluateError> {
        let refused = |setting, why| Err(EvaluateError::setting(setting, "in parts".to_owned(), why));
        if config.save_maps.is_some() {
            let why = "the maps are in pieces: use `dmp map build`";
            return refused(SettingName::SaveMaps, why);
        }
        Ok(())
    }

    /// Plans the score of `runs` on a log: makes every decision that [`evaluate`](dmp::evaluate) makes
    /// before it fuses, from the same scans. `vetted` is the vetting result; `is_damaged` says whether part
    /// of the log or of a run is lost.
    ///
    /// # Errors
    /// As [`evaluate`](dmp::evaluate); and when a setting is not available in parts, or the log is not on
    /// disk.
    pub fn new<'a>(
        log: &'a dyn ScanLog,
        runs: &'a [Run],
        config: &Config,
        (vetted, is_damaged): (VetSummary, bool),
        machine: Machine,
        watch: impl Into<Watch<'a>>,
    ) -> Result<Self, ShardError> {
        Self::check_settings(config)?;
        if let Some(run) = runs.iter().find(|run| run.map != MapSource::Fused) {
            let value = format!("of `{}` in parts", run.name);
            return Err(
                EvaluateError::setting(SettingName::Map, value, "maps are fused from the scans").into()
            );
        }
        let index = log.index()?.ok_or(ShardError::NoIndex)?;
        let planned = PlannedScore::new(log, runs, config, watch)?;
        let suggested = Suggested::of(&planned, machine);
        let content = Content {
            runs: runs.iter().map(PlannedRun::of).collect(),
            runs_hash: hash_of(&runs_bytes(runs)?),
            scans: planned.scans() as u64,
            returns: planned.returns(),
            segments: planned.segments(),
            voxel: planned.voxel(),
            filter: planned.filter().clone(),
            settings: planned.settings().clone(),
            vetted,
            is_damaged,
            index,
        };
        Ok(Self {
            schema: Self::SCHEMA.to_owned(),
            dmp_version: env!("CARGO_PKG_VERSION").to_owned(),
            hash: content.hash()?,
            suggested,
            log: std::path::absolute(&log.summary().path).unwrap_or_else(|_| log.summary().path.clone()),
            content,
        })
    }

    /// Checks that it is unchanged since it was written by this version.
    ///
    /// # Errors
    /// When it is not.
    pub fn check(&self) -> Result<(), ShardError> {
        if self.schema != Self::SCHEMA || self.dmp_version != env!("CARGO_PKG_VERSION") {
            let (schema, version) = (self.schema.clone(), self.dmp_version.clone());
            return Err(ShardError::OtherVersion { schema, version });
        }
        let found = self.content.hash()?;
        if found != self.hash {
            return Err(ShardError::PlanChanged { found, said: self.hash.clone() });
        }
        Ok(())
    }

    /// Hash of the content; distinguishes it from every other plan.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// Suggested number of parts of each stage.
    pub fn suggested(&self) -> &Suggested {
        &self.suggested
    }

    /// The path of the log when planned.
    pub fn log(&self) -> &Path {
        &self.log
    }

    /// The log's index, with the positions of its scans.
    pub fn index(&self) -> &LogIndex {
        &self.content.index
    }

    /// The names of all given runs, the scored ones first.
    pub fn names(&self) -> Vec<&str> {
        let scored = self.content.runs.iter().map(|run| run.name.as_str());
        scored.chain(self.content.vetted.names_left_out()).collect()
    }

    /// The runs, for display.
    pub fn runs(&self) -> &[PlannedRun] {
        &self.content.runs
    }

    /// Scans in use.
    pub fn scans(&self) -> u64 {
        self.content.scans
    }

    /// Returns of these scans.
    pub fn returns(&self) -> u64 {
        self.content.returns
    }

    /// Whether part of the log or of a run is lost, or a run excluded.
    pub fn is_incomplete(&self) -> bool {
        self.content.is_damaged || self.content.vetted.leaves_out()
    }

    /// The runs of a plan as bytes, for the file beside it.
    ///
    /// # Errors
    /// When they cannot be serialised.
    pub fn runs_bytes(runs: &[Run]) -> Result<Vec<u8>, ShardError> {
        runs_bytes(runs)
    }

    /// The runs from these bytes.
    ///
    /// # Errors
    /// When they are not those of this plan.
    pub fn read_runs(&self, path: &Path, bytes: &[u8]) -> Result<Vec<Run>, ShardError> {
        let found = hash_of(bytes);
        if found != self.content.runs_hash {
            let (found, expected) = (format!("runs {found}"), format!("runs {}", self.content.runs_hash));
            return Err(ShardError::OtherPart { path: path.to_owned(), found, expected });
        }
        postcard::from_bytes(bytes)
            .map_err(|error| ShardError::Content { path: path.to_owned(), detail: error.to_string() })
    }
}

fn runs_bytes(runs: &[Run]) -> Result<Vec<u8>, ShardError> {
    Ok(postcard::to_allocvec(runs).map_err(EvaluateError::Checkpoint)?)
}

impl Content {
    /// Hash of its JSON, which is the same after reading and writing.
    fn hash(&self) -> Result<String, ShardError> {
        let bytes = serde_json::to_vec(self)
            .map_err(|error| ShardError::Content { path: "plan".into(), detail: error.to_string() })?;
        Ok(hash_of(&bytes))
    }
}

impl PlannedRun {
    fn of(run: &Run) -> Self {
        let (name, file) = (run.name.clone(), run.source.file.clone());
        Self { name, file, poses: run.trajectory.len() }
    }
}
