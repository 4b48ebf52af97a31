//! What `--verbose` adds: all scores, where returns went, times and memory.

use std::io::{self, Write};

use dmp::{Report, RunReport};
use dmp_draw::text::{self, NONE, Side, Table, count, digits, shortened};

use super::pairs;
use crate::console::Terminal;

/// Columns of a name at the head of a column.
const NAME: usize = 24;

/// Writes everything that the tables above leave out.
pub(super) fn all(out: &mut impl Write, report: &Report, terminal: Terminal) -> io::Result<()> {
    if !report.pairs.is_empty() {
        writeln!(out)?;
        pairs::all(out, report, terminal)?;
    }
    writeln!(out)?;
    scores(out, report, terminal)?;
    writeln!(out)?;
    returns(out, report)?;
    writeln!(out)?;
    effort(report).iter().try_for_each(|line| terminal.tell(out, "", line))
}

/// A line of the table of scores: its title and what it shows of a run.
type Row<'a> = (String, Box<dyn Fn(&RunReport) -> String + 'a>);

/// Every score of every run, a run a column.
fn scores(out: &mut impl Write, report: &Report, terminal: Terminal) -> io::Result<()> {
    let square = |value: Option<f64>| value.map_or(NONE.to_owned(), digits);
    let interval = |value: Option<[f64; 2]>| {
        value.map_or(NONE.to_owned(), |[low, high]| format!("{} to {}", digits(low), digits(high)))
    };
    let mut rows: Vec<Row<'_>> = vec![("Scores, m²".to_owned(), Box::new(|run| shortened(&run.name, NAME)))];
    let scales = report.config.scales;
    for (k, scale_m) in scales.lengths().cv_m[1..].iter().enumerate() {
        rows.push((format!("R_cv {scale_m} m"), Box::new(move |run| square(run.r_cv_m2[k]))));
        if k == 0 {
            rows.push((
                format!("  {} interval", text::confidence(report.promise.confidence)),
                Box::new(|run| interval(run.r_cv_interval_m2)),
            ));
        }
    }
    for (k, scale_m) in scales.lengths().near_m.iter().enumerate() {
        rows.push((format!("R_near {scale_m} m"), Box::new(move |run| square(run.r_near_m2[k]))));
    }
    rows.push(("DMP, sum".to_owned(), Box::new(|run| digits(run.dmp_sum_m2))));
    if report.runs.iter().any(|run| run.dmp_depth_sum_m2.is_some()) {
        rows.push(("  in depth".to_owned(), Box::new(|run| square(run.dmp_depth_sum_m2))));
    }
    rows.push(("log-likelihood, raw".to_owned(), Box::new(|run| digits(run.log_likelihood_raw))));
    rows.push(("surfels".to_owned(), Box::new(|run| count(run.map.surfels))));
    let thin = |run: &RunReport| run.map.thin_voxels.map_or(NONE.to_owned(), count);
    rows.push(("thin voxels".to_owned(), Box::new(thin)));
    rows.push(("tiles".to_owned(), Box::new(|run| count(run.map.tiles))));
    let runs: Vec<&RunReport> = report.in_order().collect();
    let mut sides = vec![Side::Left];
    sides.resize(1 + runs.len(), Side::Right);
    let mut table = Table::new(sides);
    for (title, value) in &rows {
        table.row(std::iter::once(title.clone()).chain(runs.iter().map(|run| value(run))));
    }
    table.write_within(out, terminal.width)
}

/// Where every return of the log went.
fn returns(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let inputs = &report.inputs;
    let mut table = Table::new([Side::Left, Side::Right]);
    table.row(["Returns".to_owned(), count(inputs.returns)]);
    table.row(["used".to_owned(), count(inputs.returns_used)]);
    for (reason, &dropped) in inputs.dropped.0.iter().filter(|(_, dropped)| **dropped > 0) {
        table.row([format!("dropped: {}", reason.replace('_', " ")), count(dropped)]);
    }
    table.write(out, "")
}

fn effort(report: &Report) -> [String; 2] {
    let (timing, memory) = (&report.timing, &report.memory);
    let drift = match report.drift {
        Some(_) => format!("drift {}, ", text::duration(timing.drift_s)),
        None => String::new(),
    };
    let time = format!(
        "Time    plan {}, fuse {}, trails {}, cast {}, {drift}all {}; {}",
        text::duration(timing.plan_s),
        text::duration(timing.fuse_s),
        text::duration(timing.trails_s),
        text::duration(timing.cast_s),
        text::duration(timing.total_s),
        text::counted(timing.threads as u64, "thread")
    );
    let memory = format!(
        "Memory  peak {} of {}; {} of scratch files, {} for {} of {}",
        memory.peak_anon_bytes.map_or(NONE.to_owned(), text::bytes),
        text::bytes(memory.budget_bytes as u64),
        text::bytes(memory.scratch_bytes),
        text::counted(memory.tile_loads, "tile load"),
        text::counted(memory.tile_visits, "visit"),
        text::counted(memory.tiles_in_reach, "tile")
    );
    [time, memory]
}
