//! The drift of runs for a person.

use std::io::{self, Write};

use dmp::{Displacement, DriftReport, Scales, VisitPairReport};
use dmp_draw::text::{NONE, Side, Table, digits};
use dmp_draw::{DRIFT_HEADS, drift_compared, drift_in_words, drift_row, metres, pairs_in_words};

use crate::console::tell;

/// Writes the report: a summary, the runs, which is better, and perhaps the pairs.
pub(super) fn report(
    out: &mut impl Write,
    report: &DriftReport,
    scales: Scales,
    verbose: bool,
) -> io::Result<()> {
    tell!(out, "{}", drift_in_words(report, scales))?;
    if !report.is_measured() {
        return Ok(());
    }
    writeln!(out, "{}\n", pairs_in_words(report))?;
    runs(report).write(out, "")?;
    if !report.comparisons.is_empty() {
        writeln!(out)?;
        report
            .comparisons
            .iter()
            .try_for_each(|pair| tell!(out, "{}", drift_compared(pair, report.confidence)))?;
    }
    if verbose {
        for run in &report.runs {
            writeln!(out)?;
            tell!(out, "{}: {}", run.name, "position of the second visit minus that of its surfaces")?;
            pairs(out, &run.visits)?;
        }
    }
    Ok(())
}

/// The table of the runs.
pub(crate) fn runs(report: &DriftReport) -> Table {
    let mut table = Table::new([[Side::Left].as_slice(), &[Side::Right; DRIFT_HEADS.len()]].concat());
    table.row([["run"].as_slice(), &DRIFT_HEADS].concat());
    for run in &report.runs {
        table.row([vec![run.name.clone()], drift_row(run)].concat());
    }
    table
}

fn pairs(out: &mut impl Write, visits: &[VisitPairReport]) -> io::Result<()> {
    let mut table = Table::new([[Side::Right; 8].as_slice(), &[Side::Left]].concat());
    table.row(["scan", "and", "path", "off", "along", "sideways", "up", "yaw", ""]);
    for visit in visits {
        let scans = [visit.first.scan, visit.second.scan].map(|scan| scan.to_string());
        let path = format!("{} m", digits(visit.way_m));
        let numbers = match &visit.off {
            Some(Displacement { distance_m, along_m, sideways_m, up_m, yaw_deg, .. }) => {
                let lengths = [distance_m, along_m, sideways_m, up_m]
                    .map(|length| length.map_or_else(|| NONE.to_owned(), metres));
                [lengths.as_slice(), &[format!("{}°", digits(*yaw_deg))]].concat()
            }
            None => vec![NONE.to_owned(); 5],
        };
        let why = visit.why_not.clone().unwrap_or_default();
        table.row([scans.as_slice(), &[path], &numbers, &[why]].concat());
    }
    table.write(out, "  ")
}
