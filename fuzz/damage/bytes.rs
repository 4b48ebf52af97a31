//! Damage to bytes of which nothing is known.

use super::Random;
use super::field::{Field, Kind};

/// One damage. `other` is a file to take parts from.
pub(super) fn damage(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let length = bytes.len();
    match random.below(16) {
        0..=2 => {
            for _ in 0..=random.below(8) {
                let at = random.place(length);
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
        5..=8 => {
            let kind = *random.pick(&[Kind::Little, Kind::Little, Kind::Big, Kind::Float]);
            let width = *random.pick(if kind == Kind::Float { &[4, 8] } else { &[1, 2, 4, 8] });
            let at = random.place(length);
            let at = if random.once_in(2) { at } else { at / width * width };
            Field { at, width, kind }.spoil(bytes, random);
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
            let part = other[random.range(other.len())].to_vec();
            let at = random.below(length + 1);
            bytes.splice(at..length.min(at + part.len()), part);
        }
        _ => {
            let (first, second) = (random.range(length), random.below(length));
            for step in 0..first.len().min(length - second) {
                bytes.swap(first.start + step, second + step);
            }
        }
    }
}
