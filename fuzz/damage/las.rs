//! Damage to the header of a LAS or LAZ file, its records of variable length, and the table of LAZ chunks.

use super::Random;
use super::field::{Field, number};

/// The whole numbers of the public header block to version 1.4, places and widths.
const NUMBERS: &str =
    "6:2 24:1 25:1 90:2 92:2 94:2 96:4 100:4 104:1 105:2 107:4 111:4 227:8 235:8 243:4 247:8 255:8";
/// Its floats: scales, offsets and extent.
const FLOATS: std::ops::Range<usize> = 131..227;

/// One damage; `None` where the file is too short.
pub(super) fn damage(file: &mut [u8], random: &mut Random) -> Option<()> {
    let (header, points) = (number(file, 94, 2)?, number(file, 96, 4)?);
    file.get(..376)?;
    let field = match random.below(5) {
        0 | 1 => {
            let (at, width) = random.word(NUMBERS).split_once(':')?;
            Field::little(at.parse().ok()?, width.parse().ok()?)
        }
        2 => Field::float(FLOATS.start + 8 * random.below(FLOATS.len() / 8), 8),
        // Among the records: lengths and ids, keys of GeoTIFF, items of LASzip.
        3 => {
            let at = header + random.below(points.saturating_sub(header)) / 2 * 2;
            Field::little(at, *random.pick(&[1, 2, 4, 8]))
        }
        // Where the table of chunks is, or in it, at the end; or among the points.
        _ => {
            let among = points + random.below(file.len().saturating_sub(points));
            let at_end = file.len() - 1 - random.below(40);
            Field::little(*random.pick(&[points, at_end, among]), *random.pick(&[1, 4, 8]))
        }
    };
    field.spoil(file, random);
    Some(())
}
