//! What `--verbose` adds: all scores, where returns went, times and memory.

use std::io::{self, Write};

use dmp::{Report, RunReport};

use super::pairs;
use crate::text::{self, NONE, Side, Table, count, digits};

/// Writes everything that the tables above leave out.
pub(super) fn all(out: &mut impl Write, report: &Report) -> io::Result<()> {
    if !report.pairs.is_empty() {
        writeln!(out)?;
        pairs::scales(out, report)?;
    }
    writeln!(out)?;
    scores(out, report)?;
    writeln!(out)?;
    returns(out, report)?;
    writeln!(out)?;
    effort(out, report)
}

/// A line of the table of scores: its title and what it shows of a run.
type Row<'a> = (&'a str, &'a dyn Fn(&RunReport) -> String);

/// Every score of every run, a run a column.
fn scores(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let square = |value: Option<f64>| value.map_or(NONE.to_owned(), digits);
    let interval = |value: Option<[f64; 2]>| {
        value.map_or(NONE.to_owned(), |[low, high]| format!("{} to {}", digits(low), digits(high)))
    };
    let rows: [Row<'_>; 14] = [
        ("Scores, m²", &|run| run.name.clone()),
        ("R_cv 10 m", &|run| square(run.r_cv_m2.at_10)),
        ("  99 % interval", &|run| interval(run.r_cv_10_ci99_m2)),
        ("R_cv 2 m", &|run| square(run.r_cv_m2.at_2)),
        ("R_cv 0.5 m", &|run| square(run.r_cv_m2.at_0_5)),
        ("R_cv 0.2 m", &|run| square(run.r_cv_m2.at_0_2)),
        ("R_near 5 m", &|run| square(run.r_near_m2.at_5)),
        ("R_near 2 m", &|run| square(run.r_near_m2.at_2)),
        ("R_near 0.5 m", &|run| square(run.r_near_m2.at_0_5)),
        ("DMP, sum", &|run| digits(run.dmp_sum_m2)),
        ("log-likelihood, raw", &|run| digits(run.log_likelihood_raw)),
        ("surfels", &|run| count(run.map.surfels)),
        ("thin voxels", &|run| run.map.thin_voxels.map_or(NONE.to_owned(), count)),
        ("tiles", &|run| count(run.map.tiles)),
    ];
    let of_trails: [Row<'_>; 2] = [
        ("surfels with trails", &|run| run.map.surfels_with_trails.map_or(NONE.to_owned(), count)),
        ("  contradicted", &|run| run.map.surfels_contradicted.map_or(NONE.to_owned(), count)),
    ];
    let of_trails = of_trails.iter().filter(|_| report.free_space.is_some());
    let runs: Vec<&RunReport> =
        report.order.iter().filter_map(|name| report.runs.iter().find(|run| run.name == *name)).collect();
    let mut sides = vec![Side::Left];
    sides.resize(1 + runs.len(), Side::Right);
    let mut table = Table::new(sides);
    for (title, value) in rows.iter().chain(of_trails) {
        table.row(std::iter::once((*title).to_owned()).chain(runs.iter().map(|run| value(run))));
    }
    table.write(out, "")
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

fn effort(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let (timing, memory) = (&report.timing, &report.memory);
    let trails = match report.free_space {
        Some(_) => format!("trails {}, ", text::duration(timing.trails_s)),
        None => String::new(),
    };
    writeln!(
        out,
        "Time    plan {}, fuse {}, {trails}cast {}, all {}; {}",
        text::duration(timing.plan_s),
        text::duration(timing.fuse_s),
        text::duration(timing.cast_s),
        text::duration(timing.total_s),
        text::counted(timing.threads as u64, "thread")
    )?;
    writeln!(
        out,
        "Memory  peak {} of {}; {} of scratch files, {} for {} of {}",
        memory.peak_anon_bytes.map_or(NONE.to_owned(), text::bytes),
        text::bytes(memory.budget_bytes as u64),
        text::bytes(memory.scratch_bytes),
        text::counted(memory.tile_loads, "tile load"),
        text::counted(memory.tile_visits, "visit"),
        text::counted(memory.tiles_in_reach, "tile")
    )
}
