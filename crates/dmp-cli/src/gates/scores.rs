//! The scores that a gate can speak of: every column, each at every truncation of drives and rooms.

use dmp::{Column, ColumnUnit, RunReport, Scales, columns_by_rank};
use dmp_draw::text::{percent, plain_digits};

/// A column, at one of its truncations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Score {
    pub(super) column: &'static Column,
    scale_m: Option<f64>,
}

impl PartialEq for Score {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Score {
    /// The columns in the order of tables, the largest truncation first.
    fn all() -> Vec<Self> {
        let of = |column: &'static Column| {
            let of_kind = |scales| column.truncations_m(scales).iter().copied();
            let mut all: Vec<f64> = of_kind(Scales::Drive).chain(of_kind(Scales::Room)).collect();
            all.sort_by(|a, b| b.total_cmp(a));
            all.dedup();
            let scales_m = if all.is_empty() { vec![None] } else { all.into_iter().map(Some).collect() };
            scales_m.into_iter().map(move |scale_m| Self { column, scale_m })
        };
        columns_by_rank().into_iter().flat_map(of).collect()
    }

    /// The score that is called so, in whatever case. A column by itself is its largest truncation.
    pub(super) fn find(name: &str) -> Option<Self> {
        let is_called = |score: &Self| {
            score.name().eq_ignore_ascii_case(name) || score.column.name.eq_ignore_ascii_case(name)
        };
        Self::all().into_iter().find(is_called)
    }

    /// As it is typed: `R_cv_0.5`.
    pub(super) fn name(&self) -> String {
        let name = self.column.name.replace(' ', "_");
        self.scale_m.map_or(name.clone(), |scale_m| format!("{name}_{scale_m}"))
    }

    /// As it is printed: `R_cv 0.5 m`, `DMP mean`.
    pub(super) fn title(&self) -> String {
        let detail = self.scale_m.map_or(self.column.detail.to_owned(), |scale_m| format!("{scale_m} m"));
        format!("{} {detail}", self.column.name).trim_end().to_owned()
    }

    /// All names.
    pub(super) fn names() -> String {
        Self::all().iter().map(Self::name).collect::<Vec<_>>().join(", ")
    }

    /// The score of a run in its unit, or why there is none.
    pub(super) fn of(&self, run: &RunReport) -> Result<f64, String> {
        let there_m = self.column.truncations_of(run);
        if let Some(scale_m) = self.scale_m.filter(|scale_m| !there_m.contains(scale_m)) {
            let there: Vec<String> = there_m.iter().map(f64::to_string).collect();
            return Err(format!("the result has none at {scale_m} m, but at {} m", there.join(", ")));
        }
        self.column.value(run, self.scale_m).ok_or_else(|| self.column.why_none(run))
    }

    /// A value of this score for a person: metres, centimetres or millimetres, as in the table.
    pub(super) fn show(&self, value: f64) -> String {
        match self.column.unit {
            ColumnUnit::Share => format!("{} %", percent(value)),
            _ => self.with_unit(value, plain_digits),
        }
    }

    /// The same with every digit.
    pub(super) fn show_exactly(&self, value: f64) -> String {
        self.with_unit(value, |value| value.to_string())
    }

    fn with_unit(&self, value: f64, digits: fn(f64) -> String) -> String {
        let (unit, factor) = self.column.shown_in(self.scale_m);
        format!("{} {unit}", digits(factor * value))
    }

    /// Its unit, as the JSON has it.
    pub(super) fn unit(&self) -> &'static str {
        match self.column.unit {
            ColumnUnit::Root => "m",
            ColumnUnit::Square => "m2",
            ColumnUnit::Share => "share",
        }
    }

    /// What no score is above.
    pub(super) fn most(&self) -> f64 {
        match self.column.unit {
            ColumnUnit::Root => self.scale_m.unwrap_or(f64::INFINITY),
            ColumnUnit::Square => f64::INFINITY,
            ColumnUnit::Share => 1.0,
        }
    }
}
