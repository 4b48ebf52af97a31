//! Lists the files that a part reads, for a scheduler that copies them.

use std::ops::Range;

use dmp::PlannedScore;
use dmp_log::FileRanges;
use dmp_map::SumsBlock;
use dmp_reduce::FrameSet;
use serde::Serialize;

use super::cast::pieces_in_reach;
use super::drift::AllRevisits;
use super::error::ShardError;
use super::fuse::sums_name;
use super::merge::{MergedPart, piece_name, spans_of};
use super::opened::Shard;
use super::part::Part;
use super::stage::Stage;

/// The files that a part reads, beside the plan, its runs and the receipts of earlier stages.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Needs {
    /// Files of the log, with the byte ranges read from each: empty if no scan is read, `null` if unknown
    /// beforehand; then the whole log is needed.
    pub log: Option<Vec<FileRanges>>,
    /// Files of the plan's folder.
    pub files: Vec<NeededFile>,
}

/// A file of the plan's folder that a part reads.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct NeededFile {
    /// Its name.
    pub name: String,
    /// The bytes that are read, ascending; `null`: all.
    pub ranges: Option<Vec<Range<u64>>>,
}

impl Shard<'_> {
    /// The files that a part of a stage reads. The receipts of the earlier stages (`*.part`) must be present.
    ///
    /// # Errors
    /// When a receipt is missing.
    pub fn needs(&self, stage: Stage, part: Part) -> Result<Needs, ShardError> {
        let planned = self.planned()?;
        let of_log = |frames: &FrameSet| {
            self.plan.index().ranges(frames.iter().map(|scan| planned.frame_in_log(scan)))
        };
        match stage {
            Stage::Fuse => Ok(Needs {
                log: of_log(&Self::share(&planned, part, &planned.used_scans())),
                files: Vec::new(),
            }),
            Stage::Merge => Ok(Needs { log: Some(Vec::new()), files: self.needed_sums(&planned, part)? }),
            Stage::Cast => {
                let frames = Self::share(&planned, part, &planned.used_scans());
                let merged: Vec<(Part, MergedPart)> = self.folder.read(Stage::Merge)?;
                let mut files = Vec::new();
                for (number, run) in planned.runs().enumerate() {
                    let pieces = pieces_in_reach(&planned, number, &merged, &frames)?;
                    let name = |part| NeededFile { name: piece_name(part, run.file_stem), ranges: None };
                    files.extend(pieces.into_iter().map(name));
                }
                Ok(Needs { log: of_log(&planned.scans_to_cast(&frames)?), files })
            }
            Stage::Drift => {
                let revisits = AllRevisits::new(&planned);
                let mut scans = FrameSet::default();
                for (revisits, pairs) in revisits.of_part(part).1 {
                    scans.extend(revisits.scans(pairs).iter());
                }
                Ok(Needs { log: of_log(&scans), files: Vec::new() })
            }
        }
    }

    fn needed_sums(&self, planned: &PlannedScore<'_>, part: Part) -> Result<Vec<NeededFile>, ShardError> {
        let (fused, voxels) = self.fused(planned)?;
        let spans = spans_of(&voxels, self.runs.len(), part);
        let mut files = Vec::new();
        for (of, fused) in &fused {
            for ((run, span), sums) in planned.runs().zip(&spans).zip(&fused.sums) {
                let Some(span) = span else { continue };
                let mut ranges: Vec<Range<u64>> = Vec::new();
                for range in
                    sums.blocks.iter().filter(|block| span.touches(block.tile())).map(SumsBlock::range)
                {
                    match ranges.last_mut() {
                        Some(last) if last.end == range.start => last.end = range.end,
                        _ => ranges.push(range),
                    }
                }
                files.push(NeededFile { name: sums_name(*of, run.file_stem), ranges: Some(ranges) });
            }
        }
        Ok(files)
    }
}
