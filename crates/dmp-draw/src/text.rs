//! Numbers and tables for people.

use std::io::{self, Write};

use dmp::printable;

/// What stands where there is no number.
pub const NONE: &str = "–";

/// Three significant digits; whole numbers keep all of theirs, tiny ones get an exponent.
pub fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.abs().to_string();
    }
    // Rounded first: 9.996 has its third digit where 10.0 has it.
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    match rounded.abs().log10().floor() as i32 {
        ..=-4 => format!("{value:.2e}"),
        exponent @ ..=1 => format!("{rounded:.*}", (2 - exponent) as usize),
        _ => format!("{value:.0}"),
    }
}

/// A share in percent, with one decimal.
pub fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

/// How sure something is, in percent: `99 %`, `99.9962 %`; what is left of 100 % has two digits.
pub fn confidence(level: f64) -> String {
    percent_of(level, 1.0 - level)
}

/// What is left to chance where something is so sure: `1 %`, `0.25 %`.
pub fn left(level: f64) -> String {
    percent_of(1.0 - level, 1.0 - level)
}

/// In percent, as exactly as shows two digits of `smallest`; without zeros behind.
fn percent_of(share: f64, smallest: f64) -> String {
    let digits = (1.0 - libm::log10(100.0 * smallest.max(1e-14))).ceil().clamp(1.0, 13.0);
    let text = format!("{:.*}", digits as usize, 100.0 * share);
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

/// A count with commas between the thousands.
pub fn count(count: u64) -> String {
    let plain = count.to_string();
    let mut text = String::with_capacity(plain.len() + plain.len() / 3);
    for (k, digit) in plain.chars().enumerate() {
        if k > 0 && (plain.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// `one scan`, `2 scans`.
pub fn counted(number: u64, what: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{} {what}{plural}", count(number))
}

/// A number with its thousands as a prefix for the unit, for rates: `1.23 M`.
pub fn short(value: f64) -> String {
    let (factor, prefix) = match value {
        v if v >= 1e9 => (1e9, " G"),
        v if v >= 1e6 => (1e6, " M"),
        v if v >= 1e4 => (1e3, " k"),
        _ => (1.0, ""),
    };
    format!("{}{prefix}", digits(value / factor))
}

/// Bytes in binary units: `3.91 MiB`.
pub fn bytes(bytes: u64) -> String {
    let units = [("GiB", 30), ("MiB", 20), ("KiB", 10)];
    match units.into_iter().find(|&(_, shift)| bytes >> shift > 0) {
        Some((unit, shift)) => format!("{} {unit}", digits(bytes as f64 / (1_u64 << shift) as f64)),
        None => format!("{bytes} B"),
    }
}

/// A duration: `0.513 s`, `61.2 s`, `12 min 5 s`, `2 h 3 min`.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..=99 => format!("{} s", digits(seconds)),
        100..=5999 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// Nanoseconds as seconds.
pub fn seconds(ns: i64) -> f64 {
    ns as f64 / 1e9
}

/// On which side of its column a text stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// On the left.
    Left,
    /// On the right.
    Right,
}

/// Columns as wide as what is in them, two spaces apart.
#[derive(Debug)]
pub struct Table {
    sides: Vec<Side>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty one with a column for each side.
    pub fn new(sides: impl Into<Vec<Side>>) -> Self {
        Self { sides: sides.into(), rows: Vec::new() }
    }

    /// Adds a row. Names are as long as whoever gives them likes, and hold what they like: of a cell so much is shown as fits
    /// on a screen, and it stays in its line.
    pub fn row<T: Into<String>>(&mut self, cells: impl IntoIterator<Item = T>) {
        self.rows.push(cells.into_iter().map(|cell| shown(&cell.into())).collect());
    }

    /// Writes the rows, each behind `indent`. Widths count characters: right for all scripts whose
    /// characters are one column wide.
    ///
    /// # Errors
    /// When `out` cannot be written to.
    pub fn write(&self, out: &mut impl Write, indent: &str) -> io::Result<()> {
        let width_of = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.sides.len()).map(width_of).collect();
        for row in &self.rows {
            let cells =
                row.iter().zip(self.sides.iter().zip(&widths)).map(|(cell, (side, width))| match side {
                    Side::Left => format!("{cell:<width$}"),
                    Side::Right => format!("{cell:>width$}"),
                });
            let line = cells.collect::<Vec<_>>().join("  ");
            writeln!(out, "{indent}{}", line.trim_end())?;
        }
        Ok(())
    }
}

/// Most characters of a cell.
const MOST_SHOWN: usize = 200;

fn shown(cell: &str) -> String {
    match cell.char_indices().nth(MOST_SHOWN) {
        None => printable(cell).into_owned(),
        Some((end, _)) => format!("{}… ({} characters)", printable(&cell[..end]), cell.chars().count()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_are_kept_and_none_invented() {
        let cases = [
            (0.0, "0"),
            (-0.0, "0"),
            (0.000_123_4, "1.23e-4"),
            (0.001_234, "0.00123"),
            (0.0999_6, "0.100"),
            (1.0, "1.00"),
            (-1.234, "-1.23"),
            (9.996, "10.0"),
            (99.96, "100"),
            (123.4, "123"),
            (123_456.7, "123457"),
        ];
        for (value, expected) in cases {
            assert_eq!(digits(value), expected);
        }
    }

    #[test]
    fn counts_bytes_and_durations_are_readable() {
        assert_eq!([0, 12, 999, 1000, 1_234_567].map(count), ["0", "12", "999", "1,000", "1,234,567"]);
        assert_eq!([1, 2].map(|n| counted(n, "scan")), ["1 scan", "2 scans"]);
        assert_eq!([500.0, 56_780.0, 1.23e6].map(short), ["500", "56.8 k", "1.23 M"]);
        assert_eq!(
            [0, 1023, 1024, 4 << 20, 5 << 40].map(bytes),
            ["0 B", "1023 B", "1.00 KiB", "4.00 MiB", "5120 GiB"]
        );
        assert_eq!(
            [0.0123, 61.24, 725.0, 7384.0].map(duration),
            ["0.0123 s", "61.2 s", "12 min 5 s", "2 h 3 min"]
        );
    }

    #[test]
    fn what_is_left_to_chance_has_two_digits() {
        assert_eq!([0.99, 0.9975, 0.999_962_1].map(confidence), ["99 %", "99.75 %", "99.9962 %"]);
        assert_eq!([0.99, 0.9975, 0.95, 0.5].map(left), ["1 %", "0.25 %", "5 %", "50 %"]);
    }

    #[test]
    fn columns_line_up_by_characters() {
        let mut table = Table::new([Side::Left, Side::Right]);
        table.row(["größe", "1"]);
        table.row(["x", "–"]);
        table.row(["left alone", ""]);
        table.row(["a\nb", "2"]);
        let mut text = Vec::new();
        table.write(&mut text, "  ").unwrap();
        assert_eq!(
            String::from_utf8(text).unwrap(),
            "  größe       1\n  x           –\n  left alone\n  a\\u000ab    2\n"
        );
    }
}
