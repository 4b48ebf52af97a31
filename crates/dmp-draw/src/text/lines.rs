//! Text in lines of a given width, counted in columns of a terminal.

use unicode_width::{UnicodeWidthChar as _, UnicodeWidthStr as _};

/// Characters of a unit, and of what may stand behind it.
const UNIT: usize = 4;

/// How many columns of a terminal a text takes: two for most characters of East Asia, none for accents of their own.
pub fn width_of(text: &str) -> usize {
    text.width()
}

/// A text in lines of at most `width` columns: the first behind `lead`, the others as far to the right. A word is parted only
/// where it is wider than a line; a number keeps its unit.
pub fn wrapped(text: &str, lead: &str, width: usize) -> Vec<String> {
    let indent = " ".repeat(width_of(lead));
    let (mut lines, mut line, mut is_begun) = (Vec::new(), lead.to_owned(), false);
    for word in &words(text) {
        if is_begun && width_of(&line) + 1 + width_of(word) > width {
            lines.push(std::mem::replace(&mut line, indent.clone()));
            is_begun = false;
        }
        if is_begun {
            line.push(' ');
        }
        is_begun = true;
        if width_of(&line) + width_of(word) <= width {
            line.push_str(word);
            continue;
        }
        for c in word.chars() {
            let is_full = width_of(&line) + c.width().unwrap_or(0) > width;
            if is_full && line.len() > indent.len() {
                lines.push(std::mem::replace(&mut line, indent.clone()));
            }
            line.push(c);
        }
    }
    line.truncate(line.trim_end().len());
    lines.push(line);
    lines
}

/// The words of a text, a number and the unit behind it as one.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for word in text.split(' ') {
        let is_unit = !word.starts_with(|c: char| c.is_ascii_digit()) && word.chars().count() <= UNIT;
        match words.last_mut().filter(|last| is_unit && last.ends_with(|c: char| c.is_ascii_digit())) {
            Some(number) => number.extend([" ", word]),
            None => words.push(word.to_owned()),
        }
    }
    words
}

/// A name in at most `width` columns. Of a longer one the middle is left out: names of runs differ at their ends.
pub fn shortened(name: &str, width: usize) -> String {
    if width_of(name) <= width {
        return name.to_owned();
    }
    let room = width.saturating_sub(1);
    let begin: String = within(name.chars(), room / 3).collect();
    let end: String = within(name.chars().rev(), room - width_of(&begin)).collect();
    format!("{begin}…{}", end.chars().rev().collect::<String>())
}

/// The first of some characters, as many as fit.
fn within(characters: impl Iterator<Item = char>, width: usize) -> impl Iterator<Item = char> {
    let mut taken = 0;
    characters.take_while(move |c| {
        taken += c.width().unwrap_or(0);
        taken <= width
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_fit_and_hang_below_their_lead() {
        assert_eq!(wrapped("one two three", "a  ", 10), ["a  one two", "   three"]);
        assert_eq!(wrapped("one", "", 3), ["one"]);
        assert_eq!(wrapped("", "  ", 10), [""]);
        assert_eq!(wrapped("of 12 m, or 0.5 %", "", 7), ["of", "12 m,", "or", "0.5 %"]);
        // Two columns each.
        assert_eq!(wrapped("地図 地図", "", 8), ["地図", "地図"]);
        // A word that fits in no line is parted, and its end has room for others.
        assert_eq!(wrapped("an abcdefgh i", " ", 6), [" an", " abcde", " fgh i"]);
        let long = "地".repeat(1000);
        assert!(wrapped(&long, "  ", 80).iter().all(|line| width_of(line) <= 80));
    }

    #[test]
    fn long_names_lose_their_middle() {
        assert_eq!(shortened("größe", 5), "größe");
        assert_eq!(shortened("runs/monday/kiss.tum", 10), "run…ss.tum");
        assert_eq!(width_of(&shortened("地図地図地図地図", 9)), 9);
        assert_eq!(shortened("abc", 0), "…");
    }
}
