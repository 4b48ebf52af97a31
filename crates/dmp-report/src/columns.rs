//! The columns: each score of a run, once. Tables, legends, pages, CSV files, gates, the JSON Schema and Python's tables are
//! all made from [`COLUMNS`].
//!
//! A new score is a field of [`RunReport`] (with its value, in `run.rs`), an entry here, and its line in `docs/schema.json`,
//! which a test below prints.

use dmp_reduce::{Basis, MissPrice, RunSums, Scales};

use crate::contents::Report;
use crate::run::RunReport;

/// A score of a run: a number, or one for each truncation.
#[derive(Debug)]
pub struct Column {
    /// Its name in tables.
    pub name: &'static str,
    /// What stands below the name where there is no truncation: `mean`, or nothing.
    pub detail: &'static str,
    /// Its field of a run in the JSON; its column in CSV files.
    pub field: &'static str,
    /// What it is measured in.
    pub unit: ColumnUnit,
    /// Whether more is better; otherwise less is.
    pub is_more_better: bool,
    /// Its place in tables: where there is no room for all columns, the largest ranks are not shown.
    pub rank: u8,
    /// What it is, in one sentence: see [`Self::definition`]; and in a few words.
    definition: &'static str,
    brief: &'static str,
    needs: Needs,
    value: Value,
}

/// What a column is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnUnit {
    /// Root mean squares, metres; the JSON has the squares, m².
    Root,
    /// A mean square, m².
    Square,
    /// A share of the returns, 0 to 1.
    Share,
}

/// Without what there is no such score.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Needs {
    Nothing,
    /// A map that was fused from the scans.
    FusedMap,
    /// A depth camera.
    Depth,
}

/// Where the score is found.
#[derive(Debug)]
enum Value {
    /// Squares by truncation.
    Truncated(Basis),
    /// One number, of a report and of sums.
    Single(fn(&RunReport) -> Option<f64>, fn(&RunSums) -> Option<f64>),
}

/// All columns, in the order of the JSON and of CSV files.
pub static COLUMNS: &[Column] = &[
    Column {
        name: "DMP",
        detail: "mean",
        field: "dmp_mean_m2",
        unit: ColumnUnit::Square,
        is_more_better: false,
        rank: 5,
        definition: "mean square distance to the first surface on the ray, not truncated (Zhang & Chen 2021): outliers \
                     dominate it",
        brief: "mean square distance to the first surface on the ray",
        needs: Needs::Nothing,
        value: Value::Single(|run| run.dmp_mean_m2, RunSums::dmp_mean_m2),
    },
    Column {
        name: "DMP depth",
        detail: "mean",
        field: "dmp_depth_mean_m2",
        unit: ColumnUnit::Square,
        is_more_better: false,
        rank: 6,
        definition: "DMP along the optical axis, as depth cameras measure",
        brief: "the same along the optical axis",
        needs: Needs::Depth,
        value: Value::Single(|run| run.dmp_depth_mean_m2, RunSums::dmp_depth_mean_m2),
    },
    Column {
        name: "R_cv",
        detail: "",
        field: "r_cv_m2",
        unit: ColumnUnit::Root,
        is_more_better: false,
        rank: 0,
        definition: "RMS range residual to the first surface on the ray that other parts of the {recording} measured",
        brief: "RMS range error, capped as headed, to what other scans saw",
        needs: Needs::FusedMap,
        value: Value::Truncated(Basis::CrossValidated),
    },
    Column {
        name: "R_near",
        detail: "",
        field: "r_near_m2",
        unit: ColumnUnit::Root,
        is_more_better: false,
        rank: 4,
        definition: "RMS range residual to the nearest surface on the ray, whoever measured it: sharpness alone",
        brief: "RMS range error to the nearest surface, whoever saw it",
        needs: Needs::Nothing,
        value: Value::Truncated(Basis::Near),
    },
    Column {
        name: "miss",
        detail: "",
        field: "miss_rate",
        unit: ColumnUnit::Share,
        is_more_better: false,
        rank: 7,
        definition: "share of returns whose ray meets no surface",
        brief: "share of returns whose ray meets no surface",
        needs: Needs::Nothing,
        value: Value::Single(|run| run.miss_rate, RunSums::miss_rate),
    },
    Column {
        name: "blocked",
        detail: "",
        field: "blocked_rate",
        unit: ColumnUnit::Share,
        is_more_better: false,
        rank: 8,
        definition: "share of returns whose ray meets a surface more than {blocked} too early: trails of moving objects, \
                     doubled walls",
        brief: "share of returns whose ray meets a surface {blocked} too early",
        needs: Needs::Nothing,
        value: Value::Single(|run| run.blocked_rate, RunSums::blocked_rate),
    },
    Column {
        name: "coverage",
        detail: "",
        field: "coverage",
        unit: ColumnUnit::Share,
        is_more_better: true,
        rank: 1,
        definition: "share of returns whose ray meets a surface that other parts of the {recording} measured",
        brief: "share of returns on what other scans saw, too (more is better)",
        needs: Needs::FusedMap,
        value: Value::Single(|run| run.coverage, RunSums::coverage),
    },
    Column {
        name: "revisit",
        detail: "",
        field: "coverage_revisit",
        unit: ColumnUnit::Share,
        is_more_better: true,
        rank: 2,
        definition: "share of returns whose ray meets a surface that another visit measured",
        brief: "share of returns on surfaces that another visit saw",
        needs: Needs::FusedMap,
        value: Value::Single(|run| run.coverage_revisit, RunSums::coverage_revisit),
    },
];

/// All columns, in the order of tables.
pub fn columns_by_rank() -> Vec<&'static Column> {
    let mut columns: Vec<&Column> = COLUMNS.iter().collect();
    columns.sort_by_key(|column| column.rank);
    columns
}

impl Column {
    /// What it is, with the lengths of this kind of recording; `None` speaks of all kinds.
    pub fn definition(&self, scales: Option<Scales>) -> String {
        Self::with_lengths(self.definition, scales)
    }

    /// The same in a few words.
    pub fn brief(&self, scales: Scales) -> String {
        Self::with_lengths(self.brief, Some(scales))
    }

    fn with_lengths(words: &str, scales: Option<Scales>) -> String {
        let (recording, blocked) = match scales.map(Scales::lengths) {
            Some(lengths) => (lengths.recording, format!("{} m", lengths.blocked_m)),
            None => ("recording", "0.5 m (0.05 m in a room)".to_owned()),
        };
        words.replace("{recording}", recording).replace("{blocked}", &blocked)
    }

    /// Its truncations, metres, the largest first; none where it is one number.
    pub fn truncations_m(&self, scales: Scales) -> &'static [f64] {
        match self.value {
            // The first serves the place guard alone.
            Value::Truncated(Basis::CrossValidated) => &scales.lengths().cv_m[1..],
            Value::Truncated(Basis::Near) => &scales.lengths().near_m,
            Value::Single(..) => &[],
        }
    }

    /// What a table shows of it: a truncation each, or `None` for one number. The smallest of `R_cv` is not shown, and beside
    /// `R_cv` only the smallest of `R_near`.
    pub fn shown(&self, report: &Report) -> Vec<Option<f64>> {
        let is_fused = report.is_cross_validated();
        let is_there = match self.needs {
            Needs::Nothing => true,
            Needs::FusedMap => is_fused,
            Needs::Depth => report.runs.iter().any(|run| self.value(run, None).is_some()),
        };
        let all = self.truncations_m(report.config.scales);
        let shown = match self.value {
            _ if !is_there => return Vec::new(),
            Value::Single(..) => return vec![None],
            Value::Truncated(Basis::CrossValidated) => &all[..3],
            Value::Truncated(Basis::Near) if is_fused => &all[all.len() - 1..],
            Value::Truncated(Basis::Near) => all,
        };
        shown.iter().copied().map(Some).collect()
    }

    /// The score of a run, in its [unit](ColumnUnit), at one of its truncations.
    pub fn value(&self, run: &RunReport, scale_m: Option<f64>) -> Option<f64> {
        match (&self.value, scale_m) {
            (Value::Truncated(basis), Some(scale_m)) => {
                run.scores(*basis).at(scale_m).map(|square_m2| square_m2.max(0.0).sqrt())
            }
            (Value::Truncated(_), None) => None,
            (Value::Single(of_run, _), _) => of_run(run),
        }
    }

    /// The truncations at which a run has it, metres.
    pub fn truncations_of(&self, run: &RunReport) -> Vec<f64> {
        match self.value {
            Value::Truncated(basis) => run.scores(basis).iter().map(|(scale_m, _)| scale_m).collect(),
            Value::Single(..) => Vec::new(),
        }
    }

    /// The unit in which people read it, and how many of those are one of its own: `cm` and 100 at a truncation of 0.5 m.
    pub fn shown_in(&self, scale_m: Option<f64>) -> (&'static str, f64) {
        match (self.unit, scale_m.unwrap_or(f64::INFINITY)) {
            (ColumnUnit::Share, _) => ("%", 100.0),
            (ColumnUnit::Square, _) => ("m²", 1.0),
            (ColumnUnit::Root, m) if m >= 2.0 => ("m", 1.0),
            (ColumnUnit::Root, m) if m >= 0.1 => ("cm", 100.0),
            (ColumnUnit::Root, _) => ("mm", 1000.0),
        }
    }

    /// Why a run does not have it.
    pub fn why_none(&self, run: &RunReport) -> String {
        match (&run.r_cv_withheld, &self.value) {
            (Some(why), Value::Truncated(Basis::CrossValidated)) => why.to_string(),
            _ if run.returns > 0 && run.coverage.is_none() => "the map was given".to_owned(),
            _ => "no return was scored".to_owned(),
        }
    }

    /// Names of its columns in a CSV file of the scores of some returns.
    pub fn csv_names(&self, scales: Scales) -> Vec<String> {
        match self.value {
            _ if self.needs == Needs::Depth => Vec::new(),
            Value::Single(..) => vec![self.field.to_owned()],
            Value::Truncated(_) => {
                let name = self.name.to_lowercase();
                self.truncations_m(scales).iter().map(|scale_m| format!("{name}_{scale_m}_m2")).collect()
            }
        }
    }

    /// The cells under [`Self::csv_names`]: squares, m², and shares. `None` where nothing is defined.
    pub fn csv_cells(&self, sums: &RunSums, price: MissPrice, is_fused: bool) -> Vec<Option<f64>> {
        let cells = match self.value {
            _ if self.needs == Needs::Depth => return Vec::new(),
            Value::Single(_, of_sums) => vec![of_sums(sums)],
            Value::Truncated(Basis::CrossValidated) => sums.r_cv_m2(price).map(|(_, score)| score).to_vec(),
            Value::Truncated(Basis::Near) => sums.r_near_m2().map(|(_, score)| score).to_vec(),
        };
        let is_known = is_fused || self.needs != Needs::FusedMap;
        cells.into_iter().map(|cell| cell.filter(|_| is_known)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_data::{scores, scores_json};

    /// What the JSON Schema says of a column, as a line of `docs/schema.json`.
    fn in_schema(column: &Column) -> String {
        let unit = match column.unit {
            ColumnUnit::Root => ", by truncation: squares, m²",
            ColumnUnit::Square => ", m²",
            ColumnUnit::Share => ", 0 to 1",
        };
        let description = format!("{}: {}{unit}.", column.name, column.definition(None));
        let kind = match column.value {
            Value::Truncated(_) => r##""$ref": "#/$defs/scores""##,
            Value::Single(..) => r#""type": ["number", "null"]"#,
        };
        format!(r#""{}": {{"description": "{description}", {kind}}}"#, column.field)
    }

    #[test]
    fn the_schema_and_the_report_have_every_column() {
        let schema = include_str!("../../../docs/schema.json");
        let run = &scores_json()["runs"][0];
        let report = scores();
        for column in COLUMNS {
            let line = in_schema(column);
            assert!(schema.contains(&line), "docs/schema.json needs, under $defs/run/properties:\n{line}");
            let field = run.get(column.field).unwrap_or_else(|| panic!("{} is no field", column.field));
            // It is read from that field.
            match column.truncations_m(report.config.scales) {
                [] => assert_eq!(column.value(&report.runs[0], None), field.as_f64()),
                [widest_m, ..] => {
                    let root_m = field[widest_m.to_string()].as_f64().map(f64::sqrt);
                    assert_eq!(column.value(&report.runs[0], Some(*widest_m)), root_m);
                }
            }
            assert!(column.definition(None).split(' ').count() <= 25, "{}", column.name);
        }
        let ranks: Vec<u8> = columns_by_rank().iter().map(|column| column.rank).collect();
        assert!(ranks.windows(2).all(|pair| pair[0] < pair[1]), "{ranks:?}");
    }
}
