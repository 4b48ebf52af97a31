//! Depth images: PNG with 16 bits of gray.

use dmp_lengths::thousands;
use png::{Decoder, DecodingError, Limits};
use std::io::{BufRead, Read, Seek};

const SIGNATURE: &[u8; 8] = b"\x89PNG\r\n\x1a\n";
/// Signature, length and name of the first chunk, its data, its CRC.
const HEAD_BYTES: usize = 33;
/// More pixels than any depth camera has.
const MOST_PX: u64 = 1 << 24;
/// Deflate packs at most 258 bytes into two bits.
const MOST_PACKED: u64 = 1032;
/// What a decoder may take beside the image, bytes.
const DECODER_BYTES: usize = 1 << 20;
const PIXEL_BYTES: usize = 2;

/// Width and height of the image in a file of `length` bytes, by its head alone. What cannot be read as a depth
/// image is said; what is claimed is not more than the file's length allows.
pub(super) fn read_head(input: &mut impl Read, length: u64) -> std::io::Result<Result<[u32; 2], String>> {
    let mut head = Vec::with_capacity(HEAD_BYTES);
    input.take(HEAD_BYTES as u64).read_to_end(&mut head)?;
    Ok(parse_head(&head, length))
}

fn parse_head(head: &[u8], length: u64) -> Result<[u32; 2], String> {
    let start = head.get(..8).unwrap_or(head);
    if start != SIGNATURE {
        return Err(format!("no PNG: the file starts with {start:02x?}"));
    }
    let cut = || format!("the file ends at byte {}, within its head", head.len());
    let chunk: &[u8; 25] = head.get(8..HEAD_BYTES).and_then(|chunk| chunk.try_into().ok()).ok_or_else(cut)?;
    let word = |at: usize| {
        let bytes = chunk.get(at..at + 4).unwrap_or_default();
        bytes.iter().fold(0_u32, |word, byte| (word << 8) | u32::from(*byte))
    };
    if (word(0), &chunk[4..8]) != (13, b"IHDR") {
        return Err(format!("no PNG: its first chunk is {:02x?}", &chunk[..8]));
    }
    let (stored, found) = (word(21), crc32fast::hash(&chunk[4..21]));
    if stored != found {
        return Err(format!("the head has the CRC {found:08x}, not {stored:08x} as it says"));
    }
    let (size_px, bits, color) = ([word(8), word(12)], chunk[16], chunk[17]);
    if (bits, color) != (16, 0) {
        return Err(format!("{bits} bits of {}, expected 16 of gray", color_name(color)));
    }
    let [width, height] = size_px;
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > MOST_PX {
        return Err(format!("{width} x {height} pixels, expected 1 to {} in all", thousands(MOST_PX)));
    }
    if pixels * PIXEL_BYTES as u64 > length.saturating_mul(MOST_PACKED) {
        return Err(format!("{width} x {height} pixels cannot be in {} bytes", thousands(length)));
    }
    Ok(size_px)
}

fn color_name(color: u8) -> String {
    match color {
        0 => "gray".into(),
        2 => "red, green and blue".into(),
        3 => "a palette".into(),
        4 => "gray with alpha".into(),
        6 => "red, green, blue and alpha".into(),
        other => format!("color type {other}"),
    }
}

/// Reads the values of an image of `size_px`, row by row, as pairs of bytes, the larger first. What is wrong is said.
pub(super) fn read_values(
    input: impl BufRead + Seek,
    size_px: [u32; 2],
    values: &mut Vec<u8>,
) -> Result<(), DecodingProblem> {
    let bytes = size_px[0] as usize * size_px[1] as usize * PIXEL_BYTES;
    let mut decoder = Decoder::new_with_limits(input, Limits { bytes: bytes + DECODER_BYTES });
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info()?;
    let info = reader.info();
    let found = ([info.width, info.height], info.bit_depth, info.color_type);
    if found != (size_px, png::BitDepth::Sixteen, png::ColorType::Grayscale) {
        return Err(DecodingProblem::Damage("the head has changed since the file was opened".into()));
    }
    values.clear();
    values.resize(bytes, 0);
    let frame = reader.next_frame(values)?;
    if [frame.width, frame.height] != size_px {
        let [width, height] = [frame.width, frame.height];
        return Err(DecodingProblem::Damage(format!("its first picture has {width} x {height} pixels")));
    }
    // The CRC of the last data comes behind them.
    reader.finish()?;
    Ok(())
}

/// Why an image has no values.
#[derive(Debug)]
pub(super) enum DecodingProblem {
    /// The operating system refused.
    Io(std::io::Error),
    /// The bytes are wrong.
    Damage(String),
}

impl From<DecodingError> for DecodingProblem {
    fn from(error: DecodingError) -> Self {
        match error {
            DecodingError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
                Self::Damage("the file ends within the image".into())
            }
            DecodingError::IoError(error) => Self::Io(error),
            other => Self::Damage(crate::file::shorten(&other.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Cursor;

    fn head(size_px: [u32; 2], bits: u8, color: u8) -> Vec<u8> {
        let [width, height] = size_px.map(u32::to_be_bytes);
        let chunk = [&b"IHDR"[..], &width, &height, &[bits, color, 0, 0, 0]].concat();
        let crc = crc32fast::hash(&chunk).to_be_bytes();
        [&SIGNATURE[..], &13_u32.to_be_bytes(), &chunk, &crc].concat()
    }

    #[test]
    fn heads_are_read_and_not_believed() {
        let good = head([640, 480], 16, 0);
        assert_eq!(parse_head(&good, 1000), Ok([640, 480]));
        let mut flipped = good.clone();
        flipped[18] ^= 1;
        for (bytes, length, problem) in [
            (good.clone(), 595, "640 x 480 pixels cannot be in 595 bytes"),
            (good[..32].to_vec(), 32, "ends at byte 32, within its head"),
            (b"\xff\xd8\xff".to_vec(), 3, "no PNG: the file starts with [ff, d8, ff]"),
            (vec![], 0, "no PNG"),
            (flipped, 1000, "the CRC"),
            (head([640, 480], 8, 0), 1000, "8 bits of gray, expected 16 of gray"),
            (head([640, 480], 16, 2), 1000, "16 bits of red, green and blue"),
            (head([640, 480], 8, 3), 1000, "8 bits of a palette"),
            (head([640, 480], 16, 9), 1000, "16 bits of color type 9"),
            (head([0, 480], 16, 0), 1000, "0 x 480 pixels, expected 1 to"),
            (head([u32::MAX; 2], 16, 0), u64::MAX, "4294967295 x 4294967295 pixels"),
            ([&SIGNATURE[..], &[0; 25]].concat(), 1000, "its first chunk is [00"),
        ] {
            let found = parse_head(&bytes, length).unwrap_err();
            assert!(found.contains(problem), "{found}");
        }
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(
            bytes in prop::collection::vec(any::<u8>(), 0..200), at in 0..400usize, byte: u8, cut in 0..400usize,
        ) {
            let _ = parse_head(&bytes, 1000);
            let values: Vec<u16> = (0..12 * 9).map(|k| k * 601).collect();
            let mut image = crate::encode_depth_png([12, 9], &values).unwrap();
            image.truncate(cut);
            if let Some(there) = image.get_mut(at) {
                *there = byte;
            }
            let mut out = Vec::new();
            let _ = parse_head(&image, 1000);
            let _ = read_values(Cursor::new(&image), [12, 9], &mut out);
            let _ = read_values(Cursor::new([&head([12, 9], 16, 0), &bytes[..]].concat()), [12, 9], &mut out);
        }
    }
}
