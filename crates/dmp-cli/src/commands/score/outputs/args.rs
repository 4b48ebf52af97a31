//! The files that are written beside the report.

use std::path::{Path, PathBuf};

use super::targets::{self, ResidualFile, residual_files, writable};
use crate::console::Usage;
use crate::files::refuse_clashes;
use crate::options::{Asked, output};

/// What is to be written where.
#[derive(Debug, Clone)]
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

    /// What is to be written for runs of these names. What cannot be written is reported here, before a long log is read: an
    /// unknown extension, a missing folder, a file that is an input or another output.
    pub(crate) fn of(asked: &Asked, runs: &[&str], inputs: &[PathBuf]) -> anyhow::Result<Self> {
        let outputs = Self {
            residuals: residual_files(runs, &asked.all(&output::RESIDUALS))?,
            per_frame: asked.get(&output::PER_FRAME),
            per_tile: asked.get(&output::PER_TILE),
            page: asked.get(&output::REPORT),
            scene: asked.get(&output::SCENE),
            keep: asked.get(&output::KEEP),
            reference: asked.get(&output::REFERENCE),
        };
        let Self { residuals, per_frame, per_tile, page, scene, keep, reference } = &outputs;
        let tables: Vec<&Path> = [per_frame, per_tile].into_iter().flatten().map(PathBuf::as_path).collect();
        let others = [page, scene, keep].into_iter().flatten().map(PathBuf::as_path);
        let files = residuals.iter().flatten().map(|file| file.path.as_path());
        let files: Vec<&Path> = files.chain(tables.iter().copied()).chain(others).collect();
        refuse_clashes(&files, inputs)?;
        if let Some(name) = reference.as_deref().filter(|name| !runs.contains(name)) {
            let names = runs.join(", ");
            return Err(
                Usage(format!("--reference {name}: no run has this name; the runs are {names}")).into()
            );
        }
        page.as_deref().map_or(Ok(()), targets::check_html)?;
        scene.as_deref().map_or(Ok(()), targets::check_mcap)?;
        keep.as_deref().map_or(Ok(()), targets::check_dmp)?;
        tables.into_iter().try_for_each(targets::check_csv)?;
        files.iter().try_for_each(|file| writable(file))?;
        Ok(outputs)
    }
}
