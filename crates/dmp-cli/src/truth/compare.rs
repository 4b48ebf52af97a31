//! What `dmp truth ape` and `dmp truth rpe` share: reading, comparing, telling.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context as _;
use dmp_log::{RawTrajectory, TrajectoryFormat, read_raw_trajectory, shown_path};
use dmp_truth::trajectory::{CompareError, Errors, Pose, PosePath, Prepared, Relation, Statistics};
use serde::Serialize;

use super::compare_args::{CompareArgs, TimeArgs};
use super::results_zip;
use crate::common::Common;
use crate::exit::{Exit, Usage};
use crate::say::say;

/// What makes the metrics different.
pub(super) struct Metric<'a> {
    /// `ape` or `rpe`.
    pub(super) name: &'static str,
    pub(super) relation: Relation,
    /// What follows the first line of the title, with a line break before it.
    pub(super) title_tail: String,
    /// Goes into the JSON.
    pub(super) pairs: Option<PairsJson>,
    pub(super) errors: &'a dyn Fn(&Prepared) -> Result<Errors, CompareError>,
}

/// How pairs were taken, in the JSON.
#[derive(Debug, Serialize)]
pub(super) struct PairsJson {
    pub(super) delta: f64,
    pub(super) delta_unit: &'static str,
    pub(super) delta_tol: f64,
    pub(super) all_pairs: bool,
    pub(super) from_reference: bool,
}

#[derive(Debug, Serialize)]
struct FileJson {
    path: String,
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
    reference: FileJson,
    estimate: FileJson,
    pairs: &'a Option<PairsJson>,
    alignment: Option<[[f64; 4]; 4]>,
    errors: usize,
    stats: std::collections::BTreeMap<&'static str, f64>,
    notes: &'a [String],
}

impl CompareArgs {
    /// The whole command.
    pub(super) fn run(
        &self,
        metric: &Metric<'_>,
        common: &Common,
        out: &mut impl Write,
    ) -> anyhow::Result<Exit> {
        let (reference_path, estimate_path, [reference_format, estimate_format]) = self.files()?;
        if let Some(path) = self.save_results.as_ref().filter(|path| path.exists() && !self.no_warnings) {
            let there = format!("{}: there is a file; --no_warnings overwrites it", path.display());
            return Err(Usage(there).into());
        }
        let reference = read_raw_trajectory(reference_path, reference_format)?;
        let estimate = read_raw_trajectory(estimate_path, estimate_format)?;
        let formats = [reference.format, estimate.format].map(TrajectoryFormat::name);
        let counts = [reference.rotations.len(), estimate.rotations.len()];
        let notes = notes([(reference_path, &reference), (estimate_path, &estimate)]);
        if !common.quiet {
            notes.iter().for_each(|note| say!(common.host, "note: {note}"));
        }
        let (reference, estimate) = (path_of(reference)?, path_of(estimate)?);
        let preparation = self.preparation(&reference)?;
        let compared = || format!("{} against {}", estimate_path.display(), reference_path.display());
        let prepared =
            preparation.apply(reference, estimate).map_err(usage_or_failure).with_context(compared)?;
        let mut errors = (metric.errors)(&prepared).map_err(usage_or_failure).with_context(compared)?;
        if let Some(unit) = self.change_unit {
            errors = errors.in_unit(unit).map_err(usage_or_failure)?;
        }
        let stats = Statistics::of(&errors.values).context("there are no errors")?;
        let title = self.title(metric.name, metric.relation, errors.unit, &metric.title_tail);
        let names = [reference_path, estimate_path].map(|path| shown_path(path));
        if self.json {
            let [reference, estimate] = [0, 1].map(|k| FileJson {
                path: names[k].clone(),
                format: formats[k],
                poses: counts[k],
                poses_compared: prepared.estimate.len(),
            });
            let report = ReportJson {
                schema: "dmp-truth/1",
                dmp_version: env!("CARGO_PKG_VERSION"),
                metric: metric.name,
                title: &title,
                relation: metric.relation.name(),
                unit: errors.unit.name(),
                reference,
                estimate,
                pairs: &metric.pairs,
                alignment: prepared.moved_by.map(|moved_by| moved_by.rows()),
                errors: errors.values.len(),
                stats: stats.named().into_iter().collect(),
                notes: &notes,
            };
            serde_json::to_writer_pretty(&mut *out, &report).map_err(std::io::Error::from)?;
            writeln!(out)?;
        } else if !self.silent {
            self.print(&title, &stats, out)?;
        }
        if let Some(path) = &self.save_results {
            let result = results_zip::Contents {
                metric: metric.name,
                title: &title,
                names: &names,
                stats: &stats,
                errors: &errors,
                prepared: &prepared,
                trajectories: self.save_trajectories,
            };
            crate::save::save(path, |file| result.write(file))?;
        }
        Ok(Exit::Done)
    }

    fn print(&self, title: &str, stats: &Statistics, out: &mut impl Write) -> std::io::Result<()> {
        let TimeArgs { t_start, t_end, .. } = &self.times;
        for (name, time) in [("start", t_start), ("end", t_end)] {
            if let Some(time) = time.filter(|time| *time != 0.0) {
                writeln!(out, "Using time range {name}: {}s", as_python(time))?;
            }
        }
        writeln!(out, "{title}\n")?;
        for (name, value) in stats.named() {
            writeln!(out, "{name:>10}\t{value:.6}")?;
        }
        writeln!(out)
    }
}

/// A number as Python prints it.
pub(super) fn as_python(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-4..1e16).contains(&magnitude) {
        // Python's exponents have a sign and two digits.
        let text = format!("{value:e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let (sign, digits) = exponent.strip_prefix('-').map_or(('+', exponent), |digits| ('-', digits));
        return format!("{mantissa}e{sign}{digits:0>2}");
    }
    format!("{value:?}")
}

/// Options that cannot be are wrong usage; trajectories that cannot be compared are a failure.
fn usage_or_failure(error: CompareError) -> anyhow::Error {
    match error {
        CompareError::Delta { .. }
        | CompareError::StartAfterEnd { .. }
        | CompareError::Unit { .. }
        | CompareError::MotionFilterThreshold { .. } => Usage(error.to_string()).into(),
        _ => error.into(),
    }
}

fn path_of(raw: RawTrajectory) -> Result<PosePath, CompareError> {
    let both = raw.rotations.into_iter().zip(raw.positions_m);
    let poses = both.map(|(rotation, position_m)| Pose { rotation, position_m }).collect();
    PosePath::new(poses, raw.stamps_s)
}

/// What a reader should know of the files before trusting the numbers.
fn notes(files: [(&PathBuf, &RawTrajectory); 2]) -> Vec<String> {
    let mut notes = Vec::new();
    for (path, raw) in files {
        let path = shown_path(path);
        if raw.zero_quaternions > 0 {
            notes.push(format!(
                "{path}: {} quaternions are zero and taken for no rotation",
                raw.zero_quaternions
            ));
        }
        let stamps = raw.stamps_s.as_deref().unwrap_or_default();
        let back = stamps.windows(2).filter(|pair| pair[1] < pair[0]).count();
        let again = stamps.windows(2).filter(|pair| pair[1] == pair[0]).count();
        if back > 0 {
            notes.push(format!("{path}: {back} stamps are smaller than the one before; the order is kept"));
        }
        if again > 0 {
            notes.push(format!("{path}: {again} stamps repeat the one before; all poses are kept"));
        }
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_look_as_python_prints_them() {
        let cases = [(1.0, "1.0"), (0.1, "0.1"), (1e16, "1e+16"), (1.5e-7, "1.5e-07"), (123.25, "123.25")];
        for (value, text) in cases {
            assert_eq!(as_python(value), text);
        }
    }
}
