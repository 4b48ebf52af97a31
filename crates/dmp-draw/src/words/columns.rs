//! The table of the runs, the same for a terminal and a page: its columns, its rows, its cells and its legend.

use dmp_report::{Column, ColumnUnit, Report, RunReport, columns_by_rank};

use super::beside::beside;
use crate::text::{NONE, confidence, digits, percent};

/// The table of the runs.
#[derive(Debug)]
pub struct Ranking<'a> {
    /// The columns; the runs are ranked by the first, which alone has an interval: of `R_cv`, or of `R_near` where all
    /// maps were given.
    pub columns: Vec<ScoreColumn>,
    /// The runs, best first.
    pub rows: Vec<RankingRow<'a>>,
}

/// A run in the table.
#[derive(Debug)]
pub struct RankingRow<'a> {
    /// The run.
    pub run: &'a RunReport,
    /// Its rank; runs share one between which nothing is decided.
    pub rank: String,
    /// What stands in each column.
    pub cells: Vec<String>,
    /// The score of the first column, m².
    pub value_m2: Option<f64>,
    /// Its interval, m².
    pub interval_m2: Option<[f64; 2]>,
}

impl Ranking<'_> {
    /// The unit of the first column.
    pub fn unit(&self) -> &'static str {
        self.columns.first().map_or("m", ScoreColumn::unit)
    }

    /// A square, m², as the first column shows it: its root, in [`Self::unit`].
    pub fn root_of(&self, square_m2: f64) -> f64 {
        self.columns.first().map_or(1.0, |first| first.column.shown_in(first.scale_m).1)
            * square_m2.max(0.0).sqrt()
    }
}

impl RankingRow<'_> {
    /// The run's name, with a mark where its numbers need a second look.
    pub fn marked_name(&self, report: &Report) -> String {
        let mark = if report.is_doubtful(&self.run.name) { " ?" } else { "" };
        format!("{}{mark}", self.run.name)
    }
}

/// The runs of a report with their scores, as a table for people.
pub fn ranking(report: &Report) -> Ranking<'_> {
    let of = |column: &'static Column| {
        column.shown(report).into_iter().map(move |scale_m| ScoreColumn { column, scale_m })
    };
    let columns: Vec<ScoreColumn> = columns_by_rank().into_iter().flat_map(of).collect();
    let mut last = 0;
    let row = |(rank, run): (Option<usize>, _)| {
        last = rank.unwrap_or(last);
        let (value_m2, interval_m2) = RunReport::first_score(run, report.leading_basis());
        let cells = columns.iter().map(|column| column.show(run)).collect();
        RankingRow { run, rank: last.to_string(), cells, value_m2, interval_m2 }
    };
    let rows = report.ranked().map(row).collect();
    Ranking { columns, rows }
}

/// A column of the ranking.
#[derive(Debug, Clone, Copy)]
pub struct ScoreColumn {
    /// What is shown.
    pub column: &'static Column,
    /// Where it is truncated, metres; `None` for what has no truncation.
    pub scale_m: Option<f64>,
}

impl ScoreColumn {
    /// What it shows of a run.
    fn show(&self, run: &RunReport) -> String {
        let shown = |value: f64| match self.column.unit {
            ColumnUnit::Share => percent(value),
            _ => digits(self.column.shown_in(self.scale_m).1 * value),
        };
        self.column.value(run, self.scale_m).map_or_else(|| NONE.to_owned(), shown)
    }

    /// The unit of what is shown.
    pub fn unit(&self) -> &'static str {
        self.column.shown_in(self.scale_m).0
    }

    /// The second line of its head: the truncation, `mean`, or nothing.
    pub fn detail(&self) -> String {
        self.scale_m.map_or_else(|| self.column.detail.to_owned(), |scale_m| format!("{scale_m} m"))
    }

    /// Name and truncation, as `R_cv 10 m`, or name and detail.
    pub fn title(&self) -> String {
        format!("{} {}", self.column.name, self.detail()).trim_end().to_owned()
    }
}

/// A term and its meaning for each column with one of these names, and for what else stands in the table; where it
/// `is_brief`, each in a line.
pub fn legend(report: &Report, shown: &[&str], is_brief: bool) -> Vec<(&'static str, String)> {
    let scales = report.config.scales;
    let mut all = vec![("verdict", verdict_in_words(report, shown, is_brief))];
    all.extend(beside(report).into_iter().map(|column| (column.name, column.meaning.to_owned())));
    let mut columns: Vec<&Column> = ranking(report).columns.iter().map(|column| column.column).collect();
    columns.dedup_by_key(|column| column.name);
    for (place, column) in columns.into_iter().enumerate() {
        let meaning = match place {
            _ if is_brief => column.brief(scales),
            0 => format!(
                "{}; less is better. {}",
                column.definition(Some(scales)),
                truncations(report, column)
            ),
            _ => column.definition(Some(scales)),
        };
        all.push((column.name, meaning));
    }
    all.retain(|(term, _)| shown.contains(term));
    if report.order.len() > report.ranked().filter(|(rank, _)| rank.is_some()).count() {
        all.insert(
            0,
            ("rank", "shared by runs that are the same, or undecided against each other".to_owned()),
        );
    }
    if report.order.iter().any(|run| report.is_doubtful(run)) {
        all.push(("?", "the run may be misread, or that of another log: see the warnings".to_owned()));
    }
    all
}

fn verdict_in_words(report: &Report, shown: &[&str], is_brief: bool) -> String {
    let by_drift = report.pairs.iter().any(|pair| pair.verdict.is_by_drift());
    let or_drift = if by_drift { "; or drift: RMS where both come back" } else { "" };
    if is_brief {
        return format!("RMS error above the first's, capped as named, on common returns{or_drift}");
    }
    let sure = confidence(report.promise.interval_confidence);
    let interval = if shown.contains(&"interval") {
        format!("; interval: where that lies ({sure} sure)")
    } else {
        String::new()
    };
    format!(
        "how much larger the RMS residual is than that of the first run, over the returns that both maps predict, at the \
         largest truncation at which that is certain{or_drift}{interval}"
    )
}

/// What the truncations of the leading column are for, the largest first; and what a miss counts there.
fn truncations(report: &Report, column: &Column) -> String {
    let shown: Vec<f64> = column.shown(report).into_iter().flatten().collect();
    let [widest_m, .., finest_m] = shown.as_slice() else { return String::new() };
    let text = format!(
        "Residuals are truncated at the length in the head: {widest_m} m shows whether the map fits together, {finest_m} m how \
         sharp it is."
    );
    if !report.is_cross_validated() {
        return text;
    }
    let miss_m = widest_m * report.config.miss_price.sqrt();
    let decimals = if *widest_m >= 10.0 { 1 } else { 2 };
    format!(
        "{text} A ray without such a surface counts {miss_m:.decimals$} m at {widest_m} m; smaller truncations exclude it."
    )
}

/// The names of the columns of which more is better.
pub(crate) fn more_is_better() -> String {
    let names: Vec<&str> = columns_by_rank().iter().filter(|c| c.is_more_better).map(|c| c.name).collect();
    names.join(" and ")
}
