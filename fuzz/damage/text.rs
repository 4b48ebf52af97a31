//! Damage to words in lines: numbers, separators, ends of lines, encodings; and to files with a head in text.

use std::ops::Range;

use super::field::NUMBERS;
use super::{Random, bytes, damage_parts};

/// What looks like a number and is none, or is written in another way.
const WORDS: &str = "NaN -nan -Infinity 0x10 1_000 1,5 1. .5 +5 --1 1e e5 \" true null - # 1e-400";
/// What commands a terminal, ends a line or is no UTF-8.
const ODD: [&[u8]; 14] = [
    b"\x00",
    b"\x1b[2J",
    b"\x1b]0;x\x07",
    b"\xff",
    b"\xc0\x80",
    b"\xed\xa0\x80",
    b"\r",
    b"\x0b",
    b"\x0c",
    "\u{2028}".as_bytes(),
    "\u{202e}".as_bytes(),
    "\u{feff}".as_bytes(),
    "\u{a0}".as_bytes(),
    "٣".as_bytes(),
];

/// Every word.
fn words(text: &[u8]) -> Vec<Range<usize>> {
    let is_between = |byte: &u8| byte.is_ascii_whitespace() || b",:;=[]{}()<>\"'".contains(byte);
    let mut at = 0;
    let parts = text.split(is_between).map(|word| {
        let start = at;
        at += word.len() + 1;
        start..start + word.len()
    });
    parts.filter(|word| !word.is_empty()).collect()
}

/// One damage.
pub(super) fn damage(text: &mut Vec<u8>, random: &mut Random) -> bool {
    match random.below(10) {
        0..=4 => damage_words(text, random),
        5..=7 => damage_lines(text, random),
        _ => damage_encoding(text, random),
    }
    true
}

/// One damage to a file with a head in text: more often there than behind it.
pub(super) fn damage_headed(file: &mut Vec<u8>, other: &[u8], random: &mut Random) -> bool {
    let mut behind = file.split_off(head(file));
    if random.below(4) < 3 {
        damage(file, random);
    } else if behind.is_ascii() {
        damage(&mut behind, random);
    } else {
        bytes::damage(&mut behind, other, random);
    }
    file.extend(behind);
    true
}

/// Where the head ends: npy says how long it is, PLY and PCD have a last line.
fn head(file: &[u8]) -> usize {
    if file.starts_with(b"\x93NUMPY") {
        let length = super::field::number(file, 8, 2).unwrap_or(0);
        return (10 + length).min(file.len());
    }
    let after_line = |mark: &[u8]| {
        let at = file.windows(mark.len()).position(|window| window == mark)?;
        let end = file[at + 1..].iter().position(|&byte| byte == b'\n')?;
        Some(at + 1 + end + 1)
    };
    after_line(b"end_header").or_else(|| after_line(b"\nDATA ")).unwrap_or(file.len())
}

fn damage_words(text: &mut Vec<u8>, random: &mut Random) {
    let words = words(text);
    let odd = if random.once_in(3) { WORDS } else { NUMBERS };
    if words.is_empty() {
        return text.extend_from_slice(random.word(odd).as_bytes());
    }
    let word = random.pick(&words).clone();
    match random.below(8) {
        0..=3 => drop(text.splice(word, random.word(odd).bytes())),
        4 => drop(text.drain(word)),
        5 => {
            let other = text[random.pick(&words).clone()].to_vec();
            text.splice(word, other);
        }
        6 => {
            let digit = *random.pick(b"0123456789.-+eE");
            let times = *random.pick(&[1, 1, 1, 20, 400, 100_000]);
            let at = word.start + random.below(word.len() + 1);
            text.splice(at..at, vec![digit; times]);
        }
        _ => {
            let at = random.below(word.len());
            text[word][at] = *random.pick(b"0123456789.-+eE#%\\/");
        }
    }
}

fn damage_lines(text: &mut Vec<u8>, random: &mut Random) {
    let mut lines: Vec<Vec<u8>> = text.split_inclusive(|&byte| byte == b'\n').map(<[u8]>::to_vec).collect();
    if lines.is_empty() {
        return;
    }
    let one = random.below(lines.len());
    match random.below(10) {
        0..=6 => damage_parts(&mut lines, Vec::len, random),
        7 => drop(lines[one].pop()),
        8 => {
            let at = random.below(lines[one].len() + 1);
            let word = *random.pick(&[" 0", " 1 2 3", ",", ",,", "\t", "#", " nan", "\n", "\n\n\n"]);
            lines[one].splice(at..at, word.bytes());
        }
        // A line of no end.
        _ => {
            let times = (1 << 22) / lines[one].len().max(1);
            let long = lines[one].repeat(times.min(200));
            lines[one] = long.into_iter().map(|byte| if byte == b'\n' { b' ' } else { byte }).collect();
        }
    }
    *text = lines.concat();
}

fn damage_encoding(text: &mut Vec<u8>, random: &mut Random) {
    let lossy = String::from_utf8_lossy(text);
    match random.below(10) {
        0 => *text = lossy.replace('\n', "\r\n").into_bytes(),
        1 => *text = lossy.replace('\n', "\r").into_bytes(),
        2 => drop(text.splice(0..0, *b"\xef\xbb\xbf")),
        3 => {
            let wide: Vec<u8> = lossy.encode_utf16().flat_map(u16::to_le_bytes).collect();
            *text = [&b"\xff\xfe"[..], &wide].concat();
        }
        4 => text.clear(),
        5 => text.truncate(random.below(text.len() + 1)),
        _ => {
            let at = random.below(text.len() + 1);
            text.splice(at..at, random.pick(&ODD).iter().copied());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_heads_are_found() {
        assert_eq!(words(b" a,12 b"), [1..2, 3..5, 6..7]);
        assert_eq!(head(b"ply\nend_header\nabc"), 15);
        assert_eq!(head(b"FIELDS x\nDATA binary\nabc"), 21);
        assert_eq!(head(b"\x93NUMPY\x01\x00\x02\x00{}abc"), 12);
        assert_eq!(head(b"nothing"), 7);
    }
}
