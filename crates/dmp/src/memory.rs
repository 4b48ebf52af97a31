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
