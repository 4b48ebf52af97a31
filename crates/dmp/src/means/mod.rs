//! What an evaluation has to work with: memory, threads, a folder on disk and checkpoints. No number depends on it.

mod extent;
mod memory;
pub(crate) mod peak;
mod work;

pub(crate) use extent::Extent;
pub(crate) use memory::Budget;
pub use peak::{machine_memory_bytes, peak_anonymous_bytes, peak_bytes};
pub(crate) use work::{Checkpoint, Work};
