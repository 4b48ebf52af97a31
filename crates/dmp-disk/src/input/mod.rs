//! Files that are read: their names, and what they hold.

mod content;
mod file_names;
mod input_file;

pub use content::{ContentHash, ContentMemo, FileState, NoHash};
pub use file_names::file_names;
pub use input_file::open_input;
