//! LZF, as Marc Lehmann's liblzf writes it: runs of bytes as they are, and copies of what came up to 8 KiB
//! before.

use std::io::{self, Read};

use dmp_lengths::thousands;

/// A copy reaches back this far at most, bytes.
const WINDOW: usize = 8192;
/// Unpacked bytes kept before those no copy can reach are let go.
const KEPT: usize = 16 * WINDOW;
/// Three bytes, the longest instruction, make at most 264.
const MAX_GROWTH: u64 = 88;

/// Unpacks the whole of `input`, which must give exactly `expected_len` bytes.
///
/// Allocates no more than `input` can hold, whatever is expected.
pub(crate) fn decompress(input: &[u8], expected_len: u64) -> Result<Vec<u8>, String> {
    if !may_hold(input.len() as u64, expected_len) {
        return Err(format!(
            "{} compressed bytes cannot hold {}",
            thousands(input.len()),
            thousands(expected_len)
        ));
    }
    let (mut rest, mut output) = (input, Vec::with_capacity(expected_len as usize));
    while output.len() as u64 <= expected_len {
        if !step(&mut rest, &mut output).map_err(|e| e.to_string())? {
            break;
        }
    }
    match output.len() as u64 {
        found if found == expected_len => Ok(output),
        found if found > expected_len => {
            Err(format!("more than the {} bytes claimed", thousands(expected_len)))
        }
        found => Err(format!("{} bytes, {} were claimed", thousands(found), thousands(expected_len))),
    }
}

/// Whether so many compressed bytes can unpack to so many.
pub(crate) fn may_hold(compressed: u64, unpacked: u64) -> bool {
    unpacked <= compressed.saturating_mul(MAX_GROWTH)
}

/// Unpacks as it is read, in constant memory.
#[derive(Debug)]
pub(crate) struct LzfReader<R> {
    input: R,
    /// Unpacked bytes: at least the window behind `read`, and what is not read yet.
    unpacked: Vec<u8>,
    read: usize,
}

impl<R: Read> LzfReader<R> {
    pub(crate) fn new(input: R) -> Self {
        Self { input, unpacked: Vec::with_capacity(KEPT + 2 * WINDOW), read: 0 }
    }
}

impl<R: Read> Read for LzfReader<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.read == self.unpacked.len() {
            if self.unpacked.len() > KEPT {
                self.unpacked.drain(..self.unpacked.len() - WINDOW);
                self.read = self.unpacked.len();
            }
            // As much as fits: a call for each instruction would be slow.
            while self.unpacked.len() <= KEPT && step(&mut self.input, &mut self.unpacked)? {}
        }
        let waiting = self.unpacked.get(self.read..).unwrap_or_default();
        let count = waiting.len().min(out.len());
        for (to, from) in out.iter_mut().zip(waiting) {
            *to = *from;
        }
        self.read += count;
        Ok(count)
    }
}

/// Carries out one instruction at the end of `output`; `false` at the end of the input.
fn step(input: &mut impl Read, output: &mut Vec<u8>) -> io::Result<bool> {
    let mut byte = [0];
    if input.read(&mut byte)? == 0 {
        return Ok(false);
    }
    let control = usize::from(byte[0]);
    let mut next = || input.read_exact(&mut byte).map(|()| usize::from(byte[0])).map_err(cut);
    if control < 32 {
        let mut run = [0; 32];
        let run = &mut run[..=control];
        input.read_exact(run).map_err(cut)?;
        output.extend_from_slice(run);
        return Ok(true);
    }
    let length = 2 + match control >> 5 {
        7 => 7 + next()?,
        short => short,
    };
    let distance = 1 + ((control & 31) << 8) + next()?;
    let Some(start) = output.len().checked_sub(distance) else {
        let problem = format!("a copy from {distance} bytes back, {} are there", output.len());
        return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
    };
    if length <= distance {
        output.extend_from_within(start..start + length);
    } else {
        // The copy reads what it writes: a pattern repeated.
        for k in 0..length {
            output.extend_from_within(start + k..=start + k);
        }
    }
    Ok(true)
}

fn cut(error: io::Error) -> io::Error {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => {
            io::Error::new(io::ErrorKind::InvalidData, "the compressed bytes end within an instruction")
        }
        _ => error,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A packer that looks for the longest copy at every place: slow, and sure to use every instruction.
    pub(crate) fn compress(data: &[u8]) -> Vec<u8> {
        let (mut packed, mut plain, mut at) = (Vec::new(), Vec::new(), 0);
        let flush = |packed: &mut Vec<u8>, plain: &mut Vec<u8>| {
            for run in plain.chunks(32) {
                packed.push(run.len() as u8 - 1);
                packed.extend_from_slice(run);
            }
            plain.clear();
        };
        while at < data.len() {
            let matching = |start: usize| {
                (0..264.min(data.len() - at)).take_while(|k| data[start + k] == data[at + k]).count()
            };
            let best = (at.saturating_sub(WINDOW)..at).map(|s| (matching(s), s)).max();
            if let Some((length, start)) = best.filter(|best| best.0 >= 3) {
                flush(&mut packed, &mut plain);
                let (distance, short) = (at - start - 1, length - 2);
                if short < 7 {
                    packed.push((short << 5 | distance >> 8) as u8);
                } else {
                    packed.extend([(7 << 5 | distance >> 8) as u8, (short - 7) as u8]);
                }
                packed.push(distance as u8);
                at += length;
            } else {
                plain.push(data[at]);
                at += 1;
            }
        }
        flush(&mut packed, &mut plain);
        packed
    }

    fn stream(packed: &[u8]) -> io::Result<Vec<u8>> {
        let mut unpacked = Vec::new();
        LzfReader::new(packed).read_to_end(&mut unpacked).map(|_| unpacked)
    }

    /// By hand: 40 times `abc` and a full stop.
    #[test]
    fn a_pattern_is_unpacked() {
        let packed = [2, b'a', b'b', b'c', 0xe0, 108, 2, 0, b'.'];
        let expected = [b"abc".repeat(40).as_slice(), b"."].concat();
        assert_eq!(decompress(&packed, 121).unwrap(), expected);
        assert_eq!(stream(&packed).unwrap(), expected);
    }

    #[test]
    fn copies_from_the_far_end_of_the_window_survive_the_stream() {
        // Far more than the stream keeps, repeated at exactly the window's length.
        let noise: Vec<u8> =
            (0..WINDOW as u64).map(|k| (k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 56) as u8).collect();
        let data = noise.repeat(40);
        let mut packed = Vec::new();
        for run in noise.chunks(32) {
            packed.push(31);
            packed.extend_from_slice(run);
        }
        let copies = (data.len() - noise.len()) / 256;
        packed.extend([0xff, 247, 0xff].repeat(copies));
        assert_eq!(decompress(&packed, data.len() as u64).unwrap(), data);
        assert_eq!(stream(&packed).unwrap(), data);
    }

    #[test]
    fn lies_are_named() {
        let packed = compress(b"abcabcabcabc!");
        assert!(decompress(&packed, 14).unwrap_err().contains("13 bytes, 14 were claimed"));
        assert!(decompress(&packed, 12).unwrap_err().contains("more than the 12"));
        assert!(decompress(&packed, u64::MAX).unwrap_err().contains("cannot hold"));
        assert!(decompress(&packed[..3], 13).unwrap_err().contains("within an instruction"));
        assert!(decompress(&[0, b'a', 0x20, 5], 4).unwrap_err().contains("from 6 bytes back, 1 are there"));
        assert!(decompress(&[0x20], 3).unwrap_err().contains("within an instruction"));
    }

    proptest! {
        #[test]
        fn what_was_packed_is_unpacked(data in prop::collection::vec(0_u8..4, 0..600)) {
            let packed = compress(&data);
            prop_assert_eq!(decompress(&packed, data.len() as u64).unwrap(), data.clone());
            prop_assert_eq!(stream(&packed).unwrap(), data);
        }

        #[test]
        fn any_bytes_are_an_answer(packed in prop::collection::vec(any::<u8>(), 0..300), expected in 0_u64..3000) {
            let whole = decompress(&packed, expected);
            if let Ok(whole) = whole {
                prop_assert_eq!(stream(&packed).unwrap(), whole);
            }
        }
    }
}
