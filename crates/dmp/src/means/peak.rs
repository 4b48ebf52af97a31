//! Memory as counted by the operating system.

use std::sync::atomic::{AtomicU64, Ordering};

static PEAK: AtomicU64 = AtomicU64::new(0);

/// Memory of this machine in bytes, if the system reports it.
pub fn machine_memory_bytes() -> Option<u64> {
    kilobytes("/proc/meminfo", "MemTotal:")
}

/// The largest memory of this process so far, bytes, mapped files included; `None` if the system does not report it.
pub fn peak_bytes() -> Option<u64> {
    kilobytes("/proc/self/status", "VmHWM:")
}

/// The largest anonymous memory seen by the evaluations of this process, bytes; `None` if the system does not
/// report it. Sampled after every few frames of every thread.
pub fn peak_anonymous_bytes() -> Option<u64> {
    let peak = PEAK.load(Ordering::Relaxed);
    (peak > 0).then_some(peak)
}

/// Samples the memory that this process allocated, without mapped files, and keeps the largest.
pub(crate) fn look() {
    if let Some(bytes) = kilobytes("/proc/self/status", "RssAnon:") {
        PEAK.fetch_max(bytes, Ordering::Relaxed);
    }
}

fn kilobytes(file: &str, key: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kib| kib * 1024)
}
