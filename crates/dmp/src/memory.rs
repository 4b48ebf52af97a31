use dmp_cast::{Answer, Query};
use dmp_log::{LogFormat, ScanLog};
use dmp_reduce::{FrameSums, Reducer, Residuals};
use dmp_sensor::Ray;

use crate::config::{Config, Run};
use crate::error::EvaluateError;
use crate::pose::BLOCK_RAYS;

/// What the program takes by itself, bytes.
const PROGRAM_BYTES: usize = 8 << 20;
/// What a thread takes for each ray of a block: the ray, its time, its question, its answer, its residuals; and a quarter
/// for lists that grow.
const RAY_BYTES: usize =
    (size_of::<Ray>() + size_of::<i64>() + size_of::<Query>() + size_of::<Answer>() + size_of::<Residuals>())
        / 4
        * 5;
/// What it takes for each return of a scan: coordinates, a time, and the growth of their lists.
const RETURN_BYTES: usize = 32;
/// Packets of rays on their way, and a tile in hand.
const THREAD_BYTES: usize = 1 << 20;
/// Least that the sums of a run's map need.
const LEAST_TABLE_BYTES: usize = 1 << 20;

/// How the memory that was asked for is shared out: threads need what they need, tables and tiles take the rest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Budget {
    tables_bytes: usize,
}

impl Budget {
    /// The shares for a log, runs and settings.
    ///
    /// # Errors
    /// When the memory asked for is too little for the threads.
    pub(crate) fn new(log: &dyn ScanLog, runs: &[Run], config: &Config) -> Result<Self, EvaluateError> {
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
        let thread = thread_bytes(largest_scan, largest_read, row_bytes, runs.len());
        let fixed = PROGRAM_BYTES + config.threads.saturating_mul(thread);
        let needed = fixed + runs.len() * LEAST_TABLE_BYTES;
        if config.memory_bytes < needed {
            let (asked, threads, runs) = (config.memory_bytes, config.threads, runs.len());
            return Err(EvaluateError::TooLittleMemory { asked, needed, threads, runs });
        }
        Ok(Self { tables_bytes: config.memory_bytes - fixed })
    }

    /// The least memory for one thread on scans that are held already, of so many returns at most, bytes.
    pub(crate) fn least_bytes(largest_scan: usize, row_bytes: usize, runs: usize) -> usize {
        PROGRAM_BYTES + thread_bytes(largest_scan, largest_scan, row_bytes, runs) + runs * LEAST_TABLE_BYTES
    }

    /// A share of what tables and tiles may take, bytes.
    pub(crate) fn share(&self, share: f64) -> usize {
        (share * self.tables_bytes as f64) as usize
    }
}

/// What a thread needs.
fn thread_bytes(largest_scan: usize, largest_read: usize, row_bytes: usize, runs: usize) -> usize {
    // Packed and unpacked.
    let reader = 2 * largest_read.saturating_mul(row_bytes);
    let rays = BLOCK_RAYS.min(largest_scan.saturating_mul(runs));
    let sums = FrameSums::bytes_of(runs) + Reducer::bytes_of(runs);
    reader + largest_scan.saturating_mul(RETURN_BYTES) + rays * RAY_BYTES + sums + THREAD_BYTES
}

/// Memory of this machine in bytes, where the system tells.
pub fn machine_memory_bytes() -> Option<u64> {
    kilobytes("/proc/meminfo", "MemTotal:")
}

/// Anonymous memory of this process now, bytes: what it allocated, mapped files not counted.
pub(crate) fn anonymous_bytes() -> Option<u64> {
    kilobytes("/proc/self/status", "RssAnon:")
}

fn kilobytes(file: &str, key: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kib| kib * 1024)
}

/// The largest anonymous memory seen by the evaluations of this process, bytes; `None` where the
/// system does not tell. Looked at after every few frames of every thread.
pub fn peak_anonymous_bytes() -> Option<u64> {
    let peak = PEAK.load(std::sync::atomic::Ordering::Relaxed);
    (peak > 0).then_some(peak)
}

static PEAK: std::sync::atomic::AtomicU64 = std::sync::atomic::AtomicU64::new(0);

/// Looks at the memory and remembers the largest.
pub(crate) fn look() {
    if let Some(bytes) = anonymous_bytes() {
        PEAK.fetch_max(bytes, std::sync::atomic::Ordering::Relaxed);
    }
}
