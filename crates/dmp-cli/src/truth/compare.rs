//! What `dmp truth ape` and `dmp truth rpe` share: arguments, reading, preparing, telling.

use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::{Args, ValueEnum};
use dmp_log::{RawTrajectory, TrajectoryFormat, read_raw_trajectory};
use dmp_truth::trajectory as truth;
use dmp_truth::trajectory::{
    CompareError, ErrorUnit, Errors, Pose, PosePath, Prepared, Relation, Statistics,
};
use serde::Serialize;

use super::results_zip;
use crate::common::Common;
use crate::exit::Exit;
use crate::exit::Usage;

/// Arguments of both, named as users of evo know them.
#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(crate) struct CompareArgs {
    /// Reference and estimate, after the format of the files (tum, kitti, euroc, npy or g2o) if it is to be
    /// given
    #[arg(value_name = "[FORMAT] REFERENCE ESTIMATE", num_args = 2..=3, required = true)]
    files: Vec<PathBuf>,
    /// Align with Umeyama's method (rotation and translation)
    #[arg(short, long, conflicts_with = "align_origin", help_heading = "Alignment")]
    align: bool,
    /// Correct the scale with Umeyama's method
    #[arg(short = 's', long = "correct_scale", alias = "correct-scale", help_heading = "Alignment")]
    correct_scale: bool,
    /// Align the first pose to the reference's first
    #[arg(long = "align_origin", alias = "align-origin", help_heading = "Alignment")]
    align_origin: bool,
    /// Align by the first N poses only (-1: all)
    #[arg(
        long = "n_to_align",
        alias = "n-to-align",
        value_name = "N",
        default_value_t = -1,
        allow_negative_numbers = true,
        help_heading = "Alignment"
    )]
    n_to_align: i64,
    /// Tell errors in this unit
    #[arg(long = "change_unit", alias = "change-unit", value_name = "UNIT", help_heading = "Error")]
    change_unit: Option<UnitName>,
    /// Project both trajectories into a plane, after the alignment
    #[arg(
        long = "project_to_plane",
        alias = "project-to-plane",
        value_name = "PLANE",
        help_heading = "Error"
    )]
    project_to_plane: Option<PlaneName>,
    /// Use at most N poses of each trajectory
    #[arg(long, value_name = "N", help_heading = "Poses used")]
    downsample: Option<usize>,
    /// Leave out poses nearer than a distance (m) and an angle (deg) to the one before
    #[arg(
        long = "motion_filter",
        alias = "motion-filter",
        num_args = 2,
        value_names = ["DISTANCE", "ANGLE_DEGREES"],
        help_heading = "Poses used"
    )]
    motion_filter: Option<Vec<f64>>,
    #[command(flatten)]
    times: TimeArgs,
    /// Print one JSON object (schema dmp-truth/1)
    #[arg(long, help_heading = "Output")]
    json: bool,
    /// Write a result file for `evo_res`
    #[arg(long = "save_results", alias = "save-results", value_name = "FILE.zip", help_heading = "Output")]
    save_results: Option<PathBuf>,
    /// Put the compared trajectories into the result file too
    #[arg(
        long = "save_traj_in_zip",
        alias = "save-traj-in-zip",
        requires = "save_results",
        help_heading = "Output"
    )]
    save_trajectories: bool,
    /// Overwrite a result file that is there
    #[arg(long = "no_warnings", alias = "no-warnings", help_heading = "Output")]
    no_warnings: bool,
    /// Print nothing
    #[arg(long, conflicts_with = "json", help_heading = "Output")]
    silent: bool,
}

/// How stamps are matched. Not for files without stamps.
#[derive(Debug, Args)]
struct TimeArgs {
    /// Largest difference of stamps that belong together, seconds [default: 0.01]
    #[arg(long = "t_max_diff", alias = "t-max-diff", value_name = "S", help_heading = "Time")]
    t_max_diff: Option<f64>,
    /// Seconds to add to the estimate's stamps
    #[arg(
        long = "t_offset",
        alias = "t-offset",
        value_name = "S",
        allow_negative_numbers = true,
        help_heading = "Time"
    )]
    t_offset: Option<f64>,
    /// Use the reference only from this stamp on, seconds
    #[arg(
        long = "t_start",
        alias = "t-start",
        value_name = "S",
        allow_negative_numbers = true,
        help_heading = "Time"
    )]
    t_start: Option<f64>,
    /// Use the reference only up to this stamp, seconds
    #[arg(
        long = "t_end",
        alias = "t-end",
        value_name = "S",
        allow_negative_numbers = true,
        help_heading = "Time"
    )]
    t_end: Option<f64>,
    /// Match with the pose nearest in time, or interpolate the denser trajectory
    #[arg(long = "sync_method", alias = "sync-method", value_name = "METHOD", help_heading = "Time")]
    sync_method: Option<SyncName>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
#[value(rename_all = "snake_case")]
enum SyncName {
    NearestTime,
    Interpolation,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum PlaneName {
    Xy,
    Xz,
    Yz,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum UnitName {
    Deg,
    Rad,
    Mm,
    Cm,
    M,
    Km,
}

impl From<UnitName> for ErrorUnit {
    fn from(name: UnitName) -> Self {
        match name {
            UnitName::Deg => Self::Degrees,
            UnitName::Rad => Self::Radians,
            UnitName::Mm => Self::Millimeters,
            UnitName::Cm => Self::Centimeters,
            UnitName::M => Self::Meters,
            UnitName::Km => Self::Kilometers,
        }
    }
}

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
            notes.iter().for_each(|note| eprintln!("note: {note}"));
        }
        let (reference, estimate) = (path_of(reference)?, path_of(estimate)?);
        let preparation = self.preparation(&reference)?;
        let compared = || format!("{} against {}", estimate_path.display(), reference_path.display());
        let prepared =
            preparation.apply(reference, estimate).map_err(usage_or_failure).with_context(compared)?;
        let mut errors = (metric.errors)(&prepared).map_err(usage_or_failure).with_context(compared)?;
        if let Some(unit) = self.change_unit {
            errors = errors.in_unit(unit.into()).map_err(usage_or_failure)?;
        }
        let stats = Statistics::of(&errors.values).context("there are no errors")?;
        let title = self.title(metric, errors.unit);
        let names = [reference_path, estimate_path].map(|path| path.display().to_string());
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

    /// Reference and estimate, and the formats they must have.
    fn files(&self) -> anyhow::Result<(&PathBuf, &PathBuf, [Option<TrajectoryFormat>; 2])> {
        use TrajectoryFormat::Euroc;
        match self.files.as_slice() {
            [reference, estimate] => Ok((reference, estimate, [None; 2])),
            [word, reference, estimate] => {
                let format = word.to_string_lossy().parse().map_err(Usage)?;
                // As evo has it, but an estimate in EuRoC's own format is found by looking.
                let formats = [Some(format), Some(format).filter(|&format| format != Euroc)];
                Ok((reference, estimate, formats))
            }
            _ => Err(Usage("a reference and an estimate are needed".into()).into()),
        }
    }

    fn preparation(&self, reference: &PosePath) -> anyhow::Result<truth::Preparation> {
        let TimeArgs { t_max_diff, t_offset, t_start, t_end, sync_method } = &self.times;
        let stamped = reference.stamps_s().is_some();
        let timed = [t_max_diff, t_offset, t_start, t_end].iter().any(|option| option.is_some());
        if !stamped && (timed || sync_method.is_some() || self.motion_filter.is_some()) {
            let problem = "trajectories without stamps have no options of time and no motion filter";
            return Err(Usage(problem.into()).into());
        }
        // Zero alone asks for nothing, as in evo.
        let cut = [t_start, t_end].iter().any(|time| time.is_some_and(|time| time != 0.0));
        Ok(truth::Preparation {
            downsample: self.downsample.filter(|&count| count > 0),
            motion_filter: self.motion_filter.as_deref().and_then(|values| match values {
                [distance_m, degrees] => Some((*distance_m, degrees.to_radians())),
                _ => None,
            }),
            start_s: t_start.filter(|_| cut),
            end_s: t_end.filter(|_| cut),
            matching: truth::Matching {
                max_diff_s: t_max_diff.unwrap_or(0.01),
                offset_s: t_offset.unwrap_or(0.0),
                sync: match sync_method {
                    Some(SyncName::Interpolation) => truth::Sync::Interpolation,
                    _ => truth::Sync::NearestTime,
                },
            },
            alignment: truth::Alignment {
                pose: self.align,
                scale: self.correct_scale,
                origin: self.align_origin,
                first: (self.n_to_align != -1).then_some(self.n_to_align),
            },
            plane: self.project_to_plane.map(|plane| match plane {
                PlaneName::Xy => truth::Plane::Xy,
                PlaneName::Xz => truth::Plane::Xz,
                PlaneName::Yz => truth::Plane::Yz,
            }),
        })
    }

    /// The heading, word by word as evo has it.
    fn title(&self, metric: &Metric<'_>, unit: ErrorUnit) -> String {
        let mut title = format!(
            "{} w.r.t. {} ({}){}",
            metric.name.to_uppercase(),
            metric.relation.name(),
            unit.name(),
            metric.title_tail
        );
        title += match (self.align, self.correct_scale, self.align_origin) {
            (true, false, _) => "\n(with SE(3) Umeyama alignment)",
            (true, true, _) => "\n(with Sim(3) Umeyama alignment)",
            (false, true, _) => "\n(scale corrected)",
            (false, false, false) => "\n(not aligned)",
            (false, false, true) => "",
        };
        if (self.align || self.correct_scale) && self.n_to_align != -1 {
            let _ = write!(title, " (aligned poses: {})", self.n_to_align);
        }
        if self.align_origin {
            title += "\n(with origin alignment)";
        }
        if let Some(plane) = self.project_to_plane {
            let _ = write!(title, "\n(projected to {} plane)", format!("{plane:?}").to_lowercase());
        }
        title
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
        let path = path.display();
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
