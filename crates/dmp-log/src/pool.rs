//! The threads of whoever calls: those of the pool of rayon that the call is made in. Without one nothing here has threads.

/// Threads of the pool that this is called in; 1 where it is called in none.
pub(crate) fn threads() -> usize {
    rayon::current_thread_index().map_or(1, |_| rayon::current_num_threads())
}
