//! What was found of a run, in numbers and in pictures.

use std::io::{self, Write};

use dmp::{ConventionsReport, EstimateReport, Profile};
use dmp_draw::plot::{Axis, Plot, Point, Series, Style};
use dmp_draw::text::{Side, Table, digits};

use crate::console::tell;

/// Estimates of a run's clock and extrinsic.
pub(super) fn table(out: &mut impl Write, name: &str, found: &ConventionsReport) -> io::Result<()> {
    let ConventionsReport { together, thickness_m, thickness_mended_m, estimates, silence, .. } = found;
    writeln!(out, "{name}")?;
    if let Some(share) = together {
        writeln!(out, "  {:.0} % of the sampled returns lie near those of other scans", 100.0 * share)?;
    }
    match thickness_m {
        Some(metres) => {
            let mended = thickness_mended_m.filter(|mended| *mended != *metres);
            let mended = mended.map_or(String::new(), |mended| {
                format!(", and {} cm with the fixes", digits(100.0 * mended))
            });
            writeln!(out, "  surfaces are {} cm thick{mended}", digits(100.0 * metres))?;
        }
        None => writeln!(out, "  clock and extrinsic cannot be estimated")?,
    }
    if let Some(why) = silence {
        tell!(out, "  {why}")?;
    }
    if !estimates.is_empty() {
        writeln!(
            out,
            "  corrections to add (time: to the log's stamps; sweep: factor of the times of returns):"
        )?;
    }
    let mut table = Table::new([Side::Left, Side::Right, Side::Right, Side::Left, Side::Left]);
    for estimate in estimates {
        table.row(row(estimate, silence.is_some()));
    }
    table.write(out, "  ")?;
    writeln!(out)
}

/// A number in the unit that people use for it.
fn row(estimate: &EstimateReport, is_silent: bool) -> [String; 5] {
    let EstimateReport { axis, value, half, seen, off, pays } = estimate;
    let (factor, unit, decimals) = unit_of(axis);
    let remark = match (seen, off, pays) {
        _ if is_silent => "",
        (false, ..) => "not determined here",
        (true, true, true) => "off",
        (true, true, false) => "off, surfaces hardly change",
        (true, false, _) => "",
    };
    let number = |value: f64| format!("{value:.decimals$}");
    [
        axis.clone(),
        number(factor * value),
        format!("± {}", number(factor * half)),
        unit.to_owned(),
        remark.to_owned(),
    ]
}

/// What a number of this name is multiplied by, the unit that this gives, and its decimals.
fn unit_of(axis: &str) -> (f64, &'static str, usize) {
    match axis {
        "time" => (1e3, "ms", 2),
        "sweep" => (1.0, "of the times of returns", 3),
        "roll" | "pitch" | "yaw" => (1.0_f64.to_degrees(), "°", 3),
        _ => (100.0, "cm", 2),
    }
}

/// How thick the surfaces of each run are with values of one number.
pub(super) fn plot(profile: &Profile, names: &[&str]) -> Plot {
    let (factor, unit, _) = unit_of(profile.axis.name());
    let of_run = |(name, thickness_m): (&&str, &Option<Vec<f64>>)| {
        let values = profile.values.iter().zip(thickness_m.as_ref()?);
        let point = |(value, metres): (&f64, &f64)| Point {
            x: factor * value,
            y: 100.0 * metres,
            name: String::new(),
        };
        Some(Series { name: (*name).to_owned(), points: values.map(point).collect(), style: Style::Joined })
    };
    let given = profile.axis.as_given();
    Plot {
        title: format!("Surfaces against {}", profile.axis.name()),
        subtitle: format!("{given} is as given; the other parameters are fixed where that pays"),
        x: Axis { title: format!("{} [{unit}]", profile.axis.name()), log: false },
        y: Axis { title: "thickness [cm]".into(), log: false },
        x_names: Vec::new(),
        series: names.iter().zip(&profile.thickness_m).filter_map(of_run).collect(),
    }
}
