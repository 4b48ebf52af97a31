//! Work on long arrays, piece by piece on several threads.
//!
//! Threads live for one call only. A forked process has none of its parent's threads: waiting for a kept pool, as rayon
//! keeps one, would never end.

use std::sync::{Mutex, PoisonError};
use std::thread;

use dmp_map::MapError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::{failed, input};

/// Rays per chunk of a thread.
pub(crate) const CHUNK: usize = 1 << 13;
/// Chunks between two checks for interrupts.
const BLOCK_CHUNKS: usize = 1 << 7;

/// Works through the chunks of so many rays; each thread takes the next one when it is done with one. `threads` defaults to the
/// number of cores.
pub(crate) fn in_chunks<C: Send, B: Default>(
    py: Python<'_>,
    (threads, rays): (Option<usize>, usize),
    mut chunks: impl Iterator<Item = C>,
    work: impl Fn(C, &mut B) -> Result<(), MapError> + Sync,
) -> PyResult<()> {
    let pool = pool(threads, rays).map_err(|error| failed(py, &format_args!("no threads: {error}")))?;
    loop {
        // Interrupts are checked between blocks.
        let block: Vec<C> = chunks.by_ref().take(BLOCK_CHUNKS).collect();
        if block.is_empty() {
            return Ok(());
        }
        let block = Mutex::new(block.into_iter());
        let next = || block.lock().unwrap_or_else(PoisonError::into_inner).next();
        let run = || {
            let mut buffers = B::default();
            std::iter::from_fn(next).try_for_each(|chunk| work(chunk, &mut buffers))
        };
        let done = py.detach(|| match &pool {
            Some(pool) => pool.broadcast(|_| run()).into_iter().collect(),
            None => run(),
        });
        done.map_err(|error| input(py, &error))?;
        py.check_signals()?;
    }
}

/// Threads for this many rays; `None` if the calling thread suffices.
fn pool(threads: Option<usize>, rays: usize) -> Result<Option<ThreadPool>, rayon::ThreadPoolBuildError> {
    let most = threads.or_else(|| thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    match most.min(rays.div_ceil(CHUNK)) {
        0 | 1 => Ok(None),
        threads => ThreadPoolBuilder::new().num_threads(threads).build().map(Some),
    }
}
