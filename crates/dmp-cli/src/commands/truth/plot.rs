//! `--plot` of `dmp truth ape` and `dmp truth rpe`: runs beside the reference, as a page or a picture.

use std::collections::BTreeSet;
use std::path::Path;

use dmp_draw::{TruthPlots, TruthPose, TruthRun, TruthStats, truth_page, truth_picture};
use dmp_truth::trajectory::{ErrorUnit, Pose};

use super::compared::{Compared, all_notes};
use crate::commands::score::outputs::targets::writable;
use crate::console::Usage;
use crate::files::save_text;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Page,
    Picture,
}

fn format_of(path: &Path) -> Result<Format, Usage> {
    let is = |known: &str| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(known));
    if is("html") || is("htm") {
        Ok(Format::Page)
    } else if is("svg") {
        Ok(Format::Picture)
    } else {
        Err(Usage(format!("{}: plots are written as .html or .svg", path.display())))
    }
}

/// Refuses a file that could not be written.
pub(super) fn check(path: &Path) -> anyhow::Result<()> {
    format_of(path)?;
    writable(path)
}

/// Writes the plots.
pub(super) fn save(path: &Path, metric: &str, runs: &[Compared]) -> anyhow::Result<()> {
    let plots = plots(metric, runs);
    let text = match format_of(path)? {
        Format::Page => truth_page(&plots),
        Format::Picture => truth_picture(&plots),
    };
    save_text(path, &text)
}

fn plots(metric: &str, runs: &[Compared]) -> TruthPlots {
    let stamps = runs.iter().filter_map(|run| run.prepared.reference.stamps_s()).flatten();
    let start_s = stamps.copied().fold(f64::INFINITY, f64::min);
    let first = runs.first();
    let unit = first.map_or(ErrorUnit::None, |run| run.errors.unit);
    let names = short_names(runs);
    TruthPlots {
        metric: metric.to_uppercase(),
        title: first.map(|run| run.title.clone()).unwrap_or_default(),
        reference: first.map(|run| short(&run.names[0]).to_owned()).unwrap_or_default(),
        unit: if unit == ErrorUnit::None { String::new() } else { unit.name().to_owned() },
        has_stamps: start_s.is_finite(),
        runs: runs.iter().zip(names).map(|(run, name)| of_run(run, name, start_s)).collect(),
        notes: all_notes(runs),
        dmp_version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

fn of_run(run: &Compared, name: String, start_s: f64) -> TruthRun {
    let (reference, estimate) = (&run.prepared.reference, &run.prepared.estimate);
    let ways_m = reference.distances_m();
    let angles = |pose: &Pose| pose.roll_pitch_yaw_rad().map(f64::to_degrees);
    let both = reference.poses().iter().zip(estimate.poses()).zip(ways_m);
    let pose = |(k, ((of_reference, of_estimate), way_m)): (usize, ((&Pose, &Pose), f64))| TruthPose {
        at: reference
            .stamps_s()
            .and_then(|stamps_s| stamps_s.get(k))
            .map_or(k as f64, |stamp| stamp - start_s),
        way_m,
        positions_m: [of_reference, of_estimate].map(|pose| pose.position_m.into()),
        roll_pitch_yaw_deg: [of_reference, of_estimate].map(angles),
    };
    let stats = &run.stats;
    TruthRun {
        name,
        poses: both.enumerate().map(pose).collect(),
        errors: run.errors.poses.iter().copied().zip(run.errors.values.iter().copied()).collect(),
        stats: TruthStats {
            rmse: stats.rmse,
            mean: stats.mean,
            median: stats.median,
            std: stats.std,
            min: stats.min,
            max: stats.max,
            sse: stats.sse,
        },
    }
}

/// Runs by the names of their files, or by their paths where these are the same.
fn short_names(runs: &[Compared]) -> Vec<String> {
    let paths = || runs.iter().map(|run| run.names[1].as_str());
    let are_different = paths().map(short).collect::<BTreeSet<_>>().len() == runs.len();
    paths().map(|path| if are_different { short(path) } else { path }.to_owned()).collect()
}

fn short(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().filter(|name| !name.is_empty()).unwrap_or(path)
}
