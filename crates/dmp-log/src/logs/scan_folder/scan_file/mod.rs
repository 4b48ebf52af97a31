//! A file with one scan, of each format.

mod file;
mod format;
mod head;
mod las;
mod packed;
mod pcd;
mod ply;
mod text;

pub(crate) use file::{Cut, ScanFile};
pub(crate) use format::ScanFormat;
