//! Paths of a suite.

use std::path::{Path, PathBuf};

use crate::named::at_home;

/// A path of the suite from the root; a topic stays as it is.
pub(super) fn resolve(folder: &Path, text: &str) -> String {
    if text.starts_with("topic:") {
        return text.to_owned();
    }
    folder.join(at_home(text.into())).display().to_string()
}

/// The file that a run is in: `Some(None)` where it is a topic of the log itself, `None` where there is none.
pub(super) fn source(run: &str) -> Option<Option<PathBuf>> {
    if run.starts_with("topic:") {
        return Some(None);
    }
    let path = Path::new(run);
    if path.exists() {
        return Some(Some(path.to_path_buf()));
    }
    let bags = run.match_indices(":/").map(|(at, _)| Path::new(&run[..at]));
    bags.into_iter().find(|bag| bag.exists()).map(|bag| Some(bag.to_path_buf()))
}
