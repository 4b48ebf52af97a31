//! What `dmp truth ape` and `dmp truth rpe` print: evo's text, a table of several runs, or JSON.

use std::collections::BTreeMap;
use std::io::Write;

use dmp_draw::text::{Side, Table};
use serde::Serialize;

use crate::console::say;

use super::compared::{Compared, Metric, PairsJson};

#[derive(Debug, Serialize)]
struct FileJson<'a> {
    path: &'a str,
    format: &'static str,
    poses: usize,
    poses_compared: usize,
}

#[derive(Debug, Serialize)]
struct ReportJson<'a> {
    schema: &'static str,
    dmp_version: &'static str,
    metric: &'static str,
    title: &'a str,
    relation: &'static str,
    unit: &'static str,
    reference: FileJson<'a>,
    estimate: FileJson<'a>,
    pairs: &'a Option<PairsJson>,
    alignment: Option<[[f64; 4]; 4]>,
    errors: usize,
    stats: BTreeMap<&'static str, f64>,
    notes: &'a [String],
}

#[derive(Debug, Serialize)]
struct RunsJson<'a> {
    schema: &'static str,
    dmp_version: &'static str,
    runs: Vec<ReportJson<'a>>,
}

/// One object: of a run, or of several with a list of such objects.
pub(super) fn json(metric: &Metric<'_>, runs: &[Compared], out: &mut impl Write) -> std::io::Result<()> {
    let reports: Vec<ReportJson<'_>> = runs.iter().map(|run| report(metric, run)).collect();
    let dmp_version = env!("CARGO_PKG_VERSION");
    match reports.as_slice() {
        [only] => say::json(out, only),
        _ => say::json(out, &RunsJson { schema: "dmp-truth-runs/1", dmp_version, runs: reports }),
    }
}

fn report<'a>(metric: &'a Metric<'_>, run: &'a Compared) -> ReportJson<'a> {
    let [reference, estimate] = [0, 1].map(|k| FileJson {
        path: &run.names[k],
        format: run.formats[k],
        poses: run.counts[k],
        poses_compared: run.prepared.estimate.len(),
    });
    ReportJson {
        schema: "dmp-truth/1",
        dmp_version: env!("CARGO_PKG_VERSION"),
        metric: metric.name,
        title: &run.title,
        relation: metric.relation.name(),
        unit: run.errors.unit.name(),
        reference,
        estimate,
        pairs: &metric.pairs,
        alignment: run.prepared.moved_by.map(|moved_by| moved_by.rows()),
        errors: run.errors.values.len(),
        stats: run.stats.named().into_iter().collect(),
        notes: &run.notes,
    }
}

/// Of one run evo's text, of several a table as `evo_res` has it.
pub(super) fn text(runs: &[Compared], out: &mut impl Write) -> std::io::Result<()> {
    let Some(first) = runs.first() else { return Ok(()) };
    writeln!(out, "{}\n", first.title)?;
    if let [only] = runs {
        for (name, value) in only.stats.named() {
            writeln!(out, "{name:>10}\t{value:.6}")?;
        }
        return writeln!(out);
    }
    let mut sides = vec![Side::Left];
    sides.resize(1 + first.stats.named().len(), Side::Right);
    let mut table = Table::new(sides);
    let heads = first.stats.named().map(|(name, _)| name.to_owned());
    table.row(std::iter::once("run".to_owned()).chain(heads));
    for run in runs {
        let values = run.stats.named().map(|(_, value)| format!("{value:.6}"));
        table.row(std::iter::once(run.names[1].clone()).chain(values));
    }
    table.write(out, "")?;
    writeln!(out)
}
