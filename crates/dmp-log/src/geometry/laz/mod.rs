//! Decoding LAZ: places and times of points, nothing else of them.
//!
//! The format is that of `LASzip` (Isenburg, "`LASzip`: lossless compression of LiDAR data", 2013, and the `LASzip`
//! specification). Points are compressed in chunks that can be decoded alone. Point formats up to 5 are one stream of bits, of
//! which everything must be decoded to get at anything; from 6 on each field has a stream of its own, and those that are not
//! wanted are passed over.
//!
//! Chunks of a file that is read from its first point on are decoded ahead, on the threads of whoever reads it.
//!
//! Any bytes are decoded to points or to an error: nothing recurses, nothing larger than a chunk of the file is allocated.

mod ahead;
mod chunk;
mod coder;
pub(crate) mod error;
pub(crate) mod fields;
pub(crate) mod las_bytes;
pub(crate) mod layout;
mod pointwise;
pub(crate) mod reader;
mod table;
#[cfg(test)]
mod tests;
