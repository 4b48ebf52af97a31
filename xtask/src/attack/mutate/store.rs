//! Damage to a map of our own with checksums that are right: header, directory, footer, and what the blobs hold.

use super::bytes::{self, set_float, set_number};
use crate::trials::Random;

/// Bytes of the header, of the footer, and of a tile in the directory.
const HEADER: usize = 64;
const FOOTER: usize = 40;
const TILE: usize = 84;

/// One damage; false where the file is no map as it was made.
pub(super) fn damage(file: &mut Vec<u8>, random: &mut Random) -> bool {
    let Some(directory) = directory(file) else { return false };
    match random.below(4) {
        0 => {
            set_number(file, 8 + 4 * random.below(6), 4, false, random);
        }
        1 => {
            let footer = file.len() - FOOTER;
            set_number(file, footer + *random.pick(&[0, 8, 20]), 8, false, random);
        }
        2 => damage_directory(file, directory, random),
        _ => {
            if damage_blob(file, directory, random).is_none() {
                return false;
            }
        }
    }
    mend(file, random);
    true
}

/// Where the directory begins.
fn directory(file: &[u8]) -> Option<usize> {
    let footer = file.len().checked_sub(FOOTER).filter(|&footer| footer >= HEADER)?;
    let start = usize::try_from(u64_at(file, footer)?).ok()?;
    (start >= HEADER && start <= footer).then_some(start)
}

/// Where the tiles of the directory begin: behind the provenance and the frame.
fn tiles(file: &[u8], directory: usize) -> Option<std::ops::Range<usize>> {
    let start = directory.checked_add(4 + u32_at(file, directory)? as usize + 56)?;
    let end = file.len() - FOOTER;
    (start <= end).then_some(start..end)
}

fn damage_directory(file: &mut [u8], directory: usize, random: &mut Random) {
    let Some(tiles) = tiles(file, directory) else { return };
    match random.below(6) {
        0 => set_number(file, directory, 4, false, random),
        1 => set_float(file, tiles.start - 56 + 8 * random.below(7), 8, random),
        2 => {
            // Two tiles swapped, or one twice.
            let n = tiles.len() / TILE;
            let (one, other) = (tiles.start + TILE * random.below(n), tiles.start + TILE * random.below(n));
            if n > 0 {
                file.copy_within(one..one + TILE, other);
            }
        }
        _ => {
            let tile = tiles.start + TILE * random.below(tiles.len() / TILE);
            // The numbers of a tile, then those of its two blobs.
            let fields = [0, 4, 8, 12, 16, 20, 28, 36, 44, 48, 52, 56, 60, 68, 72, 76, 80];
            let at = *random.pick(&fields);
            let width = if [20, 28, 36, 60].contains(&at) { 8 } else { 4 };
            if [20, 28].contains(&at) {
                set_float(file, tile + at, width, random);
            } else {
                set_number(file, tile + at, width, false, random);
            }
        }
    }
}

/// Changes what a blob unpacks to. It is put behind all others, where the directory was.
fn damage_blob(file: &mut Vec<u8>, directory: usize, random: &mut Random) -> Option<()> {
    let tiles = tiles(file, directory)?;
    let n = tiles.len() / TILE;
    let entry = tiles.start + TILE * random.below(n) + *random.pick(&[36, 60]);
    let (at, length) = (u64_at(file, entry)? as usize, u32_at(file, entry + 8)? as usize);
    let blob = file.get(at..at.checked_add(length)?)?;
    if length == 0 {
        return None;
    }
    let mut plain = zstd::decode_all(blob).ok()?;
    match random.below(8) {
        0 => plain = vec![0; 1 << random.below(28)],
        1 => bytes::damage(&mut plain, blob, random),
        _ => {
            // Columns keep their lengths: codes change alone.
            for _ in 0..=random.below(4) {
                let at = random.below(plain.len());
                set_number(&mut plain, at, *random.pick(&[1, 1, 2]), false, random);
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
    let span = u64_at(file, footer).zip(u64_at(file, footer + 8));
    let span = span.and_then(|(start, length)| Some((start as usize, start.checked_add(length)? as usize)));
    if let Some(directory) = span.and_then(|(start, end)| file.get(start..end)) {
        let crc = crc32fast::hash(directory).to_le_bytes();
        file[footer + 16..footer + 20].copy_from_slice(&crc);
    }
    if !random.once_in(10) {
        let crc = crc32fast::hash(&file[footer..footer + 28]).to_le_bytes();
        file[footer + 28..footer + 32].copy_from_slice(&crc);
    }
}

fn u64_at(file: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*file.get(at..at.checked_add(8)?)?.first_chunk()?))
}

fn u32_at(file: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*file.get(at..at.checked_add(4)?)?.first_chunk()?))
}
