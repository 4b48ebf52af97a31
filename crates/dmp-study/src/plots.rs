//! The pictures of a study.

use crate::columns::Side;
use crate::study::Study;
use crate::table::{Column, StudyTable, correlation};
use dmp_draw::plot::{Axis, Plot, Point, Series, Style};

/// Values further apart than this (largest over smallest) are shown on a logarithmic axis …
const LOG_FROM: f64 = 30.0;
/// … unless some are as good as zero beside the largest.
const LOG_UP_TO: f64 = 1e5;

/// A picture and the name of its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Name of the file, of letters, digits, `.`, `-` and `_` alone.
    pub file_name: String,
    /// Its content.
    pub svg: String,
}

/// The pictures: every score against ATE, and against SMD where there is one, as `SCORE-ERROR.svg`; and
/// `curves.svg`, the runs in order of their ATE with DMP, ATE and SMD, each in parts of its largest value, as
/// Zhang & Chen 2021 show theirs.
pub fn plots_of(study: &Study) -> Vec<Picture> {
    let table = &study.table;
    let errors = ["ate_rmse_m", "smd_mean_m"].into_iter().filter_map(|key| table.column(key));
    let scores = || table.columns.iter().filter(|column| column.side() == Side::Score);
    let mut pictures: Vec<Picture> = errors
        .flat_map(|error| scores().map(move |score| (score, error)))
        .map(|(score, error)| Picture {
            file_name: format!("{}-{}.svg", score.key, error.key),
            svg: scatter(table, score, error).to_svg(),
        })
        .collect();
    pictures.extend(curves(table).map(|plot| Picture { file_name: "curves.svg".into(), svg: plot.to_svg() }));
    pictures
}

fn scatter(table: &StudyTable, score: &Column, error: &Column) -> Plot {
    let pairs = error.values.iter().zip(&score.values).zip(&table.runs);
    let points = pairs.filter_map(|((x, y), name)| Some(Point { x: (*x)?, y: (*y)?, name: name.clone() }));
    let points: Vec<Point> = points.collect();
    let correlation = correlation(score, error);
    let agreement = match (correlation.kendall_tau_b, correlation.spearman_rho) {
        (Some(tau), Some(rho)) => format!("Kendall τ-b {tau:.2}, Spearman ρ {rho:.2}, {} runs", points.len()),
        _ => correlation.reason.unwrap_or_default(),
    };
    Plot {
        title: format!("{} against {}", score.title, error.title),
        subtitle: agreement,
        x: axis(error, points.iter().map(|p| p.x)),
        y: axis(score, points.iter().map(|p| p.y)),
        x_names: Vec::new(),
        series: vec![Series { name: score.title.to_owned(), points, style: Style::Points }],
    }
}

fn axis(column: &Column, values: impl Iterator<Item = f64>) -> Axis {
    let (low, high) =
        values.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)));
    let title = match column.unit {
        "" => column.title.to_owned(),
        unit => format!("{} [{unit}]", column.title),
    };
    Axis { title, log: low > 0.0 && (LOG_FROM..LOG_UP_TO).contains(&(high / low)) }
}

/// `None` without a single ATE.
fn curves(table: &StudyTable) -> Option<Plot> {
    let ate = table.column("ate_rmse_m")?;
    let mut order: Vec<(usize, f64)> =
        ate.values.iter().enumerate().filter_map(|(run, value)| Some((run, (*value)?))).collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    let series = |key: &str| {
        let column = table.column(key)?;
        let largest = column.values.iter().flatten().copied().fold(0.0, f64::max);
        let point = |(place, &(run, _)): (usize, &(usize, f64))| {
            let value = column.values[run].filter(|_| largest > 0.0)?;
            Some(Point { x: place as f64, y: value / largest, name: String::new() })
        };
        let points = order.iter().enumerate().filter_map(point).collect();
        Some(Series { name: column.title.to_owned(), points, style: Style::Joined })
    };
    (!order.is_empty()).then(|| Plot {
        title: "Runs in order of their ATE".into(),
        subtitle: "each in parts of its largest value".into(),
        x: Axis::default(),
        y: Axis { title: "part of the largest".into(), log: false },
        x_names: order.iter().map(|&(run, _)| table.runs[run].clone()).collect(),
        series: ["dmp_sum_m2", "ate_rmse_m", "smd_mean_m"].into_iter().filter_map(series).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> StudyTable {
        let column = |key, values: [Option<f64>; 4]| Column {
            key,
            title: key,
            unit: "m",
            lower_is_better: true,
            values: values.to_vec(),
        };
        StudyTable {
            runs: ["d", "a", "c", "b"].map(String::from).to_vec(),
            columns: vec![
                column("dmp_sum_m2", [Some(50.0), Some(10.0), None, Some(20.0)]),
                column("ate_rmse_m", [Some(4.0), Some(0.1), Some(2.0), Some(1.0)]),
            ],
        }
    }

    #[test]
    fn curves_are_in_order_of_ate_and_parts_of_the_largest() {
        let plot = curves(&table()).unwrap();
        assert_eq!(plot.x_names, ["a", "b", "c", "d"]);
        let values = |k: usize| plot.series[k].points.iter().map(|p| (p.x, p.y)).collect::<Vec<_>>();
        assert_eq!(values(0), [(0.0, 0.2), (1.0, 0.4), (3.0, 1.0)]);
        assert_eq!(values(1), [(0.0, 0.025), (1.0, 0.25), (2.0, 0.5), (3.0, 1.0)]);
        assert_eq!(plot.series.len(), 2);
    }

    #[test]
    fn a_scatter_has_the_runs_with_both() {
        let table = table();
        let plot = scatter(&table, &table.columns[0], &table.columns[1]);
        assert_eq!(plot.series[0].points.len(), 3);
        assert_eq!(plot.subtitle, "Kendall τ-b 1.00, Spearman ρ 1.00, 3 runs");
        assert!(plot.x.log && !plot.y.log);
        assert_eq!(plot.x.title, "ate_rmse_m [m]");
    }
}
