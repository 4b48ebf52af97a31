//! Damage to files that have a head in text and bytes behind it: PCD, PLY, npy.

use super::{bytes, text};
use crate::trials::Random;

/// Where the head ends.
fn head(file: &[u8]) -> usize {
    // npy says how long its head is.
    if file.starts_with(b"\x93NUMPY") {
        let length = file.get(8..10).map_or(0, |length| usize::from(length[0]) | usize::from(length[1]) << 8);
        return (10 + length).min(file.len());
    }
    let end = |mark: &[u8]| {
        let at = file.windows(mark.len()).position(|window| window == mark)?;
        Some(at + 1 + file[at..].iter().position(|&byte| byte == b'\n')?)
    };
    end(b"end_header").or_else(|| end(b"\nDATA ").map(|at| end_of_line(file, at))).unwrap_or(file.len())
}

/// The end of the line that begins at `at`.
fn end_of_line(file: &[u8], at: usize) -> usize {
    file[at..].iter().position(|&byte| byte == b'\n').map_or(file.len(), |length| at + length + 1)
}

/// One damage.
pub(super) fn damage(file: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let mut behind = file.split_off(head(file));
    if random.below(4) < 3 {
        text::damage(file, random);
    } else if behind.is_ascii() {
        text::damage(&mut behind, random);
    } else {
        bytes::damage(&mut behind, other, random);
    }
    file.extend(behind);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_end_where_points_begin() {
        assert_eq!(head(b"ply\nend_header\nabc"), 15);
        assert_eq!(head(b"FIELDS x\nDATA binary\nabc"), 21);
        assert_eq!(head(b"\x93NUMPY\x01\x00\x02\x00{}abc"), 12);
        assert_eq!(head(b"nothing"), 7);
    }
}
