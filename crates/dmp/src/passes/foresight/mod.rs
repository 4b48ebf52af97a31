//! What an evaluation will need of memory and disk, estimated from a few scans before anything is written.

mod disk;
mod in_reach;
mod sounding;

pub(crate) use disk::DiskEstimate;
