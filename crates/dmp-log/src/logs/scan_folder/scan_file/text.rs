//! Lines of numbers that become rows of points.

use crate::file::shorten;
use crate::points::{Field, NumberType, with_number};

/// How lines of numbers become rows: which column goes where.
#[derive(Debug)]
pub(crate) struct TextRows {
    /// In the order of the columns.
    columns: Vec<(usize, NumberType)>,
    row_bytes: u32,
}

impl TextRows {
    /// Rows of the fields in these columns, each a name, its column and its kind; also the fields as they lie
    /// in the rows, one behind the other.
    pub(crate) fn new(columns: &[(String, usize, NumberType)]) -> (Self, Vec<(String, Field)>) {
        let mut row_bytes = 0;
        let place = |(name, _, kind): &(String, usize, NumberType)| {
            let field = Field { offset: row_bytes as usize, kind: *kind };
            row_bytes += kind.bytes();
            (name.clone(), field)
        };
        let named = columns.iter().map(place).collect();
        let columns = columns.iter().map(|&(_, column, kind)| (column, kind)).collect();
        (Self { columns, row_bytes }, named)
    }

    pub(crate) fn row_bytes(&self) -> u32 {
        self.row_bytes
    }

    /// Appends the row of one line. What is wrong is said with its value, and nothing is appended.
    pub(crate) fn push(&self, line: &[u8], rows: &mut Vec<u8>) -> Result<(), String> {
        let before = rows.len();
        let pushed = self.push_words(line, rows);
        if pushed.is_err() {
            rows.truncate(before);
        }
        pushed
    }

    fn push_words(&self, line: &[u8], rows: &mut Vec<u8>) -> Result<(), String> {
        let text = std::str::from_utf8(line)
            .map_err(|_| format!("not text: {:02x?}", line.get(..16).unwrap_or(line)))?;
        let mut words = text.split_ascii_whitespace();
        let mut at = 0;
        for &(column, kind) in &self.columns {
            let Some(word) = words.nth(column.saturating_sub(at)) else {
                let found = text.split_ascii_whitespace().count();
                return Err(format!("{found} columns, more were declared"));
            };
            at = column + 1;
            if !push_number(kind, word, rows) {
                let (word, kind) = (shorten(word), kind.name());
                return Err(format!("`{word}` in column {at} is not a number of {kind}"));
            }
        }
        Ok(())
    }
}

/// Appends a number in bytes; `false` where the text is none of its kind.
fn push_number(kind: NumberType, text: &str, rows: &mut Vec<u8>) -> bool {
    with_number!(kind, T => text.parse::<T>().map(|value| rows.extend_from_slice(&value.to_le_bytes())).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_go_where_they_belong() {
        let column = |name: &str, column, kind| (name.to_owned(), column, kind);
        let (text, named) = TextRows::new(&[
            column("x", 0, NumberType::F64),
            column("t", 2, NumberType::U16),
            column("i", 3, NumberType::I8),
        ]);
        assert_eq!(text.row_bytes(), 11);
        assert_eq!(named.iter().map(|(_, field)| field.offset).collect::<Vec<_>>(), [0, 8, 10]);
        let mut rows = vec![7];
        text.push(b" 1.5\tskipped  300 -1 more", &mut rows).unwrap();
        assert_eq!(rows, [&[7], &1.5_f64.to_le_bytes()[..], &300_u16.to_le_bytes(), &[255]].concat());
        for (line, problem) in [
            (&b"1.5 0 x 1"[..], "`x` in column 3 is not a number of uint16"),
            (b"1.5 0 70000 1", "`70000` in column 3"),
            (b"1.5 0 3", "3 columns, more"),
            (b"", "0 columns"),
            (b"\xff 1 2 3", "not text: [ff"),
        ] {
            let error = text.push(line, &mut rows).unwrap_err();
            assert!(error.contains(problem), "{error}");
            assert_eq!(rows.len(), 12);
        }
        text.push(b"-nan 0 0 0", &mut rows).unwrap();
        assert_eq!(rows.len(), 23);
    }
}
