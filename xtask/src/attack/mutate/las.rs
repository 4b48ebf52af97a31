//! Damage to the header of a LAS or LAZ file, its records of variable length, and the table of LAZ chunks.

use super::bytes::{set_float, set_number};
use crate::trials::Random;

/// The whole numbers of the public header block, places and widths, to version 1.4.
const NUMBERS: [(usize, usize); 17] = [
    (6, 2),
    (24, 1),
    (25, 1),
    (90, 2),
    (92, 2),
    (94, 2),
    (96, 4),
    (100, 4),
    (104, 1),
    (105, 2),
    (107, 4),
    (111, 4),
    (227, 8),
    (235, 8),
    (243, 4),
    (247, 8),
    (255, 8),
];
/// Its floats: scales, offsets and extent.
const FLOATS: std::ops::Range<usize> = 131..227;

/// One damage; false where the file is too short.
pub(super) fn damage(file: &mut [u8], random: &mut Random) -> bool {
    if file.len() < 376 {
        return false;
    }
    let number = |at: usize, width: usize, file: &[u8]| {
        file[at..at + width].iter().rev().fold(0, |number, &byte| number << 8 | usize::from(byte))
    };
    let (header, points) = (number(94, 2, file), number(96, 4, file));
    match random.below(5) {
        0 | 1 => {
            let (at, width) = *random.pick(&NUMBERS);
            set_number(file, at, width, false, random);
        }
        2 => {
            let at = FLOATS.start + 8 * random.below(FLOATS.len() / 8);
            set_float(file, at, 8, random);
        }
        3 => {
            // Among the records: lengths and ids, keys of GeoTIFF, items of LASzip.
            let at = header + random.below(points.saturating_sub(header)) / 2 * 2;
            let width = *random.pick(&[1, 2, 4, 8]);
            set_number(file, at, width, false, random);
        }
        _ => {
            // Where the table of chunks is, or in it, at the end; or among the points.
            let at = match random.below(3) {
                0 => points,
                1 => file.len() - 1 - random.below(40),
                _ => points + random.below(file.len().saturating_sub(points)),
            };
            let width = *random.pick(&[1, 4, 8]);
            set_number(file, at, width, false, random);
        }
    }
    true
}
