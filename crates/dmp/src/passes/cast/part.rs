//! Casts some frames on their own, for scores that are merged elsewhere.

use dmp_reduce::{Basis, FrameSet, ReduceError};
use dmp_runs::{EvaluateError, Stage};

use super::casters::{RunCaster, SharedTiles};
use super::checkpoint::Casting;
use super::pass::{Scored, Sums};
use super::worker::{CastWorker, OwnTileSums};
use crate::passes::evaluation::Evaluation;
use crate::passes::frames::{Pauses, each_frame_in_parts, jobs_of};

impl Evaluation<'_, RunCaster> {
    /// Casts the drawn returns of some frames into every run's map; returns the sums.
    ///
    /// # Errors
    /// When the log or a map cannot be read.
    pub(crate) fn cast_part(&self, tiles: &SharedTiles, wanted: &FrameSet) -> Result<Casting, EvaluateError> {
        let layout = self.layout();
        let workers = (0..self.means.threads).map(|_| CastWorker::new(self, &layout)).collect();
        let reading = self.drawn_reading();
        let jobs = jobs_of(reading, |ordinal| wanted.contains(ordinal));
        let schedule = tiles.schedule.get_or_init(|| self.schedule(&mut jobs.iter()));
        self.progress.begin(Stage::Cast, self.plan.returns_of(wanted));
        let (workers, _) = tiles.with_prefetch(&self.runs, self.means.threads, schedule, |ahead| {
            let done = FrameSet::default();
            let pauses = Pauses { every: None, done, keep: &mut |_, _| Ok(()), ahead };
            each_frame_in_parts(reading, jobs, workers, pauses)
        })?;
        let sums = Sums::nothing(&layout).with(&workers)?;
        // Sums by tile serve plots only, and would dominate the size.
        Ok(Sums { tiles: OwnTileSums::new(), ..sums }.kept(wanted.clone()))
    }
}

impl<M> Evaluation<'_, M> {
    /// The score of all parts of the cast, for runs whose maps were fused.
    ///
    /// # Errors
    /// When two parts share a frame, or are of other runs.
    pub(crate) fn put_together(&self, parts: Vec<Casting>) -> Result<Scored, EvaluateError> {
        let layout = &self.layout_for(vec![Basis::CrossValidated; self.runs.len()]);
        let mut sums = Sums::nothing(layout);
        for part in parts {
            let Sums { reducer, counts, tiles: _, shapes, marks } = Sums::of_kept(part, layout)?;
            sums.reducer.merge(&reducer)?;
            let frames = layout.frames();
            if let Some(&(ordinal, _)) = marks.iter().find(|(ordinal, _)| *ordinal >= frames) {
                return Err(ReduceError::NoSuchFrame { ordinal, frames }.into());
            }
            sums.counts.merge(&counts);
            sums.shapes.extend(shapes);
            sums.marks.extend(marks);
        }
        sums.reducer.add_empty_frames(self.unused_frames())?;
        self.scored(sums)
    }
}
