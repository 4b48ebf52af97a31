//! What later passes need of the scans, kept while the maps are fused: the log is not read again.

mod choice;
mod mark;
mod shape;

use std::cell::LazyCell;
use std::sync::{Arc, OnceLock};

use dmp_disk::{ScratchFile, TileId};
use dmp_runs::{EvaluateError, PlannedFrame};
use dmp_sensor::Scan;

pub(crate) use choice::{Choice, Followed, spread};
use mark::mark_of;
pub(crate) use shape::{ScanShape, half_octave_m};

/// What is said of a whole scan when it is cast.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ScanFacts {
    /// Returns, used or not.
    pub(crate) returns: u64,
    /// Where the log has no checksums.
    pub(crate) shape: Option<ScanShape>,
    /// A hash of the returns, equal for scans with equal returns; `None` with too few.
    pub(crate) mark: Option<u64>,
}

/// A drawn return in the file: the bits of its coordinates in the sensor frame, metres, and of its time after the scan's
/// stamp, nanoseconds.
type DrawnReturn = [u32; 4];

/// Bytes on disk of a drawn return, with its part of the checksums.
pub(crate) const DRAWN_BYTES: f64 = 16.0 + 4.0 / 64.0;

/// The returns that later passes need, each where this process fused the maps; else they are read from the log.
#[derive(Debug, Clone, Default)]
pub(crate) struct KeptReturns {
    pub(crate) has_checksums: bool,
    pub(crate) to_follow: Option<Arc<DrawnScans>>,
    /// Where a share of the returns is cast.
    pub(crate) to_cast: Option<Arc<DrawnScans>>,
}

/// Chosen returns of the scans of one plan, in a file that vanishes with the process.
#[derive(Debug)]
pub(crate) struct DrawnScans {
    choice: Choice,
    file: ScratchFile<DrawnReturn>,
    facts: Vec<OnceLock<ScanFacts>>,
}

impl ScanFacts {
    pub(crate) fn of(scan: &Scan, has_checksums: bool) -> Self {
        let shape = (!has_checksums).then(|| ScanShape::of(scan));
        Self { returns: scan.len() as u64, shape, mark: mark_of(scan) }
    }
}

impl KeptReturns {
    pub(crate) fn all(&self) -> impl Iterator<Item = &DrawnScans> {
        [&self.to_follow, &self.to_cast].into_iter().flatten().map(Arc::as_ref)
    }

    /// Keeps what is needed of a scan.
    pub(crate) fn keep(&self, frame: (usize, &PlannedFrame), scan: &Scan) -> Result<(), EvaluateError> {
        let facts = LazyCell::new(|| ScanFacts::of(scan, self.has_checksums));
        self.all().try_for_each(|drawn| drawn.keep(frame, scan, || *facts))
    }
}

impl DrawnScans {
    /// None so far of so many planned scans; the file is made in `folder`.
    pub(crate) fn new(choice: Choice, scans: usize, folder: &std::path::Path) -> Result<Self, EvaluateError> {
        let facts = std::iter::repeat_with(OnceLock::new).take(scans).collect();
        Ok(Self { choice, file: ScratchFile::new(folder)?, facts })
    }

    /// Keeps the chosen returns of a scan. A scan that lasts for more than two seconds is not kept: it is read again.
    fn keep(
        &self,
        (ordinal, frame): (usize, &PlannedFrame),
        scan: &Scan,
        facts_of_scan: impl FnOnce() -> ScanFacts,
    ) -> Result<(), EvaluateError> {
        let Some(places) = self.choice.of_scan((ordinal, frame), scan) else { return Ok(()) };
        let returned = |place: usize| {
            let offset_ns = scan.time_offsets_ns.get(place).copied().unwrap_or(0);
            let [x, y, z] = scan.points_in_sensor_m[place].map(f32::to_bits);
            Some([x, y, z, i32::try_from(offset_ns).ok()?.cast_unsigned()])
        };
        let drawn: Option<Vec<_>> = places.into_iter().map(returned).collect();
        if let (Some(drawn), Some(facts)) = (drawn, self.facts.get(ordinal)) {
            self.file.append(key(ordinal), drawn)?;
            // A scan is fused once.
            let _ = facts.set(facts_of_scan());
        }
        Ok(())
    }

    /// Leaves the chosen returns of a scan in `scan`, in their order, without a stamp; `None` where they were not kept.
    ///
    /// # Errors
    /// When the file cannot be read back as it was written.
    pub(crate) fn read(&self, ordinal: usize, scan: &mut Scan) -> Result<Option<ScanFacts>, EvaluateError> {
        let Some(facts) = self.facts.get(ordinal).and_then(OnceLock::get) else { return Ok(None) };
        scan.stamp_ns = None;
        scan.points_in_sensor_m.clear();
        scan.time_offsets_ns.clear();
        self.file.read(key(ordinal), |&[x, y, z, offset_ns]| {
            scan.points_in_sensor_m.push([x, y, z].map(f32::from_bits));
            scan.time_offsets_ns.push(offset_ns.cast_signed().into());
            Ok::<(), EvaluateError>(())
        })?;
        Ok(Some(*facts))
    }

    /// Bytes written.
    pub(crate) fn bytes(&self) -> u64 {
        self.file.bytes()
    }
}

/// A scan is a part of the file like a tile.
fn key(ordinal: usize) -> TileId {
    TileId { y: (ordinal >> 31) as i32, x: (ordinal & 0x7fff_ffff) as i32 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_runs::CastReturns;

    #[test]
    fn the_drawn_returns_of_a_scan_are_read_as_they_were_and_long_scans_are_not_kept() {
        let draw = CastReturns::OneIn(8).draw((0, 0), 5);
        let drawn = DrawnScans::new(Choice::ToCast(draw), 40, &std::env::temp_dir()).unwrap();
        let frame =
            |ordinal: usize| PlannedFrame { frame: ordinal, number: 3 * ordinal, stamp_ns: None, returns: 0 };
        let scan = |ordinal: usize| Scan {
            stamp_ns: Some(7),
            points_in_sensor_m: (0..1000 * (ordinal % 3)).map(|k| [k as f32, f32::NAN, -0.0]).collect(),
            time_offsets_ns: (0..1000 * (ordinal as i64 % 3)).map(|k| (k - 500) * 5_000_000).collect(),
        };
        let short = |ordinal: usize| {
            let whole = scan(ordinal);
            Scan { time_offsets_ns: whole.time_offsets_ns.iter().map(|ns| ns / 1000).collect(), ..whole }
        };
        let kept = KeptReturns { to_cast: Some(Arc::new(drawn)), ..KeptReturns::default() };
        for ordinal in (0..40).rev().filter(|ordinal| ordinal % 7 != 0) {
            kept.keep((ordinal, &frame(ordinal)), &short(ordinal)).unwrap();
        }
        kept.keep((7, &frame(7)), &scan(7)).unwrap();
        let drawn = kept.to_cast.unwrap();
        let mut read = Scan::default();
        for ordinal in 0..40 {
            let facts = drawn.read(ordinal, &mut read).unwrap();
            let whole = short(ordinal);
            assert_eq!(facts, (ordinal % 7 != 0).then(|| ScanFacts::of(&whole, false)), "{ordinal}");
            if facts.is_some() {
                let places: Vec<usize> = draw.of_scan(3 * ordinal, whole.len()).collect();
                let bits = |point: [f32; 3]| point.map(f32::to_bits);
                let points = read.points_in_sensor_m.iter().copied().map(bits);
                assert!(points.eq(places.iter().map(|&k| bits(whole.points_in_sensor_m[k]))), "{ordinal}");
                assert!(read.time_offsets_ns.iter().eq(places.iter().map(|&k| &whole.time_offsets_ns[k])));
            }
        }
        // 1/8 of 16 bytes, with a checksum for each 64.
        let returns: u64 = (0..40).filter(|k| k % 7 != 0).map(|k| 125 * (k % 3)).sum();
        assert!((drawn.bytes() as f64 / returns as f64 - DRAWN_BYTES).abs() < 0.05, "{}", drawn.bytes());
    }
}
