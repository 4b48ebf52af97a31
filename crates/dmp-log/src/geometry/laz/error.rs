//! What goes wrong when points are decoded.

use std::io;
use std::ops::Range;
use thiserror::Error;

/// Why points could not be decoded.
#[derive(Debug, Error)]
pub(crate) enum LazError {
    /// The file could not be read.
    #[error("{0}")]
    Read(#[from] io::Error),
    /// A chunk of points makes no sense.
    #[error("chunk {chunk}, bytes {} to {}: {problem}", bytes.start, bytes.end)]
    Chunk {
        /// Its number, from 0.
        chunk: usize,
        /// Where it is in the file.
        bytes: Range<u64>,
        /// What is wrong with it.
        problem: String,
    },
}
