//! Foreign text that is to be printed: names of topics, files and frames come from whoever made the log.

use crate::LogError;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::{Component, Path};

/// Whether a character may be printed as it is. Control characters move a terminal's cursor, change its colours and its title,
/// and end lines; marks of direction make text look like other text (Unicode Technical Report 36, section 3); what shows
/// nothing makes names look the same, and hides text. Joiners and variation selectors show nothing either, but names in
/// Persian, in the scripts of India and in emoji are spelled with them.
pub fn is_printable(c: char) -> bool {
    let is_seen = match c {
        '\u{200c}' | '\u{200d}' => true,
        // Format characters and fillers (Default_Ignorable_Code_Point of Unicode 16), ends of lines and paragraphs, and numbers
        // that are no characters.
        '\u{ad}'
        | '\u{61c}'
        | '\u{115f}'..='\u{1160}'
        | '\u{17b4}'..='\u{17b5}'
        | '\u{180e}'
        | '\u{200b}'..='\u{200f}'
        | '\u{2028}'..='\u{202e}'
        | '\u{2060}'..='\u{206f}'
        | '\u{3164}'
        | '\u{fdd0}'..='\u{fdef}'
        | '\u{feff}'
        | '\u{ffa0}'
        | '\u{fff0}'..='\u{fffb}'
        | '\u{1bca0}'..='\u{1bca3}'
        | '\u{1d173}'..='\u{1d17a}'
        | '\u{e0000}'..='\u{e0fff}' => false,
        _ => u32::from(c) & 0xfffe != 0xfffe,
    };
    is_seen && !c.is_control()
}

/// The text with everything that is not printable as `\u001b`, as JSON writes it.
///
/// ```
/// assert_eq!(dmp_log::printable("/points"), "/points");
/// assert_eq!(dmp_log::printable("a\n::error::\u{1b}[2J\u{202e}b"), r"a\u000a::error::\u001b[2J\u202eb");
/// assert_eq!(dmp_log::printable("a\u{200b}\u{e0041}"), r"a\u200b\udb40\udc41");
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
            for unit in c.encode_utf16(&mut [0; 2]) {
                // Writing to a string cannot fail.
                let _ = write!(printed, "\\u{unit:04x}");
            }
        }
    }
    Cow::Owned(printed)
}

/// A path as results say it: those from the root name machines and home folders, and those that lead up of what lies beside,
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
        | Self::Unchecked { path, .. }
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
