//! Who gets how much of the memory: threads take what they need, and the rest is shared out by the numbers below.

use dmp_cast::{Answer, Query};
use dmp_log::{LogFormat, ScanLog};
use dmp_reduce::{FrameSums, Reducer, Residuals};
use dmp_sensor::{Isometry3, Ray};

use crate::error::EvaluateError;
use crate::extent::{Extent, TILE_SUMS_BYTES};
use crate::settings::Means;

// Of what tables and tiles may take, one pass at a time. The rest is what the C library holds and nobody uses: lists are
// freed in another order than they are made, measured up to a third (docs/performance.md).

/// The maps under construction, all together.
const FUSE_SHARE: f64 = 0.5;
/// The tiles of all maps while rays are cast.
const CAST_SHARE: f64 = 0.55;
/// The tiles that rays are counted in, and the counts, while trails are looked for.
const COUNTED_TILES_SHARE: f64 = 0.3;
const COUNTS_SHARE: f64 = 0.2;
/// Free voxels while maps are fused without them.
const FREE_VOXELS_SHARE: f64 = 0.1;
/// The one map that is made of a cloud, of all memory.
const CLOUD_MAP_SHARE: f64 = 0.5;
/// The tiles of a map that is put together of patches, of all memory, on all threads.
const PATCHED_TILES_SHARE: usize = 3;

// What there is before anything is shared:

/// What the program takes by itself, bytes.
const PROGRAM_BYTES: usize = 8 << 20;
/// Returns handled at a time, those of all runs together: bounds the memory of a thread however large a
/// scan is and however many the runs are. No number depends on it.
pub(crate) const BLOCK_RAYS: usize = 28 << 10;
/// Least returns of a block, however many the runs are.
pub(crate) const MIN_BLOCK_RETURNS: usize = 1 << 10;
/// Times of a scan whose poses are kept while it lasts: more than sensors have directions in a turn.
pub(crate) const KNOWN_TIMES: usize = 4 << 10;
/// What each of them takes by itself, in a table that is at most half full.
const KNOWN_TIME_BYTES: usize = 4 * size_of::<(i64, usize)>();
/// What a thread takes for each ray of a block: the ray, its time, its question, its answer, its residuals; and a quarter
/// for lists that grow.
const RAY_BYTES: usize =
    (size_of::<Ray>() + size_of::<i64>() + size_of::<Query>() + size_of::<Answer>() + size_of::<Residuals>())
        / 4
        * 5;
/// What it takes for each return of a scan: coordinates, a time, and the growth of their lists.
const RETURN_BYTES: usize = 32;
/// Packets of rays on their way, a tile in hand, and what it is built of.
const THREAD_BYTES: usize = 2 << 20;
/// What a pose of a run takes: a stamp, the pose, and a copy in each frame that is needed.
const POSE_BYTES: usize = 4 * (size_of::<Isometry3<f64>>() + size_of::<i64>());
/// What a scan of the log takes: its place in the index, in the plan, in jobs.
const FRAME_BYTES: usize = 256;
/// Reducers, and sums of tiles, beside those of the threads: what was kept, what is merged, and two copies to be kept.
const MERGED: usize = 4;
/// Least that the sums of a run's map need.
const LEAST_TABLE_BYTES: usize = 1 << 20;
/// What a return takes while the scans of a place are held, bytes: coordinates and a time.
const HELD_RETURN_BYTES: u64 = 20;
/// Least memory for the maps of a place beside what its thread cannot do without, bytes.
const LEAST_PLACE_BYTES: usize = 32 << 20;

/// How the memory that was asked for is shared out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Budget {
    /// What there is before anything is shared, bytes.
    fixed_bytes: usize,
    tables_bytes: usize,
}

impl Budget {
    /// The shares for a log and some runs.
    ///
    /// # Errors
    /// When the memory asked for is too little for the threads and the runs.
    pub(crate) fn new(log: &dyn ScanLog, extent: Extent, means: &Means) -> Result<Self, EvaluateError> {
        let largest_scan = log.frames().iter().map(|frame| frame.returns).max().unwrap_or(0) as usize;
        let row_bytes = log.summary().point_bytes as usize;
        let group = |frames: std::ops::Range<usize>| -> u64 {
            log.frames()[frames].iter().map(|frame| frame.returns).sum()
        };
        let in_chunks = matches!(log.summary().format, LogFormat::Mcap | LogFormat::Rosbag2Mcap);
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

    /// The memory of an evaluation in which so many bytes of tiles have room while rays are cast.
    pub(crate) fn memory_for_tiles(&self, tiles_bytes: u64) -> u64 {
        self.fixed_bytes as u64 + (tiles_bytes as f64 / CAST_SHARE) as u64
    }

    /// For the sums of each of so many maps that are fused at once, bytes.
    pub(crate) fn map_bytes(&self, maps: usize) -> usize {
        self.share(FUSE_SHARE) / maps.max(1)
    }

    /// For the tiles of all maps while rays are cast, bytes.
    pub(crate) fn cast_bytes(&self) -> usize {
        self.share(CAST_SHARE)
    }

    /// For each of so many runs while trails are looked for, bytes.
    pub(crate) fn trails(&self, runs: usize) -> TrailBytes {
        TrailBytes {
            tiles: self.share(COUNTED_TILES_SHARE) / runs,
            counts: self.share(COUNTS_SHARE) / runs,
            free_voxels: self.share(FREE_VOXELS_SHARE) / runs,
        }
    }

    fn share(&self, share: f64) -> usize {
        (share * self.tables_bytes as f64) as usize
    }
}

/// The memory of one run while trails are looked for, bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrailBytes {
    /// Tiles that rays are counted in.
    pub(crate) tiles: usize,
    /// The counts.
    pub(crate) counts: usize,
    /// The voxels found to be free.
    pub(crate) free_voxels: usize,
}

/// What threads that score places need.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaceNeeds {
    /// Most returns of the scans of a place, and of one scan, as far as is known.
    pub(crate) returns: u64,
    pub(crate) largest_scan: u64,
    /// Bytes of a point in the log.
    pub(crate) row_bytes: usize,
    /// Most scans of a place, and those of the drive.
    pub(crate) scans: usize,
    pub(crate) scans_of_drive: usize,
    /// Poses of all runs.
    pub(crate) poses: usize,
    pub(crate) place: Extent,
}

impl PlaceNeeds {
    /// As many threads as the memory allows for so many places, and the means of each.
    ///
    /// # Errors
    /// When it is too little for one.
    pub(crate) fn share(&self, means: &Means, places: usize) -> Result<(usize, Means), EvaluateError> {
        let (held_bytes, runs) = ((self.returns * HELD_RETURN_BYTES) as usize, self.place.runs);
        let largest_scan = self.largest_scan as usize;
        let thread = thread_bytes(largest_scan, largest_scan, self.row_bytes, runs);
        let least = self.place.fixed_bytes(1, thread, self.scans) + runs * LEAST_TABLE_BYTES;
        let of_place = held_bytes + least + LEAST_PLACE_BYTES;
        let of_drive = self.poses * POSE_BYTES + self.scans_of_drive * FRAME_BYTES;
        let asked = means.memory_bytes;
        if asked < of_drive + of_place {
            let needed = of_drive + of_place;
            return Err(EvaluateError::TooLittleMemory { asked, needed, threads: 1, runs });
        }
        let left = asked - of_drive;
        let threads = (left / of_place).min(means.threads).min(places).max(1);
        Ok((threads, Means { threads: 1, memory_bytes: left / threads - held_bytes, ..means.clone() }))
    }
}

impl Means {
    /// For the one map that is made of a cloud, bytes.
    pub(crate) fn cloud_map_bytes(&self) -> usize {
        (CLOUD_MAP_SHARE * self.memory_bytes as f64) as usize
    }

    /// For the tiles of a map that is put together of patches, on each thread, bytes.
    pub fn patched_tiles_bytes(&self) -> usize {
        self.memory_bytes / PATCHED_TILES_SHARE / self.threads
    }
}

impl Extent {
    /// What there is before anything is shared, bytes, where a thread needs so much.
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

/// What a thread needs.
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
