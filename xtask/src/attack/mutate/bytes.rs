//! Damage to bytes of which nothing is known.

use crate::trials::Random;

/// Whole numbers at which programs go wrong.
const NUMBERS: [u64; 24] = [
    0,
    1,
    2,
    3,
    7,
    0x7f,
    0x80,
    0xff,
    0x100,
    0x7fff,
    0x8000,
    0xffff,
    0x1_0000,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_fffe,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    0x8000_0000_0000_0000,
    0xffff_ffff_ffff_fff0,
    0xffff_ffff_ffff_fffe,
    0xffff_ffff_ffff_ffff,
    0x4000_0000_0000_0000,
];

const FLOATS: [f64; 18] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN_POSITIVE,
    5e-324,
    -0.0,
    1e30,
    -1e18,
    1e-30,
    16_777_217.0,
    4.3e9,
    0.0,
    30.0,
    -3e3,
    1e6,
    -1e9,
    1e13,
];

/// A number of odd size, or any.
pub(super) fn odd_number(random: &mut Random) -> u64 {
    match random.below(8) {
        0 => random.next(),
        1 => 1 << random.below(64),
        2 => random.below(300) as u64,
        _ => *random.pick(&NUMBERS),
    }
}

/// Writes a number of `width` bytes over those at `at`: odd, or near the one that is there.
pub(super) fn set_number(bytes: &mut [u8], at: usize, width: usize, is_big: bool, random: &mut Random) {
    let Some(field) = bytes.get_mut(at..at + width) else { return };
    let mut old = [0; 8];
    old[..width].copy_from_slice(field);
    if is_big {
        old[..width].reverse();
    }
    let number = match random.below(4) {
        0 => u64::from_le_bytes(old).wrapping_add(random.below(9) as u64).wrapping_sub(4),
        1 => u64::from_le_bytes(old).wrapping_mul(*random.pick(&[2, 3, 16, 256, 65_536, u64::MAX])),
        _ => odd_number(random),
    };
    field.copy_from_slice(&number.to_le_bytes()[..width]);
    if is_big {
        field.reverse();
    }
}

/// Writes an odd float over the 4 or 8 bytes at `at`.
pub(super) fn set_float(bytes: &mut [u8], at: usize, width: usize, random: &mut Random) {
    let Some(field) = bytes.get_mut(at..at + width) else { return };
    let float = *random.pick(&FLOATS);
    match width {
        4 => field.copy_from_slice(&(float as f32).to_le_bytes()),
        8 => field.copy_from_slice(&float.to_le_bytes()),
        _ => {}
    }
}

/// One damage. `other` is a file to take parts from.
pub(super) fn damage(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let length = bytes.len();
    match random.below(16) {
        0..=2 => {
            for _ in 0..=random.below(8) {
                let at = random.below(length);
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << random.below(8);
                }
            }
        }
        3 => {
            let fill = *random.pick(&[0, 0xff, 0x80, b' ', b'\n']);
            bytes[random.range(length)].fill(fill);
        }
        4 => bytes[random.range(length)].iter_mut().for_each(|byte| *byte = random.next() as u8),
        5..=7 => {
            let width = *random.pick(&[1, 2, 4, 8]);
            let at = random.below(length);
            let at = if random.once_in(2) { at } else { at / width * width };
            let is_big = random.once_in(3);
            set_number(bytes, at, width, is_big, random);
        }
        8 => {
            let width = *random.pick(&[4, 8]);
            set_float(bytes, random.below(length), width, random);
        }
        9 => drop(bytes.drain(random.range(length))),
        10 => {
            let new: Vec<u8> = (0..=random.below(64)).map(|_| random.next() as u8).collect();
            let at = random.below(length + 1);
            bytes.splice(at..at, new);
        }
        11 => {
            let again = bytes[random.range(length)].to_vec();
            let at = random.below(length + 1);
            bytes.splice(at..at, again);
        }
        12 => bytes.truncate(random.below(length + 1)),
        13 => {
            bytes.truncate(random.below(length + 1));
            bytes.extend_from_slice(&other[random.below(other.len() + 1)..]);
        }
        14 => {
            let there = other[random.range(other.len())].to_vec();
            let at = random.below(length + 1);
            let end = length.min(at + there.len());
            bytes.splice(at..end, there);
        }
        _ => swap_blocks(bytes, random),
    }
}

fn swap_blocks(bytes: &mut [u8], random: &mut Random) {
    let (first, second) = (random.range(bytes.len()), random.below(bytes.len()));
    let size = first.len().min(bytes.len() - second);
    for step in 0..size {
        bytes.swap(first.start + step, second + step);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_length_is_too_short() {
        let mut random = Random::of(&[1]);
        for length in 0..40 {
            for _ in 0..300 {
                damage(&mut vec![7; length], &[1, 2, 3], &mut random);
                damage(&mut vec![7; length], &[], &mut random);
            }
        }
    }
}
