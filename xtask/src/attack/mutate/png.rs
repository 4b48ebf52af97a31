//! Damage to the chunks of a PNG file, with checksums that are right.

use super::bytes::{self, set_number};
use crate::trials::Random;

const MAGIC: &[u8] = b"\x89PNG\r\n\x1a\n";

/// One damage; false where the file is no PNG.
pub(super) fn damage(file: &mut Vec<u8>, random: &mut Random) -> bool {
    let Some(mut rest) = file.strip_prefix(MAGIC) else { return false };
    // Type and content of every chunk.
    let mut chunks: Vec<Vec<u8>> = Vec::new();
    while let Some((&head, after)) = rest.split_first_chunk::<4>() {
        let length = u32::from_be_bytes(head) as usize;
        let (Some(chunk), Some(next)) = (after.get(..4 + length), after.get(8 + length..)) else { break };
        chunks.push(chunk.to_vec());
        rest = next;
    }
    if chunks.is_empty() {
        return false;
    }
    let (one, other) = (random.below(chunks.len()), random.below(chunks.len()));
    match random.below(6) {
        0 => drop(chunks.remove(one)),
        1 => chunks.swap(one, other),
        2 => chunks.insert(other, chunks[one].clone()),
        3 => {
            // Width, height, depth, kind of colour, packing, filter, interlacing.
            let (at, width) = *random.pick(&[(4, 4), (8, 4), (12, 1), (13, 1), (14, 1), (15, 1), (16, 1)]);
            set_number(&mut chunks[0], at, width, true, random);
        }
        _ => {
            let mut content = chunks[one].split_off(4);
            bytes::damage(&mut content, b"", random);
            chunks[one].extend(content);
        }
    }
    *file = MAGIC.to_vec();
    for chunk in chunks {
        file.extend_from_slice(&(chunk.len() as u32).wrapping_sub(4).to_be_bytes());
        file.extend_from_slice(&chunk);
        file.extend_from_slice(&crc32fast::hash(&chunk).to_be_bytes());
    }
    true
}
