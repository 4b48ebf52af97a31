//! Damage to a map of the format `.dmpmap` with checksums that are right: header, directory, footer, and what the blobs hold.

use super::field::{Field, number};
use super::{Random, bytes};

/// Bytes of the header, of the footer, and of a tile in the directory.
const HEADER: usize = 64;
const FOOTER: usize = 40;
const TILE: usize = 84;
/// The numbers of a tile and of its two blobs, places and widths; the floats end with `f`.
const OF_TILE: &str = "0:4 4:4 8:4 12:4 16:4 20:8f 28:8f 36:8 44:4 48:4 52:4 56:4 60:8 68:4 72:4 76:4 80:4";

/// One damage; `None` where the file is no map as it was made.
pub(super) fn damage(file: &mut Vec<u8>, random: &mut Random) -> Option<()> {
    let footer = file.len().checked_sub(FOOTER).filter(|&footer| footer >= HEADER)?;
    let directory = number(file, footer, 8).filter(|start| (HEADER..=footer).contains(start))?;
    // The tiles are behind the provenance and the frame.
    let tiles = directory.checked_add(number(file, directory, 4)?)?.checked_add(60)?;
    let count = footer.checked_sub(tiles)? / TILE;
    let tile = tiles + TILE * random.below(count);
    match random.below(8) {
        0 | 1 => Field::little(8 + 4 * random.below(6), 4).spoil(file, random),
        2 | 3 => Field::little(footer + *random.pick(&[0, 8, 20]), 8).spoil(file, random),
        4 => {
            let fields = [Field::little(directory, 4), Field::float(tiles - 56 + 8 * random.below(7), 8)];
            random.pick(&fields).spoil(file, random);
        }
        // Two tiles swapped, or one twice.
        5 if count > 0 => file.copy_within(tile..tile + TILE, tiles + TILE * random.below(count)),
        5 => return None,
        6 => {
            let (at, width) = random.word(OF_TILE).split_once(':')?;
            let (at, number) = (tile + at.parse::<usize>().ok()?, width.trim_end_matches('f').parse().ok()?);
            let field =
                if width.ends_with('f') { Field::float(at, number) } else { Field::little(at, number) };
            field.spoil(file, random);
        }
        _ => damage_blob(file, directory, tile + *random.pick(&[36, 60]), random)?,
    }
    mend(file, random);
    Some(())
}

/// Changes what a blob unpacks to. It is put behind all others, where the directory was.
fn damage_blob(file: &mut Vec<u8>, directory: usize, entry: usize, random: &mut Random) -> Option<()> {
    let (at, length) = (number(file, entry, 8)?, number(file, entry + 8, 4)?);
    let blob = file.get(at..at.checked_add(length)?).filter(|blob| !blob.is_empty())?;
    let mut plain = zstd::decode_all(blob).ok()?;
    match random.below(8) {
        0 => plain = vec![0; 1 << random.below(28)],
        1 => bytes::damage(&mut plain, blob, random),
        // Columns keep their lengths: codes change alone.
        _ => {
            for _ in 0..=random.below(4) {
                Field::little(random.below(plain.len()), *random.pick(&[1, 1, 2])).spoil(&mut plain, random);
            }
        }
    }
    let packed = zstd::encode_all(plain.as_slice(), 1).ok()?;
    let mut tail = file.split_off(directory);
    let place = file.len() as u64;
    file.extend_from_slice(&packed);
    let entry = entry - directory;
    tail[entry..entry + 8].copy_from_slice(&place.to_le_bytes());
    tail[entry + 8..entry + 12].copy_from_slice(&(packed.len() as u32).to_le_bytes());
    tail[entry + 20..entry + 24].copy_from_slice(&crc32fast::hash(&packed).to_le_bytes());
    let footer = tail.len() - FOOTER;
    tail[footer..footer + 8].copy_from_slice(&(file.len() as u64).to_le_bytes());
    file.extend_from_slice(&tail);
    Some(())
}

/// Makes the checksums right, where what they are of can be found.
fn mend(file: &mut [u8], random: &mut Random) {
    let header = crc32fast::hash(&file[..60]).to_le_bytes();
    file[60..64].copy_from_slice(&header);
    let footer = file.len() - FOOTER;
    let span = number(file, footer, 8).zip(number(file, footer + 8, 8));
    let directory = span.and_then(|(start, length)| file.get(start..start.checked_add(length)?));
    if let Some(crc) = directory.map(crc32fast::hash) {
        file[footer + 16..footer + 20].copy_from_slice(&crc.to_le_bytes());
    }
    if !random.once_in(10) {
        let crc = crc32fast::hash(&file[footer..footer + 28]).to_le_bytes();
        file[footer + 28..footer + 32].copy_from_slice(&crc);
    }
}
