//! The lists of TUM RGB-D: which images there are, and when they were taken.

use crate::file::{is_file, lines, read_text, seconds_to_ns, shorten, stays_inside};
use crate::{LogError, ParseError, PlaceInFile};
use std::path::{Path, PathBuf};

/// The names that lists of depth images have; the first that is there counts.
pub(crate) const NAMES: [&str; 4] = ["depth.txt", "associations.txt", "associate.txt", "association.txt"];
/// Largest list that is read: ten million lines.
const MAX_BYTES: u64 = 1 << 29;

/// The list of a folder: its path, and a stamp and a path for each image, in its order. `None` where there is none.
pub(super) fn find(folder: &Path) -> Result<Option<(PathBuf, Vec<Listed>)>, LogError> {
    for path in NAMES.map(|name| folder.join(name)) {
        if !is_file(&path)? {
            continue;
        }
        let bytes = read_text(&path, "list of images", MAX_BYTES)?;
        // A text of the same name about something else is no list.
        if bytes.windows(4).any(|part| part.eq_ignore_ascii_case(b".png")) {
            let listed = parse(&bytes).map_err(|e| e.in_file(&path))?;
            return Ok(Some((path, listed)));
        }
    }
    Ok(None)
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Listed {
    pub(super) stamp_ns: i64,
    /// Relative to the list's folder.
    pub(super) path: PathBuf,
}

/// Lines of `stamp path`, or of `stamp path stamp path`, of which the pair in `depth/` counts.
pub(super) fn parse(bytes: &[u8]) -> Result<Vec<Listed>, ParseError> {
    let mut listed = Vec::new();
    for line in lines(bytes) {
        let (place, columns) = line?;
        let wrong = |problem: String| ParseError::new(place, problem);
        let (stamp, path) = match *columns.as_slice() {
            [stamp, path] => (stamp, path),
            [stamp, path, _, other] if is_depth(path) && !is_depth(other) => (stamp, path),
            [_, other, stamp, path] if is_depth(path) && !is_depth(other) => (stamp, path),
            [_, one, _, other] => {
                let (one, other) = (shorten(one), shorten(other));
                return Err(wrong(format!("one of `{one}` and `{other}` must be in depth/")));
            }
            _ => {
                let found = columns.len();
                return Err(wrong(format!(
                    "{found} columns, expected 2 (stamp path) or 4: is the line cut?"
                )));
            }
        };
        let stamp_ns = seconds_to_ns(stamp).map_err(wrong)?;
        listed.push(Listed { stamp_ns, path: relative(place, path)? });
    }
    Ok(listed)
}

fn is_depth(path: &str) -> bool {
    path.trim_start_matches("./").starts_with("depth/")
}

/// A path that stays in the folder: a list comes from elsewhere.
fn relative(place: PlaceInFile, text: &str) -> Result<PathBuf, ParseError> {
    let path = PathBuf::from(text);
    if stays_inside(&path) {
        return Ok(path);
    }
    Err(ParseError::new(place, format!("`{}` leads out of the folder of the list", shorten(text))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_read_with_two_columns_and_four() {
        let text = b"\xef\xbb\xbf# depth maps\r\n1305031102.160407 depth/1305031102.160407.png\r\n\n2\t./depth/b.png # why\n";
        let found = parse(text).unwrap();
        assert_eq!(found[0].stamp_ns, 1_305_031_102_160_407_000);
        assert_eq!(found[0].path, Path::new("depth/1305031102.160407.png"));
        assert_eq!((found.len(), found[1].stamp_ns), (2, 2_000_000_000));
        let either = |text: &[u8]| parse(text).unwrap().remove(0);
        let expected = Listed { stamp_ns: 500_000_000, path: "depth/0.png".into() };
        assert_eq!(either(b"0.5 depth/0.png 0.7 rgb/0.png"), expected);
        assert_eq!(either(b"0.7 rgb/0.png 0.5 depth/0.png"), expected);
    }

    #[test]
    fn lines_that_are_none_are_named() {
        for (text, problem) in [
            ("0 depth/0.png\n1", "line 2: 1 columns"),
            ("0 depth/0.png 3", "line 1: 3 columns"),
            ("x depth/0.png", "not a number of seconds: `x`"),
            ("1e30 depth/0.png", "another unit"),
            ("0 a/0.png 0 b/0.png", "one of `a/0.png` and `b/0.png` must"),
            ("0 depth/0.png 0 depth/1.png", "must be in depth/"),
            ("0 ../0.png", "leads out of the folder"),
            ("0 /etc/0.png", "leads out of the folder"),
        ] {
            assert!(parse(text.as_bytes()).unwrap_err().to_string().contains(problem), "{text}");
        }
    }
}
