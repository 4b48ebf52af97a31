//! `dmp truth ape` and `dmp truth rpe`: absolute and relative pose errors, as `evo_ape` and `evo_rpe` have them.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp::file_stem_of;
use dmp_draw::text::count;
use dmp_log::{RawTrajectory, TrajectoryFormat, read_raw_trajectory_as, shown_path};
use dmp_truth::trajectory::{
    CompareError, DELTA_TOLERANCE, DeltaUnit, PairOptions, Pose, PosePath, Relation, Statistics, absolute,
    relative,
};

use super::compared::{Compared, Metric, PairsJson, all_notes};
use super::files::{Files, preparation, title};
use super::{plot, results_zip, summary};
use crate::commands::score::outputs::targets::with_run;
use crate::console::{Common, Exit, Usage, say};
use crate::files::{SavedTogether, refuse_clashes};
use crate::options::{Asked, Out, Spec, output, truth};

pub(super) static APE: Spec = Spec {
    name: "ape",
    about: "Absolute pose error of a trajectory against a reference, as `evo_ape`",
    more: "Matches poses by their stamps (KITTI files: line by line), aligns the estimate if asked, and summarises the errors of \
           all poses. Options, printed text and numbers are those of `evo_ape` 1.38.1.",
    usage: "dmp truth ape [OPTIONS] [tum|kitti|euroc] REFERENCE ESTIMATE [ESTIMATE2 ...]",
    after: "Examples:\n  \
            dmp truth ape truth.tum run.tum -a\n  \
            dmp truth ape kitti gt/00.txt run.txt -as\n  \
            dmp truth ape euroc data.csv run.tum -a -r angle_deg --json\n  \
            dmp truth ape truth.tum kiss.tum lio.csv -a --plot runs.html\n  \
            dmp truth ape truth.tum run.tum -a --save_results run.zip && evo_res run.zip",
    options: &[truth::COMPARED, &[&truth::APE_RELATION]],
    run: ape,
    ..Spec::EMPTY
};

pub(super) static RPE: Spec = Spec {
    name: "rpe",
    about: "Relative pose error of a trajectory against a reference, as `evo_rpe`",
    more: "Compares pairs of poses at a distance of delta (frames, metres, degrees or radians) by their relative motion. Options, \
           printed text and numbers are those of `evo_rpe` 1.38.1.",
    usage: "dmp truth rpe [OPTIONS] [tum|kitti|euroc] REFERENCE ESTIMATE [ESTIMATE2 ...]",
    after: "Examples:\n  \
            dmp truth rpe truth.tum run.tum\n  \
            dmp truth rpe kitti gt/00.txt run.txt -d 100 -u m --all_pairs\n  \
            dmp truth rpe truth.tum run.tum -d 10 -u m --all_pairs --plot run.svg\n  \
            dmp truth rpe truth.tum run.tum -d 10 -u d -r angle_deg --json",
    options: &[
        truth::COMPARED,
        &[&truth::RPE_RELATION, &truth::DELTA, &truth::DELTA_UNIT, &truth::ALL_PAIRS],
    ],
    run: rpe,
    ..Spec::EMPTY
};

fn ape(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let relation = asked.get(&truth::APE_RELATION).unwrap_or(Relation::TranslationPart);
    let metric = Metric {
        name: "ape",
        relation,
        title_tail: String::new(),
        pairs: None,
        errors: &|prepared| absolute(&prepared.reference, &prepared.estimate, relation),
    };
    run(asked, &metric, common, out)
}

fn rpe(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let relation = asked.get(&truth::RPE_RELATION).unwrap_or(Relation::TranslationPart);
    let unit = asked.get(&truth::DELTA_UNIT).unwrap_or(DeltaUnit::Frames);
    let (delta, all_pairs) = (asked.get(&truth::DELTA), asked.has(&truth::ALL_PAIRS));
    // A delta that is not given is a whole number in evo's text, whatever its unit.
    let shown = match delta {
        Some(delta) if unit != DeltaUnit::Frames => as_python(delta),
        delta => format!("{:.0}", delta.unwrap_or(1.0)),
    };
    let delta = delta.unwrap_or(1.0);
    let options = PairOptions { delta, unit, all_pairs };
    let which = if all_pairs { "all" } else { "consecutive" };
    let metric = Metric {
        name: "rpe",
        relation,
        title_tail: format!("\nfor delta = {shown} ({}) using {which} pairs", unit.name()),
        pairs: Some(PairsJson {
            delta,
            delta_unit: unit.name(),
            delta_tol: DELTA_TOLERANCE,
            all_pairs,
            from_reference: false,
        }),
        errors: &|prepared| relative(&prepared.reference, &prepared.estimate, relation, &options),
    };
    run(asked, &metric, common, out)
}

fn run(asked: &Asked, metric: &Metric<'_>, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let files = Files::of(asked)?;
    let results = asked.get(&truth::SAVE_RESULTS);
    let results = results.map_or(Vec::new(), |path| result_files(&path, &files.estimates));
    let drawn = asked.get(&truth::PLOT);
    check_outputs(&results, drawn.as_deref(), &files)?;
    let read = |path: &PathBuf, format| -> anyhow::Result<RawTrajectory> {
        let raw = read_raw_trajectory_as(path, format, asked.get(&truth::TIME_UNIT))?;
        let is_of_places = matches!(metric.relation, Relation::TranslationPart | Relation::PointDistance)
            && metric.name == APE.name
            && !asked.has(&truth::ALIGN_ORIGIN);
        if !raw.has_rotations && !is_of_places {
            let path = path.display();
            let problem = format!(
                "{path}: places without rotations serve `dmp truth ape` of translations only: leave --pose_relation and --align_origin out"
            );
            return Err(Usage(problem).into());
        }
        Ok(raw)
    };
    let reference = read(&files.reference, files.reference_format)?;
    let mut runs = Vec::with_capacity(files.estimates.len());
    for path in &files.estimates {
        let estimate = read(path, files.estimate_format)?;
        runs.push(compare(asked, metric, (&files.reference, reference.clone()), (path, estimate))?);
    }
    if !common.quiet {
        all_notes(&runs).iter().for_each(|note| say!(common.host, "note: {note}"));
    }
    if asked.has(&output::JSON) {
        summary::json(metric, &runs, out)?;
    } else {
        print_times(asked, out)?;
        summary::text(&runs, out)?;
    }
    let mut saved = SavedTogether::default();
    for (path, run) in results.iter().zip(&runs) {
        saved.add(path, |file| results_zip::write(metric.name, run, file))?;
    }
    saved.commit()?;
    drawn.map_or(Ok(()), |path| plot::save(&path, metric.name, &runs))?;
    Ok(Exit::Done)
}

/// The result file of each estimate: the one that is named, of several `FILE.zip` as `FILE.ESTIMATE.zip`.
fn result_files(path: &Path, estimates: &[PathBuf]) -> Vec<PathBuf> {
    if estimates.len() == 1 {
        return vec![path.to_owned()];
    }
    let stem = |path: &PathBuf| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut names: Vec<String> = estimates.iter().map(stem).collect();
    if (1..names.len()).any(|k| names[..k].contains(&names[k])) {
        // Their folders make them different.
        names = estimates.iter().map(|path| path.with_extension("").display().to_string()).collect();
    }
    let all: Vec<&str> = names.iter().map(String::as_str).collect();
    names.iter().map(|name| with_run(path, &file_stem_of(&all, name))).collect()
}

/// Refuses before anything is read what could not be written.
fn check_outputs(results: &[PathBuf], drawn: Option<&Path>, files: &Files) -> anyhow::Result<()> {
    if let Some(path) = results.iter().find(|path| path.exists()) {
        return Err(Usage(format!("{}: the file exists, and is not overwritten", path.display())).into());
    }
    let inputs: Vec<&PathBuf> = std::iter::once(&files.reference).chain(&files.estimates).collect();
    let outputs: Vec<&Path> = results.iter().map(PathBuf::as_path).chain(drawn).collect();
    refuse_clashes(&outputs, &inputs)?;
    drawn.map_or(Ok(()), plot::check)
}

fn compare(
    asked: &Asked,
    metric: &Metric<'_>,
    (reference_path, reference): (&PathBuf, RawTrajectory),
    (estimate_path, estimate): (&PathBuf, RawTrajectory),
) -> anyhow::Result<Compared> {
    let formats = [reference.format, estimate.format].map(TrajectoryFormat::name);
    let counts = [reference.rotations.len(), estimate.rotations.len()];
    let mut notes = notes([(reference_path, &reference), (estimate_path, &estimate)]);
    let (reference, estimate) = (path_of(reference)?, path_of(estimate)?);
    let preparation = preparation(asked, &reference)?;
    let compared = || format!("{} against {}", estimate_path.display(), reference_path.display());
    let prepared =
        preparation.apply(reference, &estimate).map_err(usage_or_failure).with_context(compared)?;
    // The shorter one asks for partners.
    let asking = usize::from(counts[1] <= counts[0]);
    let (paired, all) = (prepared.estimate.len(), counts[asking]);
    let is_whole = preparation.start_s.is_none() && preparation.end_s.is_none();
    if prepared.reference.stamps_s().is_some() && paired < all && is_whole {
        let name = shown_path([reference_path, estimate_path][asking]);
        let within_s = preparation.matching.max_diff_s;
        notes.push(format!(
            "{name}: {paired} of {all} poses have a partner within {within_s} s (--t_max_diff); the others are not compared"
        ));
    }
    let mut errors = (metric.errors)(&prepared).map_err(usage_or_failure).with_context(compared)?;
    if let Some(unit) = asked.get(&truth::CHANGE_UNIT) {
        errors = errors.in_unit(unit).map_err(usage_or_failure)?;
    }
    let stats = Statistics::of(&errors.values).context("there are no errors")?;
    let title = title(asked, metric.name, metric.relation, errors.unit, &metric.title_tail);
    let names = [reference_path, estimate_path].map(|path| shown_path(path));
    Ok(Compared { names, formats, counts, notes, title, prepared, errors, stats })
}

fn print_times(asked: &Asked, out: &mut impl Write) -> std::io::Result<()> {
    for (name, option) in [("start", &truth::T_START), ("end", &truth::T_END)] {
        if let Some(time) = asked.get(option).filter(|time| *time != 0.0) {
            writeln!(out, "Using time range {name}: {}s", as_python(time))?;
        }
    }
    Ok(())
}

/// A number as Python prints it.
fn as_python(value: f64) -> String {
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
                "{path}: {} quaternions are zero: no rotation is assumed",
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
