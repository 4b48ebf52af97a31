//! The table of the runs: rank, name, how each stands to the first, and as many scores as there is room for.

use std::io::{self, Write};

use dmp::Report;
use dmp_draw::text::{self, Side, Table, shortened, width_of};
use dmp_draw::{Mood, Ranking, Standing, beside, ranking, standing};

use crate::console::{Terminal, Tone};

/// Lines of a column's head: name, truncation, unit.
const HEAD: usize = 3;
/// Between two columns.
const GAP: usize = 2;
/// Names are no shorter, however narrow a terminal is.
const NAME: usize = 12;
/// The rank of the interval among the columns of scores: see [`dmp::Column::rank`].
const INTERVAL_RANK: u8 = 3;

/// A column: what it is called, its head and its cells.
#[derive(Debug)]
struct Column {
    name: &'static str,
    side: Side,
    cells: Vec<String>,
    /// Where there is no room for all columns, the largest are not shown; `None` is always shown.
    rank: Option<u8>,
}

impl Column {
    fn new(name: &'static str, side: Side, cells: Vec<String>) -> Self {
        let cells = [name, "", ""].map(str::to_owned).into_iter().chain(cells).collect();
        Self { name, side, cells, rank: None }
    }

    fn of_score(ranking: &Ranking<'_>, k: usize) -> Self {
        let score = &ranking.columns[k];
        let cells = ranking.rows.iter().map(|row| row.cells[k].clone()).collect();
        let mut made = Self::new(score.column.name, Side::Right, cells);
        made.cells[1] = score.detail();
        score.unit().clone_into(&mut made.cells[2]);
        // The first score is always shown, and coverage before the third.
        made.rank = (k > 0).then_some(if k == 2 { score.column.rank.max(2) } else { score.column.rank });
        made
    }

    fn width(&self) -> usize {
        self.cells.iter().map(|cell| width_of(cell)).max().unwrap_or(0)
    }
}

/// The table of the runs, before it is written.
#[derive(Debug)]
pub(super) struct Ranked<'a> {
    report: &'a Report,
    terminal: Terminal,
    columns: Vec<Column>,
    standings: Vec<Standing>,
    /// Columns side by side: first those that are wanted most, then the others, with ranks and names again.
    blocks: Vec<Vec<usize>>,
    has_short_names: bool,
}

impl<'a> Ranked<'a> {
    pub(super) fn new(report: &'a Report, terminal: Terminal) -> Self {
        let ranking = ranking(report);
        let rows = || ranking.rows.iter();
        let first = report.order.first().map_or("", String::as_str);
        let standings: Vec<Standing> = rows().map(|row| standing(report, first, &row.run.name)).collect();
        let mut columns = vec![
            Column::new("", Side::Right, rows().map(|row| row.rank.clone()).collect()),
            Column::new("run", Side::Left, rows().map(|row| row.marked_name(report)).collect()),
        ];
        if standings.len() > 1 {
            let text = standings.iter().map(|standing| standing.text.clone()).collect();
            columns.push(Column::new("verdict", Side::Left, text));
            let intervals: Vec<String> = standings.iter().map(|standing| standing.interval.clone()).collect();
            if intervals.iter().any(|interval| interval != text::NONE) {
                let interval = Column::new("interval", Side::Right, intervals);
                columns.push(Column { rank: Some(INTERVAL_RANK), ..interval });
            }
        }
        for column in beside(report) {
            let mut made = Column::new(column.name, Side::Right, column.cells);
            let words = column.name.splitn(2, ' ').zip(&mut made.cells);
            words.for_each(|(word, cell)| word.clone_into(cell));
            column.unit.clone_into(&mut made.cells[2]);
            columns.push(Column { rank: Some(0), ..made });
        }
        for k in 0..ranking.columns.len() {
            let mut column = Column::of_score(&ranking, k);
            // Not two columns of that word where there is no need.
            if column.name == "revisit" && columns.iter().any(|other| other.name == "revisit error") {
                column.rank = column.rank.map(|_| u8::MAX);
            }
            columns.push(column);
        }
        let has_short_names = shorten(&mut columns, terminal.width);
        let blocks = blocks(&columns, terminal.width);
        Self { report, terminal, columns, standings, blocks, has_short_names }
    }

    /// Writes it, and with `all` also the columns for which there is no room.
    pub(super) fn write(&self, out: &mut impl Write, all: bool) -> io::Result<()> {
        for (number, block) in self.blocks.iter().take(if all { usize::MAX } else { 1 }).enumerate() {
            if number > 0 {
                writeln!(out)?;
            }
            self.block(block).iter().try_for_each(|line| writeln!(out, "{line}"))?;
        }
        for run in &self.report.left_out {
            self.terminal.tell(out, "–  ", &format!("{}  excluded", run.name))?;
        }
        if all && self.has_short_names {
            writeln!(out)?;
            for (place, name) in self.report.order.iter().enumerate() {
                self.terminal.tell(out, &format!("{}  ", place + 1), name)?;
            }
        }
        Ok(())
    }

    fn block(&self, columns: &[usize]) -> Vec<String> {
        let columns: Vec<&Column> = columns.iter().map(|&column| &self.columns[column]).collect();
        let mut table = Table::new(columns.iter().map(|column| column.side).collect::<Vec<_>>());
        for row in 0..HEAD + self.standings.len() {
            table.row(columns.iter().map(|column| column.cells[row].clone()));
        }
        table.painted(|row, column, cell| {
            let standing = row.checked_sub(HEAD).and_then(|row| self.standings.get(row));
            let tone = match columns[column].name {
                "run" => standing.filter(|standing| standing.mood == Some(Mood::Good)).map(|_| Tone::Strong),
                "verdict" => standing.and_then(|standing| standing.mood).map(tone_of),
                _ => None,
            };
            tone.map_or_else(|| cell.to_owned(), |tone| self.terminal.painted(tone, cell))
        })
    }

    /// The names of the columns that there is room for, or of all.
    pub(super) fn names(&self, all: bool) -> Vec<&'static str> {
        let shown = self.blocks.iter().take(if all { usize::MAX } else { 1 }).flatten();
        shown.map(|&column| self.columns[column].name).collect()
    }

    /// How many columns there is no room for, and whether names are cut.
    pub(super) fn hidden(&self) -> (usize, bool) {
        let columns = self.blocks.iter().skip(1).map(|block| block.len() - GIVEN).sum();
        (columns, self.has_short_names)
    }
}

/// Rank and name, which begin each block.
const GIVEN: usize = 2;

fn tone_of(mood: Mood) -> Tone {
    match mood {
        Mood::Good => Tone::Good,
        Mood::Bad => Tone::Bad,
        Mood::Open => Tone::Open,
    }
}

fn width_of_all<'a>(columns: impl Iterator<Item = &'a Column>) -> usize {
    columns.map(|column| column.width() + GAP).sum::<usize>().saturating_sub(GAP)
}

/// Shortens names so that there is room for what is never left out and for the scores that rank; whether any was too long.
fn shorten(columns: &mut [Column], width: usize) -> bool {
    let needed = width_of_all(
        columns.iter().filter(|column| column.rank.is_none_or(|rank| rank == 0) && column.name != "run"),
    );
    let room = width.saturating_sub(needed + GAP).max(NAME);
    let names = columns.iter_mut().filter(|column| column.name == "run").flat_map(|column| &mut column.cells);
    let mut has_short = false;
    for name in names {
        let short = shortened(name, room);
        has_short |= short != *name;
        *name = short;
    }
    has_short
}

/// Which columns stand side by side.
fn blocks(columns: &[Column], width: usize) -> Vec<Vec<usize>> {
    let fits = |block: &[usize]| width_of_all(block.iter().map(|&column| &columns[column])) <= width;
    let mut wanted: Vec<usize> = (0..columns.len()).collect();
    wanted.sort_by_key(|&column| columns[column].rank);
    let always = columns.iter().filter(|column| column.rank.is_none()).count();
    let count = (always..=wanted.len()).take_while(|&count| count == always || fits(&wanted[..count])).last();
    let mut rest = wanted.split_off(count.unwrap_or(always));
    wanted.sort_unstable();
    rest.sort_unstable();
    let mut blocks = vec![wanted];
    for column in rest {
        let is_first = blocks.len() == 1;
        if let Some(block) = blocks.last_mut().filter(|_| !is_first) {
            block.push(column);
            if fits(block) {
                continue;
            }
            block.pop();
        }
        blocks.push((0..GIVEN).chain([column]).collect());
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example_reports;
    use dmp::Verdict;

    fn of(report: &Report, name: &str) -> String {
        standing(report, &report.order[0], name).text
    }

    #[test]
    fn a_standing_is_a_word_and_a_length() {
        let mut report = example_reports::three_runs();
        assert_eq!(of(&report, "truth"), "undecided");
        assert_eq!(of(&report, "größe"), "undecided");
        // Mean squares of 1 and 1.254 m²: roots of 1 and 1.12 m.
        assert_eq!(of(&report, "drift"), "12.0 cm worse at 10 m");
        assert_eq!(standing(&report, "truth", "drift").interval, "9.59 to 14.3 cm");
        assert_eq!(standing(&report, "größe", "drift").text, "mixed, 10.8 cm worse at 10 m");
        report.pairs.iter_mut().for_each(|pair| pair.verdict = Verdict::Same);
        assert_eq!(of(&report, "drift"), "the same");
        report.pairs.clear();
        assert_eq!(of(&report, "drift"), "not compared");
        let many = example_reports::many_runs(3);
        assert_eq!(of(&many, "run 0"), "best");
    }

    #[test]
    fn who_stands_first_around_a_cycle_may_be_worse() {
        let mut report = example_reports::many_runs(3);
        report.order.reverse();
        assert_eq!(of(&report, "run 0"), "12.0 cm better at 10 m");
        assert_eq!(of(&report, "run 2"), "first");
    }
}
