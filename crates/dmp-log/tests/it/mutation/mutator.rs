use crate::common::Random;

/// What readers of text meet that are no usual numbers.
const NUMBERS: [&str; 14] = [
    "0",
    "-1",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e400",
    "1e-320",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "99999999999999999999999999999999",
    "0x10",
];
/// What lengths and counts are set to: nothing, little, much, all, and what turns over when one is added.
const EXTREMES: [u64; 9] =
    [0, 1, 0x7f, 0xffff, 0x1000_0000, 0x7fff_ffff, 0xffff_ffff, i64::MAX as u64, u64::MAX];

/// Damages a file in one to three ways, `other` being where parts of other files come from.
pub(super) fn mutate(good: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..=below(random, 3) {
        damage(&mut bytes, other, random);
    }
    bytes
}

fn below(random: &mut Random, end: usize) -> usize {
    (random.next() % end.max(1) as u64) as usize
}

/// A place in the file. Headers are short and matter most.
fn place(random: &mut Random, bytes: usize) -> usize {
    let reach = if random.next().is_multiple_of(2) { bytes.min(400) } else { bytes };
    below(random, reach)
}

fn damage(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let at = place(random, bytes.len());
    let end = (at + 1 + below(random, 8)).min(bytes.len());
    let block_end = (at + 1 + below(random, 256)).min(bytes.len());
    match random.next() % 16 {
        0 | 1 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << (random.next() % 8)),
        2 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte = random.next() as u8),
        3 => bytes[at..end].fill(0xff),
        4 => bytes[at..end].fill(0),
        5 => bytes[at..end].fill(0x80),
        6 => bytes.truncate(at),
        7 => drop(bytes.drain(at..end)),
        8 => drop(bytes.drain(at..block_end)),
        9 => drop(bytes.splice(at..at, (0..=random.next() % 16).map(|k| (k * 37) as u8))),
        10 => {
            let block = bytes[at..block_end].to_vec();
            let to = place(random, bytes.len());
            bytes.splice(to..to, block);
        }
        11 => swap_blocks(bytes, random),
        12 => {
            let from = place(random, other.len());
            bytes.truncate(at);
            bytes.extend_from_slice(&other[from..]);
        }
        13 => replace_number(bytes, at, random),
        14 => set_extreme::<4>(bytes, at, random),
        _ => set_extreme::<8>(bytes, at, random),
    }
}

/// Swaps two blocks of the same length.
fn swap_blocks(bytes: &mut [u8], random: &mut Random) {
    let length = 1 + below(random, (bytes.len() / 2).min(256));
    let (a, b) = (place(random, bytes.len()), place(random, bytes.len()));
    let (a, b) = (a.min(b), a.max(b));
    if a + length <= b && b + length <= bytes.len() {
        let (left, right) = bytes.split_at_mut(b);
        left[a..a + length].swap_with_slice(&mut right[..length]);
    }
}

/// Replaces the first number in text at or behind a place.
fn replace_number(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    let Some(start) = (at..bytes.len()).find(|&k| bytes[k].is_ascii_digit()) else { return };
    let is_part = |c: &u8| c.is_ascii_digit() || b".eE+-".contains(c);
    let length = bytes[start..].iter().take_while(|c| is_part(c)).count();
    let number = NUMBERS[below(random, NUMBERS.len())];
    bytes.splice(start..start + length, number.bytes());
}

/// Sets a whole number of `N` bytes, in either order, where such numbers mostly are.
fn set_extreme<const N: usize>(bytes: &mut [u8], at: usize, random: &mut Random) {
    let at = if random.next().is_multiple_of(2) { at & !3 } else { at };
    let mut number = EXTREMES[below(random, EXTREMES.len())].to_le_bytes();
    if random.next().is_multiple_of(4) {
        number[..N].reverse();
    }
    if let Some(field) = bytes.get_mut(at..at + N) {
        field.copy_from_slice(&number[..N]);
    }
}
