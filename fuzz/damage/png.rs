//! Damage to the chunks of a PNG file, with checksums that are right.

use super::field::{Field, Kind};
use super::{Random, bytes, damage_parts};

const MAGIC: &[u8] = b"\x89PNG\r\n\x1a\n";
/// In the first chunk behind its type: width, height, depth, kind of colour, packing, filter, interlacing.
const HEAD: [(usize, usize); 7] = [(4, 4), (8, 4), (12, 1), (13, 1), (14, 1), (15, 1), (16, 1)];

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
    match random.below(6) {
        0..=2 => damage_parts(&mut chunks, Vec::len, random),
        3 => {
            let (at, width) = *random.pick(&HEAD);
            Field { at, width, kind: Kind::Big }.spoil(&mut chunks[0], random);
        }
        _ => {
            let one = random.below(chunks.len());
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
