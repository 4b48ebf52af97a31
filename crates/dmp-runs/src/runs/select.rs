//! Selects the scans of the log to score, whatever runs there are.

use dmp_log::{StampJump, stamp_jumps};

use crate::asked::{EvaluateError, Settings};
use crate::runs::frame::PlannedFrame;
use crate::runs::heads::Heads;

/// The scans to score, and why the others are not scored.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// The scans asked for, in order of time.
    pub frames: Vec<PlannedFrame>,
    /// Returns of scans that were not asked for.
    pub unselected_returns: u64,
    /// Number of backward steps of the log's stamps.
    pub out_of_order: usize,
    /// Scans with the stamp of another.
    pub same_stamp: usize,
    /// Where the log's stamps jump, whether those scans are in use or not.
    pub stamp_jumps: Vec<StampJump>,
}

impl Selection {
    /// Selects the scans that the settings ask for.
    ///
    /// # Errors
    /// When the log has no scan.
    pub fn new(heads: Heads<'_>, settings: &Settings) -> Result<Self, EvaluateError> {
        if heads.readable() == 0 {
            return Err(EvaluateError::NoScans { path: heads.summary().path.clone() });
        }
        let mut selection = Self::default();
        for (frame, (number, info)) in heads.scans().enumerate() {
            if number % settings.every != 0 {
                selection.unselected_returns += info.returns;
                continue;
            }
            let stamp_ns = info.stamp_ns.map(|stamp_ns| stamp_ns.saturating_add(settings.time_offset_ns));
            selection.frames.push(PlannedFrame { frame, number, stamp_ns, returns: info.returns });
        }
        let frames = &mut selection.frames;
        selection.out_of_order = frames.windows(2).filter(|pair| pair[1].stamp_ns < pair[0].stamp_ns).count();
        frames.sort_by_key(|frame| (frame.stamp_ns, frame.frame));
        let same =
            |pair: &&[PlannedFrame]| pair[0].stamp_ns.is_some() && pair[0].stamp_ns == pair[1].stamp_ns;
        selection.same_stamp = frames.windows(2).filter(same).count();
        let stamps: Vec<(usize, i64)> =
            heads.scans().filter_map(|(number, info)| Some((number, info.stamp_ns?))).collect();
        selection.stamp_jumps = stamp_jumps(&stamps);
        Ok(selection)
    }
}
