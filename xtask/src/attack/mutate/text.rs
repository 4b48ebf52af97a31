//! Damage to words in lines: numbers, separators, ends of lines, encodings.

use std::ops::Range;

use crate::trials::Random;

/// What stands where a number is expected.
const WORDS: [&str; 50] = [
    "nan",
    "NaN",
    "-nan",
    "inf",
    "-Infinity",
    "1e308",
    "-1e308",
    "1e400",
    "1e-400",
    "5e-324",
    "0",
    "-0",
    "-1",
    "1",
    "2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "99999999999999999999999999999999",
    "0x10",
    "1_000",
    "1,5",
    "1.",
    ".5",
    "+5",
    "--1",
    "1e",
    "e5",
    "\"",
    "true",
    "null",
    "-",
    "#",
    "1 2",
    "1.7e18",
    "9007199254740993",
    "1e3",
    "-2e4",
    "1e6",
    "-1e9",
    "1e12",
    "-1e15",
    "0.0001",
    "0.5",
    "3",
    "-7.5",
    "",
];

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

fn is_between(byte: u8) -> bool {
    byte.is_ascii_whitespace() || b",:;=[]{}()<>\"'".contains(&byte)
}

/// Every word.
fn words(text: &[u8]) -> Vec<Range<usize>> {
    let mut words = Vec::new();
    let mut start = None;
    for (at, &byte) in text.iter().enumerate() {
        match (start, is_between(byte)) {
            (None, false) => start = Some(at),
            (Some(from), true) => {
                words.push(from..at);
                start = None;
            }
            _ => {}
        }
    }
    words.extend(start.map(|from| from..text.len()));
    words
}

/// One damage.
pub(super) fn damage(text: &mut Vec<u8>, random: &mut Random) {
    match random.below(10) {
        0..=4 => damage_words(text, random),
        5..=7 => damage_lines(text, random),
        _ => damage_encoding(text, random),
    }
}

fn damage_words(text: &mut Vec<u8>, random: &mut Random) {
    let words = words(text);
    if words.is_empty() {
        return text.extend_from_slice(random.pick(&WORDS).as_bytes());
    }
    // One word, or the same place in the lines from there on.
    let word = random.pick(&words).clone();
    match random.below(8) {
        0..=3 => drop(text.splice(word, random.pick(&WORDS).bytes())),
        4 => drop(text.drain(word)),
        5 => {
            let other = text[random.pick(&words).clone()].to_vec();
            text.splice(word, other);
        }
        6 => {
            let mut number = text[word.clone()].to_vec();
            let digit = *random.pick(b"0123456789.-+eE");
            let times = *random.pick(&[1, 1, 1, 20, 400, 100_000]);
            let at = random.below(number.len() + 1);
            number.splice(at..at, vec![digit; times]);
            text.splice(word, number);
        }
        _ => {
            let at = random.below(word.len());
            text[word][at] = *random.pick(b"0123456789.-+eE#%\\/");
        }
    }
}

/// How often something may be repeated: files stay small, whatever is done to them.
fn times_of(text: &[u8]) -> usize {
    (1 << 22) / text.len().max(1)
}

fn damage_lines(text: &mut Vec<u8>, random: &mut Random) {
    let mut lines: Vec<Vec<u8>> = text.split_inclusive(|&byte| byte == b'\n').map(<[u8]>::to_vec).collect();
    if lines.is_empty() {
        return;
    }
    let (one, other) = (random.below(lines.len()), random.below(lines.len()));
    match random.below(10) {
        0 => drop(lines.remove(one)),
        1 => lines.swap(one, other),
        2 => lines.insert(other, lines[one].clone()),
        3 => {
            let times = *random.pick(&[2, 100, 5000]);
            lines.extend(vec![lines[one].clone(); times.min(times_of(&lines[one]))]);
        }
        4 => lines.reverse(),
        5 => lines.truncate(one),
        6 => drop(lines.drain(..one)),
        7 => drop(lines[one].pop()),
        8 => {
            let at = random.below(lines[one].len() + 1);
            let word = *random.pick(&[" 0", " 1 2 3", ",", ",,", "\t", "#", " nan", "\n", "\n\n\n"]);
            lines[one].splice(at..at, word.bytes());
        }
        _ => {
            // A line of no end.
            let long = lines[one].repeat(times_of(&lines[one]).min(200));
            lines[one] = long.into_iter().map(|byte| if byte == b'\n' { b' ' } else { byte }).collect();
        }
    }
    *text = lines.concat();
}

fn damage_encoding(text: &mut Vec<u8>, random: &mut Random) {
    match random.below(10) {
        0 => *text = String::from_utf8_lossy(text).replace('\n', "\r\n").into_bytes(),
        1 => *text = String::from_utf8_lossy(text).replace('\n', "\r").into_bytes(),
        2 => drop(text.splice(0..0, *b"\xef\xbb\xbf")),
        3 => {
            let wide =
                String::from_utf8_lossy(text).encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>();
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
    fn words_are_found_and_any_text_can_be_damaged() {
        assert_eq!(words(b" a,12 b"), [1..2, 3..5, 6..7]);
        let mut random = Random::of(&[2]);
        for text in ["", "\n", "1", "1 2\n3 4\n", "   "] {
            for _ in 0..500 {
                damage(&mut text.into(), &mut random);
            }
        }
    }
}
