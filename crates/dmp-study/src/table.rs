//! What is known of every run, and how alike two columns rank the runs.

use dmp_truth::rank::{kendall_tau_b, spearman_rho};
use serde::Serialize;

/// One quantity of every run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    /// Its name in the JSON, with its unit.
    pub key: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// `m`, `m²`, `nats`; empty for shares.
    pub unit: &'static str,
    /// Whether a lower value speaks for the run.
    pub lower_is_better: bool,
    /// One for each run; null where it cannot be given.
    pub values: Vec<Option<f64>>,
}

/// Every quantity of every run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudyTable {
    /// Names of the runs, in the order given.
    pub runs: Vec<String>,
    /// The columns.
    pub columns: Vec<Column>,
}

/// How alike two columns rank the runs that have both.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Correlation {
    /// Key of one column.
    pub a: &'static str,
    /// Key of the other.
    pub b: &'static str,
    /// Runs that have both.
    pub runs: usize,
    /// Kendall's τ-b: 1 where both rise together, −1 where one falls as the other rises.
    pub kendall_tau_b: Option<f64>,
    /// Spearman's ρ.
    pub spearman_rho: Option<f64>,
    /// Why there is neither; null where there is.
    pub reason: Option<String>,
}

/// Fewer runs have no order worth comparing: two always agree or disagree in full.
const FEWEST_RUNS: usize = 3;

impl StudyTable {
    /// The column called `key`.
    pub fn column(&self, key: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.key == key)
    }

    /// Every pair of columns, the first before the second in the table.
    pub fn correlations(&self) -> Vec<Correlation> {
        let pairs = (0..self.columns.len()).flat_map(|a| (a + 1..self.columns.len()).map(move |b| (a, b)));
        pairs.map(|(a, b)| correlation(&self.columns[a], &self.columns[b])).collect()
    }
}

/// How alike `a` and `b` rank the runs. Values are taken as they are, whichever way is better.
pub fn correlation(a: &Column, b: &Column) -> Correlation {
    let both = a.values.iter().zip(&b.values).filter_map(|(&a, &b)| a.zip(b));
    let both = both.filter(|(a, b)| a.is_finite() && b.is_finite());
    let (of_a, of_b): (Vec<Option<f64>>, Vec<Option<f64>>) = both.map(|(a, b)| (Some(a), Some(b))).unzip();
    let constant = |values: &[Option<f64>]| values.iter().all(|value| *value == values[0]);
    let reason = if of_a.len() < FEWEST_RUNS {
        Some(format!("{} of the runs have both, {FEWEST_RUNS} are needed", of_a.len()))
    } else if constant(&of_a) || constant(&of_b) {
        let which = if constant(&of_a) { a } else { b };
        Some(format!("{} is the same for all runs", which.key))
    } else {
        None
    };
    let given = reason.is_none();
    Correlation {
        a: a.key,
        b: b.key,
        runs: of_a.len(),
        kendall_tau_b: given.then(|| kendall_tau_b(&of_a, &of_b)).flatten(),
        spearman_rho: given.then(|| spearman_rho(&of_a, &of_b)).flatten(),
        reason,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(key: &'static str, values: &[Option<f64>]) -> Column {
        Column { key, title: key, unit: "m", lower_is_better: true, values: values.to_vec() }
    }

    #[test]
    fn only_runs_with_both_count() {
        let a = column("a", &[Some(1.0), Some(2.0), None, Some(3.0), Some(4.0)]);
        let b = column("b", &[Some(10.0), Some(30.0), Some(0.0), Some(20.0), Some(40.0)]);
        let got = correlation(&a, &b);
        // Of six pairs one is the other way round; the squares of the ranks' differences add up to 2.
        assert_eq!(got.runs, 4);
        assert!((got.kendall_tau_b.unwrap() - 4.0 / 6.0).abs() < 1e-12);
        assert!((got.spearman_rho.unwrap() - 0.8).abs() < 1e-12);
        assert_eq!(got.reason, None);
    }

    #[test]
    fn what_has_no_order_has_a_reason() {
        let two = column("two", &[Some(1.0), Some(2.0), None]);
        let same = column("same", &[Some(1.0); 3]);
        let rising = column("rising", &[Some(1.0), Some(2.0), Some(3.0)]);
        let odd = column("odd", &[Some(f64::NAN), Some(2.0), Some(3.0)]);
        let reason = |a: &Column, b: &Column| {
            let got = correlation(a, b);
            assert_eq!((got.kendall_tau_b, got.spearman_rho), (None, None));
            got.reason.unwrap()
        };
        assert_eq!(reason(&two, &rising), "2 of the runs have both, 3 are needed");
        assert_eq!(reason(&odd, &rising), "2 of the runs have both, 3 are needed");
        assert_eq!(reason(&rising, &same), "same is the same for all runs");
        let table = StudyTable { runs: vec![], columns: vec![two, same, rising] };
        let pairs: Vec<_> = table.correlations().iter().map(|c| (c.a, c.b)).collect();
        assert_eq!(pairs, [("two", "same"), ("two", "rising"), ("same", "rising")]);
        assert!(table.column("same").is_some() && table.column("none").is_none());
    }
}
