//! Fuses some scans on their own, for maps that are merged elsewhere.

use std::path::Path;

use dmp_map::SumsList;
use dmp_reduce::FrameSet;
use dmp_runs::{EvaluateError, PosedRun};
use dmp_sensor::ReturnCounts;

use super::checkpoint::Fusing;
use super::pass::{FusePass, Making};
use crate::passes::evaluation::Evaluation;

impl Evaluation<'_, Option<dmp_map::Store>> {
    /// Fuses some frames with the poses of every run and writes each run's sums to the file that `path`
    /// names. Returns the return counts and the content of each file.
    ///
    /// # Errors
    /// When the log cannot be read, or a file not be written.
    pub(crate) fn fuse_part(
        self,
        frames: &FrameSet,
        path: impl Fn(&str) -> std::path::PathBuf,
    ) -> Result<(ReturnCounts, Vec<SumsList>), EvaluateError> {
        let making = self.begin(Vec::new(), |_, _, _, _| Ok(()))?;
        let pass = FusePass { evaluation: &making, frames: Some(frames) };
        let counts = pass.run(&Fusing::default())?;
        let write = |run: PosedRun<'_, Making<()>>| {
            let (run, making) = run.with_map(());
            let Making::Scans(fuser) = making else { return Ok(SumsList::default()) };
            let path = path(&run.file_stem);
            fuser.write_sums(Path::new(&path)).map_err(EvaluateError::map_of(run.name()))
        };
        let lists = making.runs.into_iter().map(write).collect::<Result<_, EvaluateError>>()?;
        Ok((counts, lists))
    }
}
