//! Where every return of the log went.

use dmp_runs::EvaluateError;
use dmp_sensor::DropReason;

use super::findings::drops_in_words;
use crate::passes::{Evaluation, Scored};

impl<M> Evaluation<'_, M> {
    /// Counts every return of the log as used, or as dropped for a reason.
    ///
    /// # Errors
    /// When the counts of the fuse pass and of the cast pass differ, or nothing was cast.
    pub(crate) fn account(&self, scored: &mut Scored) -> Result<(), EvaluateError> {
        if let Some(mut first) = self.fused.counts {
            // Of what was not drawn, fusing knows whether it could have been cast.
            let not_drawn = scored.counts.dropped(DropReason::NotDrawn);
            let (cast, fused) = (scored.counts.used(), first.used());
            first.drop_used(DropReason::NotDrawn, fused.saturating_sub(cast));
            if first.total() != scored.counts.total() || not_drawn == 0 && first != scored.counts {
                return Err(EvaluateError::LogChanged { first: fused, second: cast });
            }
            scored.counts = first;
        }
        let (used, all) = (self.returns(), self.plan.frames().iter().map(|frame| frame.returns).sum::<u64>());
        scored.counts.add_dropped(DropReason::ScanNotSelected, self.plan.selection.unselected_returns);
        scored.counts.add_dropped(DropReason::ScanWithoutPose, all - used);
        if scored.counts.used() == 0 {
            return Err(EvaluateError::NoReturns(drops_in_words(&scored.counts)));
        }
        Ok(())
    }
}
