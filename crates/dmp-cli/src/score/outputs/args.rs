//! The files that are asked for beside the report.

use std::path::{Path, PathBuf};

use clap::Args;

use super::targets::{self, ResidualFile, residual_files, writable};
use crate::clash::refuse_clashes;
use crate::exit::Usage;
use crate::named::NamedFile;
use crate::view::ViewArgs;

/// Files to write beside the report.
#[derive(Debug, Args)]
pub(crate) struct OutputArgs {
    /// Write a page to look at, FILE.html: the ranking in words, maps from above, where and when runs are wrong. One
    /// file that needs no network
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub(crate) report: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    /// The run that is taken to be true, as a published ground truth: the page tells where it is worse than the others, and by
    /// how much
    #[arg(long, value_name = "NAME", requires = "report", conflicts_with = "quick", help_heading = "Output")]
    reference: Option<String>,
    /// Write a scene for viewers as rerun and Foxglove, FILE.mcap: of every run the map, coloured by how much it is off, the way,
    /// residuals over time, single returns and the worst places, in one frame. docs/guide/viewers.md has the commands
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    scene: Option<PathBuf>,
    /// Keep the result with what every return is off by, FILE.dmp, about two bytes a return and run: `dmp compare` then judges
    /// these runs against those of other days, which need not be scored again. Not with --decide, where scans depend on
    /// all runs
    #[arg(long, value_name = "FILE", conflicts_with = "decide", help_heading = "Output")]
    keep: Option<PathBuf>,
    /// Write every scored return with its residuals to FILE.laz, .las, .ply or .pcd (in world coordinates, with the
    /// residuals as fields) or .mcap (scan by scan, with the pose as /tf). With several runs each has its own file,
    /// out.laz becoming out.NAME.laz; with NAME= it is that of one run. docs/residuals.md has the fields
    #[arg(long, value_name = "[NAME=]FILE", help_heading = "Output")]
    residuals: Vec<NamedFile>,
    /// Write the scores of every run in every scored scan as a table, FILE.csv
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    per_frame: Option<PathBuf>,
    /// Write the scores of every run in every tile of the ground as a table, FILE.csv
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    per_tile: Option<PathBuf>,
}

/// What is to be written where.
#[derive(Debug)]
pub(crate) struct Outputs {
    /// Of each run.
    pub(super) residuals: Vec<Option<ResidualFile>>,
    pub(super) per_frame: Option<PathBuf>,
    pub(super) per_tile: Option<PathBuf>,
    pub(super) page: Option<PathBuf>,
    pub(super) scene: Option<PathBuf>,
    pub(super) keep: Option<PathBuf>,
    /// The run that is taken to be true.
    pub(super) reference: Option<String>,
}

impl Outputs {
    /// What is left of it when only these runs are scored.
    pub(crate) fn of_runs(mut self, is_kept: &[bool]) -> Self {
        let mut kept = is_kept.iter();
        self.residuals.retain(|_| kept.next().copied().unwrap_or(false));
        self
    }
}

impl OutputArgs {
    /// Whether there is to be a table of tiles.
    pub(crate) fn per_tile(&self) -> bool {
        self.per_tile.is_some()
    }

    /// What is to be written for runs of these names. What cannot be written is an error here, before a long log is
    /// read: an unknown extension, a folder that is not there, a file that is an input or another output.
    pub(crate) fn plan(&self, runs: &[&str], inputs: &[&Path]) -> anyhow::Result<Outputs> {
        let residuals = residual_files(runs, &self.residuals)?;
        let tables = [&self.per_frame, &self.per_tile].map(Option::as_deref);
        let pages = [&self.report, &self.scene, &self.keep].map(Option::as_deref);
        let files = residuals.iter().flatten().map(|file| file.path.as_path());
        let files: Vec<&Path> =
            files.chain(tables.into_iter().flatten()).chain(pages.into_iter().flatten()).collect();
        refuse_clashes(&files, inputs)?;
        if let Some(name) = self.reference.as_deref().filter(|name| !runs.contains(name)) {
            let names = runs.join(", ");
            return Err(
                Usage(format!("--reference {name}: no run has this name; the runs are {names}")).into()
            );
        }
        self.report.as_deref().map_or(Ok(()), targets::check_html)?;
        self.scene.as_deref().map_or(Ok(()), targets::check_mcap)?;
        self.keep.as_deref().map_or(Ok(()), targets::check_dmp)?;
        for table in tables.into_iter().flatten() {
            targets::check_csv(table)?;
        }
        files.iter().try_for_each(|file| writable(file))?;
        let (per_frame, per_tile) = (self.per_frame.clone(), self.per_tile.clone());
        let (page, reference) = (self.report.clone(), self.reference.clone());
        let (scene, keep) = (self.scene.clone(), self.keep.clone());
        Ok(Outputs { residuals, per_frame, per_tile, page, scene, keep, reference })
    }
}
