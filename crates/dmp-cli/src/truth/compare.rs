//! What `dmp truth ape` and `dmp truth rpe` share: reading, comparing, telling.

use dmp_draw::text::count;
use std::io::Write;
use std::path::PathBuf;

use anyhow::Context as _;
use dmp::file_stem_of;
use dmp_log::{RawTrajectory, TrajectoryFormat, read_raw_trajectory_as, shown_path};
use dmp_truth::trajectory::{CompareError, Pose, PosePath, Statistics};

use super::compare_args::{CompareArgs, Files, TimeArgs};
use super::compared::{Compared, Metric, all_notes};
use super::{plot, results_zip, told};
use crate::clash::refuse_clashes;
use crate::common::Common;
use crate::exit::{Exit, Usage};
use crate::save::SavedTogether;
use crate::say::say;
use crate::score::outputs::targets::with_run;

impl CompareArgs {
    /// The whole command.
    pub(super) fn run(
        &self,
        metric: &Metric<'_>,
        common: &Common,
        out: &mut impl Write,
    ) -> anyhow::Result<Exit> {
        let files = self.files()?;
        let result_files = self.result_files(files.estimates);
        self.check_outputs(&result_files, &files)?;
        let read = |path: &PathBuf, format| read_raw_trajectory_as(path, format, self.times.time_unit);
        let reference = read(files.reference, files.reference_format)?;
        let mut runs = Vec::with_capacity(files.estimates.len());
        for path in files.estimates {
            let estimate = read(path, files.estimate_format)?;
            runs.push(self.compare(metric, (files.reference, reference.clone()), (path, estimate))?);
        }
        if !common.quiet {
            all_notes(&runs).iter().for_each(|note| say!(common.host, "note: {note}"));
        }
        if self.json {
            told::json(metric, &runs, out)?;
        } else if !self.silent {
            self.print_times(out)?;
            told::text(&runs, out)?;
        }
        let mut saved = SavedTogether::default();
        for (path, run) in result_files.iter().zip(&runs) {
            let result = results_zip::Contents {
                metric: metric.name,
                title: &run.title,
                names: &run.names,
                stats: &run.stats,
                errors: &run.errors,
                prepared: &run.prepared,
                trajectories: self.save_trajectories,
            };
            saved.add(path, |file| result.write(file))?;
        }
        saved.commit()?;
        if let Some(path) = &self.plot {
            plot::save(path, metric.name, &runs)?;
            if self.view {
                crate::view::open(path, &common.host);
            }
        }
        Ok(Exit::Done)
    }

    /// The result file of each estimate: the one that is named, of several `FILE.zip` as `FILE.ESTIMATE.zip`.
    fn result_files(&self, estimates: &[PathBuf]) -> Vec<PathBuf> {
        let Some(path) = &self.save_results else { return Vec::new() };
        if estimates.len() == 1 {
            return vec![path.clone()];
        }
        let stem = |path: &PathBuf| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut names: Vec<String> = estimates.iter().map(stem).collect();
        if (1..names.len()).any(|k| names[..k].contains(&names[k])) {
            // Folders tell them apart.
            names = estimates.iter().map(|path| path.with_extension("").display().to_string()).collect();
        }
        let all: Vec<&str> = names.iter().map(String::as_str).collect();
        names.iter().map(|name| with_run(path, &file_stem_of(&all, name))).collect()
    }

    /// Refuses before anything is read what could not be written.
    fn check_outputs(&self, result_files: &[PathBuf], files: &Files<'_>) -> anyhow::Result<()> {
        if let Some(path) = result_files.iter().find(|path| path.exists() && !self.no_warnings) {
            let there = format!("{}: there is a file; --no_warnings overwrites it", path.display());
            return Err(Usage(there).into());
        }
        let inputs: Vec<&PathBuf> = std::iter::once(files.reference).chain(files.estimates).collect();
        let outputs: Vec<&PathBuf> = result_files.iter().chain(&self.plot).collect();
        refuse_clashes(&outputs, &inputs)?;
        self.plot.as_deref().map_or(Ok(()), plot::check)
    }

    fn compare(
        &self,
        metric: &Metric<'_>,
        (reference_path, reference): (&PathBuf, RawTrajectory),
        (estimate_path, estimate): (&PathBuf, RawTrajectory),
    ) -> anyhow::Result<Compared> {
        let formats = [reference.format, estimate.format].map(TrajectoryFormat::name);
        let counts = [reference.rotations.len(), estimate.rotations.len()];
        let notes = notes([(reference_path, &reference), (estimate_path, &estimate)]);
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
        Ok(Compared { names, formats, counts, notes, title, prepared, errors, stats })
    }

    fn print_times(&self, out: &mut impl Write) -> std::io::Result<()> {
        let TimeArgs { t_start, t_end, .. } = &self.times;
        for (name, time) in [("start", t_start), ("end", t_end)] {
            if let Some(time) = time.filter(|time| *time != 0.0) {
                writeln!(out, "Using time range {name}: {}s", as_python(time))?;
            }
        }
        Ok(())
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
        CompareError::Delta { .. } | CompareError::StartAfterEnd { .. } | CompareError::Unit { .. } => {
            Usage(error.to_string()).into()
        }
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
        notes.extend(raw.notes.iter().map(|note| format!("{path}: {note}")));
        if raw.zero_quaternions > 0 {
            notes.push(format!(
                "{path}: {} quaternions are zero and taken for no rotation",
                count(raw.zero_quaternions as u64)
            ));
        }
        let stamps = raw.stamps_s.as_deref().unwrap_or_default();
        let back = stamps.windows(2).filter(|pair| pair[1] < pair[0]).count() as u64;
        let again = stamps.windows(2).filter(|pair| pair[1] == pair[0]).count() as u64;
        if back > 0 {
            let back = count(back);
            notes.push(format!("{path}: {back} stamps are smaller than the one before; the order is kept"));
        }
        if again > 0 {
            let again = count(again);
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
