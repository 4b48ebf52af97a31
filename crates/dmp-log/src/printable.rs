//! Foreign text that is to be printed: names of topics, files and frames come from whoever made the log.

use crate::LogError;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::{Component, Path};

/// Whether a character may be printed as it is. Control characters move a terminal's cursor, change its colours and its title,
/// and end lines; marks of direction make text look like other text (Unicode Technical Report 36, section 3).
pub fn is_printable(c: char) -> bool {
    let turns = matches!(
        c,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}'
    );
    !c.is_control() && !turns
}

/// The text with everything that is not printable as `\u001b`, as JSON writes it.
///
/// ```
/// assert_eq!(dmp_log::printable("/points"), "/points");
/// assert_eq!(dmp_log::printable("a\n::error::\u{1b}[2J\u{202e}b"), r"a\u000a::error::\u001b[2J\u202eb");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    if text.chars().all(is_printable) {
        return Cow::Borrowed(text);
    }
    let mut printed = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_printable(c) {
            printed.push(c);
        } else {
            // Writing to a string cannot fail; all that is not printable is below 2¹⁶.
            let _ = write!(printed, "\\u{:04x}", u32::from(c));
        }
    }
    Cow::Owned(printed)
}

/// A path as results say it: those from the root tell of machines and home folders, and those that lead up of what lies beside,
/// so only their last part; others as they are.
///
/// ```
/// use std::path::Path;
/// assert_eq!(dmp_log::shown_path(Path::new("logs/drive.mcap")), "logs/drive.mcap");
/// assert_eq!(dmp_log::shown_path(Path::new("/home/ada/logs/drive.mcap")), "drive.mcap");
/// assert_eq!(dmp_log::shown_path(Path::new("../ada/logs/drive.mcap")), "drive.mcap");
/// assert_eq!(dmp_log::shown_path(Path::new("/home/ada/..")), "..");
/// ```
pub fn shown_path(path: &Path) -> String {
    let leads_away = path.has_root() || path.components().any(|part| part == Component::ParentDir);
    let last = path.components().next_back().filter(|_| leads_away);
    last.map_or(path, |part| Path::new(part.as_os_str())).display().to_string()
}

impl LogError {
    /// The same with its paths as results say them: see [`shown_path`].
    #[must_use]
    pub fn as_shown(mut self) -> Self {
        if let Self::CountMismatch { other, .. } = &mut self {
            *other = shown_path(other).into();
        }
        let (Self::NotFound { path }
        | Self::Io { path, .. }
        | Self::UnknownFormat { path, .. }
        | Self::Malformed { path, .. }
        | Self::CountMismatch { path, .. }
        | Self::NoCloudTopic { path, .. }
        | Self::SeveralTopics { path, .. }
        | Self::UnknownTopic { path, .. }
        | Self::PointTime { path, .. }
        | Self::Setting { path, .. }
        | Self::MissingSetting { path, .. }
        | Self::WorldCoordinates { path, .. }
        | Self::Option { path, .. }
        | Self::Trajectory { path, .. }
        | Self::Unwritable { path, .. }) = &mut self;
        *path = shown_path(path).into();
        self
    }
}
