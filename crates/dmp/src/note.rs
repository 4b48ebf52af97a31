//! What is worth knowing while an evaluation goes on.

use std::fmt;
use std::path::PathBuf;

use crate::setting_name::SettingName;

/// Something worth knowing while an evaluation goes on.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Note {
    /// Words that stand for themselves.
    Words(String),
    /// Tiles will be loaded more often than once a visit, as there is too little memory for those in reach of the sensor:
    /// reported before any map is made.
    TilesBeyondMemory {
        /// Of the tiles in reach, at most, about.
        needed_bytes: u64,
        /// There is for them.
        budget_bytes: u64,
        /// The memory of an evaluation that has room for all of them, about.
        memory_bytes: u64,
    },
    /// A failed evaluation left its finished work for a resumed one.
    WorkKept {
        /// Where.
        folder: PathBuf,
    },
}

impl Note {
    /// The message, with the words that `name` has for settings.
    pub fn message_with(&self, name: &dyn Fn(SettingName) -> String) -> String {
        match self {
            Self::Words(words) => words.clone(),
            Self::TilesBeyondMemory { needed_bytes, budget_bytes, memory_bytes } => format!(
                "the tiles in reach of the sensor take about {} MiB, more than the {} MiB available: they are loaded \
                 repeatedly, which may take many times as long; {} {}MiB is enough",
                needed_bytes.div_ceil(1 << 20),
                budget_bytes >> 20,
                name(SettingName::Memory),
                memory_bytes.div_ceil(1 << 20)
            ),
            Self::WorkKept { folder } => format!(
                "finished work is kept in {}: run the same command with {} to continue",
                folder.display(),
                name(SettingName::Resume)
            ),
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message_with(&SettingName::quoted))
    }
}

impl From<String> for Note {
    fn from(words: String) -> Self {
        Self::Words(words)
    }
}
