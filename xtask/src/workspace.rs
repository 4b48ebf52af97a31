//! Where the files of the workspace are.

use std::path::PathBuf;

/// Its root.
pub(crate) fn root() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), ".."].iter().collect()
}
