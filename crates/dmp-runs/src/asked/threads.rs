//! Threads for work that does not read scan by scan.

use super::error::EvaluateError;

/// Runs `work` on this many threads, for example opening a log that must be decoded.
///
/// # Errors
/// When they cannot be started.
pub fn in_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> Result<R, EvaluateError> {
    Ok(pool(threads)?.install(work))
}

/// Threads for work that does not read scan by scan.
///
/// # Errors
/// When they cannot be started.
pub fn pool(threads: usize) -> Result<rayon::ThreadPool, EvaluateError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|source| EvaluateError::Threads { threads, source })
}
