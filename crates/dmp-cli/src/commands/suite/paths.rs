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

/// Where a run is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Source {
    /// In messages of the log itself.
    Log,
    /// In a file, a bag perhaps.
    File(PathBuf),
}

impl Source {
    /// Of a run as the command takes it; `None` where there is none.
    pub(super) fn of(run: &str) -> Option<Self> {
        if run.starts_with("topic:") {
            return Some(Self::Log);
        }
        let path = Path::new(run);
        if path.exists() {
            return Some(Self::File(path.to_path_buf()));
        }
        let mut bags = run.match_indices(":/").map(|(at, _)| Path::new(&run[..at]));
        bags.find(|bag| bag.exists()).map(|bag| Self::File(bag.to_path_buf()))
    }

    /// The file, where it is in one.
    pub(super) fn file(self) -> Option<PathBuf> {
        match self {
            Self::Log => None,
            Self::File(path) => Some(path),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_in_the_log_in_a_file_or_in_a_bag() {
        let folder = tempfile::tempdir().unwrap();
        let bag = folder.path().join("a.mcap");
        std::fs::write(&bag, "").unwrap();
        let text = bag.display().to_string();
        assert_eq!(Source::of("topic:/odom"), Some(Source::Log));
        assert_eq!(Source::of(&text), Some(Source::File(bag.clone())));
        assert_eq!(Source::of(&format!("{text}:/odom")), Some(Source::File(bag)));
        assert_eq!(Source::of(&format!("{text}.tum")), None);
        assert_eq!(resolve(Path::new("/w"), "topic:/odom"), "topic:/odom");
        assert_eq!(resolve(Path::new("/w"), "runs/a.tum"), "/w/runs/a.tum");
        assert_eq!(resolve(Path::new("/w"), "/x/a.tum"), "/x/a.tum");
    }
}
