//! The table of the runs, the same for a terminal and a page: its columns, its rows and what stands in them.

use dmp::{Report, RunReport};

use crate::text::{NONE, digits, percent};

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
    /// Its rank, or `=` where it shares that of the run above.
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
        self.columns.first().map_or("m", |column| column.unit)
    }

    /// A square, m², as the first column shows it: its root, in [`Self::unit`].
    pub fn root_of(&self, square_m2: f64) -> f64 {
        let per_metre = match self.unit() {
            "mm" => 1000.0,
            "cm" => 100.0,
            _ => 1.0,
        };
        per_metre * square_m2.max(0.0).sqrt()
    }
}

impl RankingRow<'_> {
    /// Whether its rank is not that of the run above.
    pub fn has_a_rank_of_its_own(&self) -> bool {
        self.rank != SHARED
    }
}

/// What stands for the rank of the run above.
const SHARED: &str = "=";

/// The runs of a report with their scores, as a table for people.
pub fn ranking(report: &Report) -> Ranking<'_> {
    let columns = columns(report);
    let row = |(rank, run): (Option<usize>, _)| {
        let (value_m2, interval_m2) = RunReport::first_score(run, report.leading_basis());
        let rank = rank.map_or_else(|| SHARED.to_owned(), |rank| rank.to_string());
        let cells = columns.iter().map(|column| column.show(run)).collect();
        RankingRow { run, rank, cells, value_m2, interval_m2 }
    };
    let rows = report.ranked().map(row).collect();
    Ranking { columns, rows }
}

/// A column of the ranking.
#[derive(Debug, Clone, Copy)]
pub struct ScoreColumn {
    /// What is shown, as `R_cv`.
    pub name: &'static str,
    /// Where it is cut off, metres; `None` for what has no truncation.
    pub scale_m: Option<f64>,
    /// The second line of its head where there is no truncation: `mean`, or nothing.
    pub detail: &'static str,
    /// The unit of what is shown.
    pub unit: &'static str,
    value: fn(&RunReport, usize) -> Option<f64>,
    /// The truncation it stands for, from the largest.
    index: usize,
    show: fn(f64) -> String,
}

impl ScoreColumn {
    /// What it shows of a run.
    fn show(&self, run: &RunReport) -> String {
        (self.value)(run, self.index).map_or_else(|| NONE.to_owned(), self.show)
    }

    /// Name and truncation, as `R_cv 10 m`, or name and detail.
    pub fn title(&self) -> String {
        let second = self.scale_m.map_or_else(|| self.detail.to_owned(), |scale_m| format!("{scale_m} m"));
        format!("{} {second}", self.name).trim_end().to_owned()
    }

    /// A root mean square that is cut off, in a unit in which it has few digits.
    fn root(
        name: &'static str,
        value: fn(&RunReport, usize) -> Option<f64>,
        index: usize,
        scales_m: &[f64],
    ) -> Option<Self> {
        let scale_m = *scales_m.get(index)?;
        let (unit, show): (_, fn(f64) -> String) = match scale_m {
            m if m >= 2.0 => ("m", |square_m2| digits(square_m2.sqrt())),
            m if m >= 0.1 => ("cm", |square_m2| digits(100.0 * square_m2.sqrt())),
            _ => ("mm", |square_m2| digits(1000.0 * square_m2.sqrt())),
        };
        Some(Self { name, scale_m: Some(scale_m), detail: "", unit, value, index, show })
    }

    const fn share(name: &'static str, value: fn(&RunReport, usize) -> Option<f64>) -> Self {
        Self { name, scale_m: None, detail: "", unit: "%", value, index: 0, show: percent }
    }
}

const fn mean(name: &'static str, value: fn(&RunReport, usize) -> Option<f64>) -> ScoreColumn {
    ScoreColumn { name, scale_m: None, detail: "mean", unit: "m²", value, index: 0, show: digits }
}

/// The columns that a report's runs are ranked beside, the one that ranks first: of `R_cv`, or of `R_near` where all
/// maps were given.
fn columns(report: &Report) -> Vec<ScoreColumn> {
    let scales = report.config.scales;
    let near_m: &[f64] = &scales.lengths().near_m;
    let near = |index| ScoreColumn::root("R_near", |run, k| run.r_near_m2[k], index, near_m);
    let cross_validated = report.is_cross_validated();
    let mut columns: Vec<ScoreColumn> = if cross_validated {
        // The first of the truncations serves the place guard alone.
        let cv =
            |index| ScoreColumn::root("R_cv", |run, k| run.r_cv_m2[k], index, &scales.lengths().cv_m[1..]);
        [cv(0), cv(1), cv(2), near(near_m.len() - 1)].into_iter().flatten().collect()
    } else {
        (0..near_m.len()).filter_map(near).collect()
    };
    columns.push(mean("DMP", |run, _| run.dmp_mean_m2));
    if report.runs.iter().any(|run| run.dmp_depth_mean_m2.is_some()) {
        columns.push(mean("DMP depth", |run, _| run.dmp_depth_mean_m2));
    }
    if cross_validated {
        columns.push(ScoreColumn::share("coverage", |run, _| run.coverage));
        columns.push(ScoreColumn::share("revisit", |run, _| run.coverage_revisit));
    }
    columns.push(ScoreColumn::share("miss", |run, _| run.miss_rate));
    columns.push(ScoreColumn::share("blocked", |run, _| run.blocked_rate));
    columns
}
