//! The scans of a drive by its log's outline, some of them loaded.

use std::collections::{BTreeSet, HashMap};

use dmp_log::{LogOutline, MemoryLog, OutlinedScan, ScanLog};
use dmp_map::Store;
use dmp_runs::{EvaluateError, PlannedFrame, PosedRun, RunPoses, Settings};

use super::drive::Drive;

/// A drive on a log of which few scans were read. Scans are identified by their ordinals in the drive.
#[derive(Debug)]
pub(crate) struct DriveScans<'a> {
    outline: &'a LogOutline,
    drive: &'a Drive,
    runs: &'a [PosedRun<'a, Option<Store>>],
    /// From a scan's number in the log to its ordinal in the drive.
    ordinals: HashMap<usize, usize>,
}

impl<'a> DriveScans<'a> {
    pub(crate) fn new(
        outline: &'a LogOutline,
        drive: &'a Drive,
        runs: &'a [PosedRun<'a, Option<Store>>],
    ) -> Self {
        let numbers = drive.frames.iter().enumerate().map(|(ordinal, frame)| (frame.number, ordinal));
        Self { outline, drive, runs, ordinals: numbers.collect() }
    }

    pub(crate) fn outline(&self) -> &'a LogOutline {
        self.outline
    }

    pub(crate) fn drive(&self) -> &'a Drive {
        self.drive
    }

    /// The runs, without maps.
    pub(crate) fn runs(&self) -> &'a [PosedRun<'a, Option<Store>>] {
        self.runs
    }

    /// The sensor's poses in each run.
    pub(crate) fn poses(&self) -> impl Iterator<Item = &'a RunPoses> {
        self.runs.iter().map(|run| &run.poses)
    }

    /// Whether most runs come by the place of a scan on another visit.
    pub(crate) fn is_revisit(&self, ordinal: usize) -> bool {
        let in_use = self.drive.in_use[ordinal];
        2 * self.runs.iter().filter(|run| run.path.is_revisit(in_use)).count() > self.runs.len()
    }

    fn outlined(&self, ordinal: usize) -> &OutlinedScan {
        &self.outline.scans()[self.drive.frames[ordinal].number]
    }

    /// For every scan the group it is packed in.
    pub(crate) fn groups(&self) -> Vec<u32> {
        (0..self.drive.frames.len()).map(|ordinal| self.outlined(ordinal).group).collect()
    }

    /// Bytes to read for these scans.
    pub(crate) fn bytes_of(&self, ordinals: &[usize]) -> u64 {
        let scans = ordinals.iter().map(|&ordinal| self.outlined(ordinal));
        let groups: BTreeSet<(u32, u64)> = scans.map(|scan| (scan.group, scan.bytes)).collect();
        groups.iter().map(|(_, bytes)| bytes).sum()
    }

    /// Loads these scans into memory.
    pub(crate) fn load(&self, ordinals: &[usize]) -> Result<MemoryLog, EvaluateError> {
        let number = |&ordinal: &usize| self.drive.frames[ordinal].number;
        let mut numbers: Vec<usize> = ordinals.iter().map(number).collect();
        numbers.sort_unstable();
        Ok(self.outline.load(&numbers)?)
    }

    /// Loaded scans as planned frames with their ordinals, at their own stamps;
    /// and the number of returns of scans without a pose.
    pub(crate) fn frames_of(
        &self,
        log: &MemoryLog,
        settings: &Settings,
    ) -> (Vec<(usize, PlannedFrame)>, u64) {
        let mut frames = Vec::with_capacity(log.frames().len());
        let mut unposed_returns = 0;
        for (frame, info) in log.frames().iter().enumerate() {
            let number = log.number_in_log(frame);
            let Some(&ordinal) = self.ordinals.get(&number) else { continue };
            let stamp_ns = info.stamp_ns.map(|stamp_ns| stamp_ns.saturating_add(settings.time_offset_ns));
            let planned = PlannedFrame { frame, number, stamp_ns, returns: info.returns };
            if self.poses().all(|run| run.of_frame(&planned).is_some() && run.carries(&planned)) {
                frames.push((ordinal, planned));
            } else {
                unposed_returns += info.returns;
            }
        }
        frames.sort_by_key(|(_, frame)| (frame.stamp_ns, frame.number));
        (frames, unposed_returns)
    }
}
