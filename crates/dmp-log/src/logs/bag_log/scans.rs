//! Where the scans of a bag lie, written down.

use super::topic::Entry;
use crate::messages::{Bag, IndexedBag, IndexedPlace, ScanCoding};
use crate::points::TimeChoice;
use crate::{LogError, PlaceInFile};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::PathBuf;

/// Where the scans of one topic of a bag lie, and how they are read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct BagScans {
    pub(super) bag: IndexedBag,
    pub(super) time: Option<TimeChoice>,
    codings: Vec<ScanCoding>,
    scans: Vec<IndexedScan>,
}

/// A scan: stamp, returns, its place among the codings, the number of its message, and where that lies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct IndexedScan(i64, u64, u32, u64, IndexedPlace);

impl BagScans {
    /// Those of a bag that was opened whole.
    pub(super) fn of(bag: &Bag, time: Option<TimeChoice>, entries: &[Entry]) -> Result<Self, LogError> {
        let mut codings: Vec<ScanCoding> = Vec::new();
        let mut scans = Vec::with_capacity(entries.len());
        for entry in entries {
            let known = codings.iter().position(|coding| *coding == entry.coding);
            let coding = known.unwrap_or(codings.len());
            if known.is_none() {
                codings.push(entry.coding);
            }
            let place = IndexedPlace::of(&entry.location);
            scans.push(IndexedScan(entry.stamp_ns, entry.returns, coding as u32, entry.message, place));
        }
        Ok(Self { bag: IndexedBag::of(bag)?, time, codings, scans })
    }

    /// The scans of the bag.
    pub(super) fn entries(&self, bag: &Bag) -> Result<Vec<Entry>, LogError> {
        let entry = |scan: &IndexedScan| {
            let IndexedScan(stamp_ns, returns, coding, message, place) = *scan;
            let coding = *self.codings.get(coding as usize)?;
            let location = self.bag.location(place)?;
            Some(Entry { location, coding, stamp_ns, returns, layout: 0, frame: 0, message })
        };
        let entries: Option<Vec<Entry>> = self.scans.iter().map(entry).collect();
        entries.ok_or_else(|| {
            let problem = "its index names a file or a coding that it has not";
            LogError::malformed(bag.path(), PlaceInFile::WholeFile, problem)
        })
    }

    /// See [`LogIndex::ranges`](crate::LogIndex::ranges).
    pub(crate) fn ranges(
        &self,
        frames: impl IntoIterator<Item = usize>,
    ) -> Vec<(PathBuf, u64, Vec<Range<u64>>)> {
        let places = frames.into_iter().filter_map(|frame| self.scans.get(frame)).map(|scan| scan.4);
        self.bag.ranges(places)
    }
}
