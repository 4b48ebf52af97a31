//! The figures of docs/accuracy.md.

use dmp_draw::plot::{Axis, Plot, Point, Series, Style};
use dmp_study::Picture;

use super::judge::{column, errors};
use super::result::DriveResult;

/// Scores shown against the true errors, and the names of their files.
const SHOWN: [(&str, &str, &str); 3] = [
    ("R_cv(10) κ=0.15", "R_cv(10)", "r_cv_10"),
    ("R_near(5)", "R_near(5)", "r_near_5"),
    ("MME", "MME", "mme"),
];

pub(super) fn figures(drives: &[&DriveResult]) -> Vec<Picture> {
    let curves = drives.iter().map(|drive| Picture {
        file_name: format!("curves-{}.svg", drive.drive),
        svg: curves(drive).to_svg(),
    });
    let scatters = SHOWN.iter().map(|(key, title, stem)| Picture {
        file_name: format!("{stem}-ate.svg"),
        svg: scatter(drives, key, title).to_svg(),
    });
    curves.chain(scatters).collect()
}

/// The estimates of a drive in order of their ATE with DMP, ATE and SMD, as Zhang & Chen 2021, figures 1 and 2,
/// show theirs.
fn curves(drive: &DriveResult) -> Plot {
    let ate = errors(drive, "ATE");
    let mut order: Vec<usize> = (0..drive.runs.len()).collect();
    order.sort_by(|&a, &b| ate[a].unwrap_or(f64::NAN).total_cmp(&ate[b].unwrap_or(f64::NAN)));
    let series = |name: &str, values: Vec<Option<f64>>| {
        let largest = values.iter().flatten().copied().fold(f64::MIN_POSITIVE, f64::max);
        let point = |(place, &run): (usize, &usize)| {
            // The truth has an ATE of 0 but for rounding: it has no place on a logarithmic axis.
            let y = values[run].map(|value| value / largest).filter(|&y| y > 1e-6)?;
            Some(Point { x: place as f64, y, name: String::new() })
        };
        Series {
            name: name.to_owned(),
            points: order.iter().enumerate().filter_map(point).collect(),
            style: Style::Joined,
        }
    };
    Plot {
        title: format!("{}: estimates in order of their ATE", drive.drive),
        subtitle: "each in parts of its largest value".into(),
        x: Axis::default(),
        y: Axis { title: "part of the largest".into(), log: true },
        x_names: order.iter().map(|&run| drive.runs[run].name.clone()).collect(),
        series: vec![
            series("DMP", column(drive, "DMP sum")),
            series("ATE", ate.clone()),
            series("SMD", errors(drive, "SMD")),
        ],
    }
}

/// All estimates but the truths, whose ATE is 0.
fn scatter(drives: &[&DriveResult], key: &str, title: &str) -> Plot {
    let of_drive = |drive: &&DriveResult| {
        let both = errors(drive, "ATE").into_iter().zip(column(drive, key)).skip(1);
        both.filter_map(|(x, y)| Some(Point { x: x?, y: y?, name: String::new() })).collect::<Vec<_>>()
    };
    let half = |name: &str, held_out: bool| Series {
        name: name.to_owned(),
        points: drives.iter().filter(|drive| drive.held_out == held_out).flat_map(of_drive).collect(),
        style: Style::Points,
    };
    let series = vec![half("chosen drives", false), half("drives held out", true)];
    let positive = series.iter().flat_map(|s| &s.points).all(|point| point.y > 0.0);
    Plot {
        title: format!("{title} against ATE"),
        subtitle: format!("all estimates of {} drives but the truths", drives.len()),
        x: Axis { title: "ATE [m]".into(), log: true },
        y: Axis { title: format!("{title} [{}]", if positive { "m²" } else { "nats" }), log: positive },
        x_names: Vec::new(),
        series,
    }
}
