//! Tables of text.

use std::io::{self, Write};

use dmp_log::printable;

use super::lines::width_of;

/// Between two columns.
const GAP: &str = "  ";
/// Most characters of a cell.
const MOST_SHOWN: usize = 200;

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

    /// Its rows as lines.
    pub fn lines(&self) -> Vec<String> {
        self.painted(|_, _, cell| cell.to_owned())
    }

    /// Its rows as lines in which each cell, of this row and column, is replaced by what takes as much room: the same in
    /// colour.
    pub fn painted(&self, paint: impl Fn(usize, usize, &str) -> String) -> Vec<String> {
        let columns: Vec<usize> = (0..self.sides.len()).collect();
        self.of_columns(&columns, &self.widths(), paint)
    }

    /// Writes the rows, each behind `indent`.
    ///
    /// # Errors
    /// When `out` cannot be written to.
    pub fn write(&self, out: &mut impl Write, indent: &str) -> io::Result<()> {
        self.lines().iter().try_for_each(|line| writeln!(out, "{indent}{line}"))
    }

    /// Writes the columns in blocks below each other, as many of them side by side as fit `width`; each block begins with the
    /// first column.
    ///
    /// # Errors
    /// When `out` cannot be written to.
    pub fn write_within(&self, out: &mut impl Write, width: usize) -> io::Result<()> {
        let widths = self.widths();
        let mut blocks: Vec<Vec<usize>> = Vec::new();
        let mut room = 0;
        for (column, needed) in widths.iter().map(|width| GAP.len() + width).enumerate().skip(1) {
            match blocks.last_mut() {
                Some(block) if needed <= room => block.push(column),
                _ => {
                    blocks.push(vec![0, column]);
                    room = width.saturating_sub(widths[0]);
                }
            }
            room = room.saturating_sub(needed);
        }
        for (number, block) in blocks.iter().enumerate() {
            if number > 0 {
                writeln!(out)?;
            }
            let lines = self.of_columns(block, &widths, |_, _, cell| cell.to_owned());
            lines.iter().try_for_each(|line| writeln!(out, "{line}"))?;
        }
        Ok(())
    }

    fn widths(&self) -> Vec<usize> {
        let width_of_column = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| width_of(cell)).max().unwrap_or(0)
        };
        (0..self.sides.len()).map(width_of_column).collect()
    }

    /// The rows as lines of some columns.
    fn of_columns(
        &self,
        columns: &[usize],
        widths: &[usize],
        paint: impl Fn(usize, usize, &str) -> String,
    ) -> Vec<String> {
        let line = |(number, row): (usize, &Vec<String>)| {
            let cells = columns.iter().filter_map(|&column| Some((column, row.get(column)?)));
            let cells = cells.map(|(column, cell)| {
                let blanks = " ".repeat(widths[column].saturating_sub(width_of(cell)));
                let cell = paint(number, column, cell);
                match self.sides[column] {
                    Side::Left => cell + &blanks,
                    Side::Right => blanks + &cell,
                }
            });
            cells.collect::<Vec<_>>().join(GAP).trim_end().to_owned()
        };
        self.rows.iter().enumerate().map(line).collect()
    }
}

fn shown(cell: &str) -> String {
    match cell.char_indices().nth(MOST_SHOWN) {
        None => printable(cell).into_owned(),
        Some((end, _)) => format!("{}… ({} characters)", printable(&cell[..end]), cell.chars().count()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new([Side::Left, Side::Right, Side::Right]);
        table.row(["größe", "1", "-1"]);
        table.row(["x", "–", "-2"]);
        table.row(["left alone", "", ""]);
        table.row(["a\nb", "2"]);
        table.row(["地図", "3"]);
        table
    }

    #[test]
    fn columns_line_up() {
        let mut text = Vec::new();
        table().write(&mut text, "  ").unwrap();
        let expected =
            "  größe       1  -1\n  x           –  -2\n  left alone\n  a\\u000ab    2\n  地図        3\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
    }

    #[test]
    fn colour_takes_no_room() {
        let painted = table().painted(|row, column, cell| match (row, column) {
            (0, 0) => format!("<b>{cell}</b>"),
            _ => cell.to_owned(),
        });
        assert_eq!(painted[0], "<b>größe</b>       1  -1");
        assert_eq!(painted[1..], table().lines()[1..]);
    }

    #[test]
    fn what_is_too_wide_is_in_blocks() {
        let mut text = Vec::new();
        table().write_within(&mut text, 13).unwrap();
        let text = String::from_utf8(text).unwrap();
        let blocks: Vec<&str> = text.split("\n\n").collect();
        assert!(blocks.len() == 2 && blocks[1].starts_with("größe       -1\nx           -2\n"), "{text}");
    }
}
