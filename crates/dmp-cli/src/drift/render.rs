//! The drift of runs for a person.

use std::io::{self, Write};

use dmp::{Displacement, DriftComparison, DriftReport, Measured, RunDrift, VisitPairReport};
use dmp_draw::text::{NONE, Side, Table, confidence, counted, digits};

use crate::say::tell;

/// What is this much larger than either of the others is said first.
const MOSTLY: f64 = 1.5;

/// Writes the report: what comes first, the runs, who is better, and the pairs where they are asked for.
pub(super) fn report(out: &mut impl Write, report: &DriftReport, verbose: bool) -> io::Result<()> {
    if report.pairs_measured == 0 {
        return writeln!(
            out,
            "The drive comes back to no place (way {} m, {}): there is nothing to measure drift by.",
            digits(report.travel_m),
            counted(report.segments as u64, "segment"),
        );
    }
    let sentences: Vec<String> = report.runs.iter().map(sentence).collect();
    tell!(out, "Where the drive comes back, {}.", sentences.join("; "))?;
    let looked_at = if report.pairs_measured == report.pairs_found {
        counted(report.pairs_found as u64, "pair")
    } else {
        format!("{} of {}", report.pairs_measured, counted(report.pairs_found as u64, "pair"))
    };
    writeln!(out, "{looked_at} of visits to the same places, {} m of way\n", digits(report.travel_m))?;
    runs(out, report)?;
    if !report.comparisons.is_empty() {
        writeln!(out)?;
        report.comparisons.iter().try_for_each(|pair| tell!(out, "{}", compared(pair, report.confidence)))?;
    }
    if verbose {
        for (number, run) in report.runs.iter().enumerate() {
            writeln!(out)?;
            tell!(out, "{}: {}", run.name, "where it put the second visit, less where its surfaces are")?;
            pairs(out, &report.visits, number)?;
        }
    }
    Ok(())
}

/// A length: below a metre in centimetres.
pub(crate) fn metres(length_m: f64) -> String {
    if length_m.abs() < 1.0 {
        format!("{} cm", digits(100.0 * length_m))
    } else {
        format!("{} m", digits(length_m))
    }
}

fn or_none(value: Option<f64>, told: impl Fn(f64) -> String) -> String {
    value.map_or_else(|| NONE.to_owned(), told)
}

/// `kiss is off by 59 cm (0.4 % of the way), mostly sideways`.
fn sentence(run: &RunDrift) -> String {
    let parts = [(run.along_m, "along the way"), (run.sideways_m, "sideways"), (run.up_m, "in height")];
    let mut known: Vec<(f64, &str)> =
        parts.into_iter().filter_map(|(part_m, name)| Some((part_m?, name))).collect();
    let Some(median_m) = run.median_m.value else {
        if known.is_empty() {
            return format!("nothing can be said of {}: no surfaces hold its visits together", run.name);
        }
        let known: Vec<String> =
            known.iter().map(|(part_m, name)| format!("{} {name}", metres(*part_m))).collect();
        return format!("{} is off by {} and no surfaces tell the rest", run.name, known.join(", "));
    };
    let way = run.of_the_way_percent.map(|percent| format!(" ({} % of the way)", digits(percent)));
    known.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mostly = match known[..] {
        [(most, name), (next, _), ..] if most > MOSTLY * next => format!(", mostly {name}"),
        _ => String::new(),
    };
    format!("{} is off by {}{}{mostly}", run.name, metres(median_m), way.unwrap_or_default())
}

fn runs(out: &mut impl Write, report: &DriftReport) -> io::Result<()> {
    let mut table = Table::new([[Side::Left].as_slice(), &[Side::Right; 10]].concat());
    table.row([
        "run",
        "median",
        "RMS",
        "interval",
        "95 % below",
        "along",
        "sideways",
        "up",
        "rotation",
        "of the way",
        "pairs",
    ]);
    for run in &report.runs {
        let interval = |of: &Measured| {
            of.interval
                .map_or_else(|| NONE.to_owned(), |[low, high]| format!("{} .. {}", metres(low), metres(high)))
        };
        let others = [(run.pairs_in_part, " in part"), (run.pairs_refused, " refused")];
        let counts = others.iter().filter(|(count, _)| *count > 0);
        let counts: Vec<String> =
            [(run.pairs, "")].iter().chain(counts).map(|(count, what)| format!("{count}{what}")).collect();
        table.row([
            run.name.clone(),
            or_none(run.median_m.value, metres),
            or_none(run.rms_m.value, metres),
            interval(&run.rms_m),
            or_none(run.p95_m.value, metres),
            or_none(run.along_m, metres),
            or_none(run.sideways_m, metres),
            or_none(run.up_m, metres),
            or_none(run.angle_deg, |deg| format!("{}°", digits(deg))),
            or_none(run.of_the_way_percent, |percent| format!("{} %", digits(percent))),
            counts.join(", "),
        ]);
    }
    table.write(out, "")
}

fn compared(pair: &DriftComparison, level: f64) -> String {
    let DriftComparison { a, b, pairs, rms_a_m, rms_b_m, better, .. } = pair;
    let told = |name: &str, rms_m: &Option<f64>| format!("{name} {}", or_none(*rms_m, metres));
    let verdict = match better {
        Some(better) => format!("{better} comes back better ({} sure)", confidence(level)),
        None if pair.difference_m2.interval.is_none() => "too few pairs of visits to decide".to_owned(),
        None => "not decided".to_owned(),
    };
    let common = counted(*pairs as u64, "pair");
    format!("{a} and {b}: {verdict}; RMS on {common} in common: {}, {}", told(a, rms_a_m), told(b, rms_b_m))
}

fn pairs(out: &mut impl Write, visits: &[VisitPairReport], run: usize) -> io::Result<()> {
    let mut table = Table::new([[Side::Right; 8].as_slice(), &[Side::Left]].concat());
    table.row(["scan", "and", "way", "off", "along", "sideways", "up", "yaw", ""]);
    for visit in visits {
        let of_run = &visit.runs[run];
        let scans = [visit.first.scan, visit.second.scan].map(|scan| scan.to_string());
        let way = format!("{} m", digits(visit.way_m));
        let numbers = match &of_run.off {
            Some(Displacement { distance_m, along_m, sideways_m, up_m, yaw_deg, .. }) => {
                let lengths = [distance_m, along_m, sideways_m, up_m].map(|length| or_none(*length, metres));
                [lengths.as_slice(), &[format!("{}°", digits(*yaw_deg))]].concat()
            }
            None => vec![NONE.to_owned(); 5],
        };
        let why = of_run.why_not.clone().unwrap_or_default();
        table.row([scans.as_slice(), &[way], &numbers, &[why]].concat());
    }
    table.write(out, "  ")
}
