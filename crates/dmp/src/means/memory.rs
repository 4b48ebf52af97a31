//! Divides the memory: threads take what they need, and the shares below divide the rest.

use dmp_cast::{Answer, Query};
use dmp_log::{LogFormat, ScanLog};
use dmp_reduce::{FrameSums, Reducer, Residuals};
use dmp_runs::{BLOCK_RAYS, EvaluateError, KNOWN_TIMES, MIN_BLOCK_RETURNS, Means, POSE_BYTES};
use dmp_sensor::{Isometry3, Ray};

use crate::means::extent::{Extent, TILE_SUMS_BYTES};

// Shares of the memory for tables and tiles, one pass at a time. The remainder covers fragmentation: the C
// library holds freed memory because lists are freed in another order than allocated, measured up to a third
// (docs/performance.md).

/// The maps under construction, together.
const FUSE_SHARE: f64 = 0.5;
/// The tiles of all maps during the cast.
const CAST_SHARE: f64 = 0.54;
/// The places that the maps leave out, during the cast.
const LEFT_OUT_SHARE: f64 = 0.01;
/// The tiles in which rays are counted, and the counts, during the search for trails.
const COUNTED_TILES_SHARE: f64 = 0.3;
const COUNTS_SHARE: f64 = 0.2;

// Fixed memory, before anything is shared:

/// The program itself, bytes.
const PROGRAM_BYTES: usize = 8 << 20;
/// Memory of each of them, in a table that is at most half full.
const KNOWN_TIME_BYTES: usize = 4 * size_of::<(i64, usize)>();
/// Memory of a thread per ray of a block: ray, time, query, answer, residuals; plus a quarter for growing
/// lists.
const RAY_BYTES: usize =
    (size_of::<Ray>() + size_of::<i64>() + size_of::<Query>() + size_of::<Answer>() + size_of::<Residuals>())
        / 4
        * 5;
/// Memory of a thread per return of a scan: coordinates, a time, and growing lists.
const RETURN_BYTES: usize = 32;
/// Packets of rays in flight, the current tile and its construction.
const THREAD_BYTES: usize = 2 << 20;
/// Memory of a scan of the log: its entries in the index, the plan and the jobs.
const FRAME_BYTES: usize = 256;
/// Copies of reducers and tile sums beside those of the threads: the stored one, the merged one, and two to
/// be stored.
const MERGED: usize = 4;
/// Least memory for the sums of a run's map.
const LEAST_TABLE_BYTES: usize = 1 << 20;
/// The shares of the given memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Budget {
    /// The fixed part, bytes.
    fixed_bytes: usize,
    tables_bytes: usize,
}

impl Budget {
    /// The shares for a log and some runs.
    ///
    /// # Errors
    /// When the given memory is too small for the threads and the runs.
    pub(crate) fn new(log: &dyn ScanLog, extent: Extent, means: &Means) -> Result<Self, EvaluateError> {
        let largest_scan = log.frames().iter().map(|frame| frame.returns).max().unwrap_or(0) as usize;
        let row_bytes = log.summary().point_bytes as usize;
        let group = |frames: std::ops::Range<usize>| -> u64 {
            log.frames()[frames].iter().map(|frame| frame.returns).sum()
        };
        let formats = [LogFormat::Mcap, LogFormat::Rosbag2Mcap, LogFormat::Rosbag1];
        let in_chunks = formats.contains(&log.summary().format);
        let largest_read = if in_chunks {
            log.groups().into_iter().map(group).max().unwrap_or(0) as usize
        } else {
            largest_scan
        };
        let (threads, asked, runs) = (means.threads, means.memory_bytes, extent.runs);
        let thread = thread_bytes(largest_scan, largest_read, row_bytes, runs);
        let fixed_bytes = extent.fixed_bytes(threads, thread, log.frames().len());
        let needed = fixed_bytes.saturating_add(runs * LEAST_TABLE_BYTES);
        if asked < needed {
            return Err(EvaluateError::TooLittleMemory { asked, needed, threads, runs });
        }
        Ok(Self { fixed_bytes, tables_bytes: asked - fixed_bytes })
    }

    /// The memory of an evaluation with room for this many bytes of tiles during the cast.
    pub(crate) fn memory_for_tiles(&self, tiles_bytes: u64) -> u64 {
        self.fixed_bytes as u64 + (tiles_bytes as f64 / CAST_SHARE) as u64
    }

    /// For the sums of each of several maps fused at once, bytes.
    pub(crate) fn map_bytes(&self, maps: usize) -> usize {
        self.share(FUSE_SHARE) / maps.max(1)
    }

    /// For the tiles of all maps during the cast, bytes.
    pub(crate) fn cast_bytes(&self) -> usize {
        self.share(CAST_SHARE)
    }

    /// For the places that the maps leave out, during the cast, bytes.
    pub(crate) fn left_out_bytes(&self) -> usize {
        self.share(LEFT_OUT_SHARE)
    }

    /// For the run whose trails are searched for, bytes.
    pub(crate) fn trails(&self) -> TrailBytes {
        TrailBytes { tiles: self.share(COUNTED_TILES_SHARE), counts: self.share(COUNTS_SHARE) }
    }

    fn share(&self, share: f64) -> usize {
        (share * self.tables_bytes as f64) as usize
    }
}

/// The memory of one run during the search for trails, bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrailBytes {
    /// Tiles in which rays are counted.
    pub(crate) tiles: usize,
    /// The counts.
    pub(crate) counts: usize,
}

impl Extent {
    /// The fixed part, bytes, given the needs of a thread.
    fn fixed_bytes(&self, threads: usize, thread: usize, frames: usize) -> usize {
        let Self { runs, poses, tiles } = *self;
        let sums = threads.saturating_add(MERGED).saturating_mul(tiles.saturating_mul(TILE_SUMS_BYTES));
        // One more thread loads tiles ahead.
        let rest = PROGRAM_BYTES
            + THREAD_BYTES
            + MERGED * Reducer::bytes_of(runs)
            + poses * POSE_BYTES
            + frames * FRAME_BYTES;
        threads.saturating_mul(thread).saturating_add(sums).saturating_add(rest)
    }
}

/// The memory needs of a thread.
fn thread_bytes(largest_scan: usize, largest_read: usize, row_bytes: usize, runs: usize) -> usize {
    // Packed and unpacked.
    let reader = 2 * largest_read.saturating_mul(row_bytes);
    let rays = BLOCK_RAYS.max(MIN_BLOCK_RETURNS * runs).min(largest_scan.saturating_mul(runs));
    let sums = FrameSums::bytes_of(runs) + Reducer::bytes_of(runs);
    let known = KNOWN_TIMES.min(largest_scan) * (KNOWN_TIME_BYTES + runs * size_of::<Isometry3<f64>>());
    known + reader + largest_scan.saturating_mul(RETURN_BYTES) + rays * RAY_BYTES + sums + THREAD_BYTES
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_threads_than_there_can_be_are_no_overflow() {
        let extent = Extent { runs: 4, poses: 1000, tiles: 1000 };
        assert_eq!(extent.fixed_bytes(usize::MAX, THREAD_BYTES, 100), usize::MAX);
    }
}
