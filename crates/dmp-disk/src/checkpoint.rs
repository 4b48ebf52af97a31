//! The bytes of a checkpoint: a header with a checksum, then the content.

const MAGIC: [u8; 8] = *b"DMPCHECK";
const VERSION: u32 = 1;
/// Magic, version, CRC-32 of what follows it, length of the content.
const HEADER_BYTES: usize = 24;

/// The header of a content.
pub(crate) fn header_of(content: &[u8]) -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    header[..8].copy_from_slice(&MAGIC);
    header[8..12].copy_from_slice(&VERSION.to_le_bytes());
    header[16..].copy_from_slice(&(content.len() as u64).to_le_bytes());
    let crc32 = checksum(&header, content);
    header[12..16].copy_from_slice(&crc32.to_le_bytes());
    header
}

/// The content behind the header.
///
/// # Errors
/// What is wrong with the bytes, where they are not those of a header and its content.
pub(crate) fn content_of(bytes: &[u8]) -> Result<&[u8], String> {
    let Some((header, content)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
        return Err(format!("{} bytes are too few for one", bytes.len()));
    };
    let word = |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    if header[..8] != MAGIC || word(8) != VERSION {
        return Err(format!("it begins with {:02x?}", &header[..12]));
    }
    let (saved, calculated) = (word(12), checksum(header, content));
    if saved != calculated || header[16..] != (content.len() as u64).to_le_bytes() {
        return Err(format!("checksum {calculated:08x}, {saved:08x} was written"));
    }
    Ok(content)
}

/// Of the checksum itself nothing, of everything else all.
fn checksum(header: &[u8; HEADER_BYTES], content: &[u8]) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    crc.update(&header[..12]);
    crc.update(&header[16..]);
    crc.update(content);
    crc.finalize()
}
