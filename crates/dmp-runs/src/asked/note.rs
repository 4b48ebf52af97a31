//! Notes during an evaluation.

use std::fmt;
use std::path::PathBuf;

use crate::asked::setting_name::SettingName;

/// A note during an evaluation.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Note {
    /// Plain text.
    Words(String),
    /// Tiles will be loaded repeatedly, since memory is too small for those in reach of the sensor: reported before any
    /// map is made.
    TilesBeyondMemory {
        /// Approximate peak bytes of the tiles in reach.
        needed_bytes: u64,
        /// Bytes available for them.
        budget_bytes: u64,
        /// Approximate memory of an evaluation with room for all of them.
        memory_bytes: u64,
    },
    /// A failed evaluation left a checkpoint.
    WorkKept {
        /// Its path.
        folder: PathBuf,
    },
}

impl Note {
    /// The message, with `name`'s names for settings.
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
