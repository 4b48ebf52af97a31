//! The scans that runs are vetted with: the same for all runs, whatever their poses.

use dmp_log::{LogOutline, ScanLog};
use dmp_report::Ego;
use dmp_revisit::calibrate::{Block, scans_of_block};
use dmp_sensor::{EgoMask, ReturnFilter, Scan};
use rayon::prelude::*;

use crate::asked::{EvaluateError, Progress, Settings, Stage};
use crate::runs::Heads;

/// Number of blocks, scans per block, returns per scan; fewer blocks, and scans closer together, where little is to be read.
const BLOCKS: usize = 32;
const SCANS: usize = 6;
const RETURNS: usize = 4000;
const FEW_BLOCKS: usize = 16;
const LITTLE_ROOM: usize = 16;

/// How many scans are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Extent {
    Full,
    Few,
}

/// Reads some scans in blocks, evenly spread over the log.
pub(super) fn read(
    heads: Heads<'_>,
    extent: Extent,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Vec<Block>, EvaluateError> {
    let scans = heads.readable();
    let (most, most_room) = match extent {
        Extent::Full => (BLOCKS, usize::MAX),
        Extent::Few => (FEW_BLOCKS, LITTLE_ROOM),
    };
    let count = most.min(scans / 4).max(1);
    let blocks: Vec<Vec<usize>> = (0..count)
        .map(|k| {
            let (start, end) = (k * scans / count, (k + 1) * scans / count);
            scans_of_block(start, (end - start).min(most_room), scans, SCANS)
        })
        .collect();
    let ego = match settings.ego {
        Ego::BoxMm(min, max) => EgoMask::from_box_mm(min, max),
        Ego::None | Ego::Auto => EgoMask::default(),
    };
    let filter = ReturnFilter { min_range_m: settings.min_range_m, max_range_m: settings.max_range_m, ego };
    progress.begin(Stage::Vet, blocks.iter().map(|block| block.len() as u64).sum());
    let gather = Gather { settings, progress, filter };
    match heads {
        Heads::Log(log) => gather.of_log(log, &blocks),
        Heads::Outline(outline) => gather.of_outline(outline, &blocks),
    }
}

struct Gather<'a> {
    settings: &'a Settings,
    progress: &'a dyn Progress,
    filter: ReturnFilter,
}

impl Gather<'_> {
    fn of_log(&self, log: &dyn ScanLog, blocks: &[Vec<usize>]) -> Result<Vec<Block>, EvaluateError> {
        blocks.par_iter().map(|block| self.block(log, block)).collect()
    }

    fn of_outline(&self, outline: &LogOutline, blocks: &[Vec<usize>]) -> Result<Vec<Block>, EvaluateError> {
        let mut gathered = Vec::with_capacity(blocks.len());
        for block in blocks {
            let part = outline.load(block)?;
            let frames: Vec<usize> = (0..part.frames().len()).collect();
            gathered.push(self.block(&part, &frames)?);
        }
        Ok(gathered)
    }

    fn block(&self, log: &dyn ScanLog, frames: &[usize]) -> Result<Block, EvaluateError> {
        let (mut reader, mut scan) = (log.reader()?, Scan::default());
        let mut block = Block::default();
        for &frame in frames {
            if self.progress.cancelled() {
                return Err(EvaluateError::Cancelled);
            }
            self.progress.advance(1);
            let stamp_ns = log.frames().get(frame).and_then(|info| info.stamp_ns);
            let stamp_ns = stamp_ns.map(|ns| ns.saturating_add(self.settings.time_offset_ns));
            reader.read(frame, &mut scan)?;
            let is_used = |point| self.filter.check(point).is_ok();
            block.add(log.number_in_log(frame), stamp_ns, &scan, RETURNS, is_used);
        }
        Ok(block)
    }
}
