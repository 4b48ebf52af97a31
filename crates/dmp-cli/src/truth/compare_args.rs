//! The options that `dmp truth ape` and `dmp truth rpe` share, named as users of evo know them.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use dmp_log::{TimeUnit, TrajectoryFormat};
use dmp_truth::trajectory::{Alignment, ErrorUnit, Matching, PosePath, Preparation, Relation};

use crate::exit::Usage;
use crate::save::is_missing;

/// Words of the command line, with what they stand for.
pub(super) type Words<T> = &'static [(&'static str, T)];

const UNITS: Words<ErrorUnit> = &[
    ("deg", ErrorUnit::Degrees),
    ("rad", ErrorUnit::Radians),
    ("mm", ErrorUnit::Millimeters),
    ("cm", ErrorUnit::Centimeters),
    ("m", ErrorUnit::Meters),
    ("km", ErrorUnit::Kilometers),
];
/// What of the difference of two poses or motions may be the error; only of motions the last.
pub(super) const RELATIONS: Words<Relation> = &[
    ("full", Relation::FullTransformation),
    ("trans_part", Relation::TranslationPart),
    ("rot_part", Relation::RotationPart),
    ("angle_deg", Relation::RotationAngleDeg),
    ("angle_rad", Relation::RotationAngleRad),
    ("point_distance", Relation::PointDistance),
    ("point_distance_error_ratio", Relation::PointDistanceErrorRatio),
];

/// Takes one of the words.
pub(super) fn words<T: Copy + Send + Sync>(words: Words<T>) -> impl TypedValueParser<Value = T> {
    let known = PossibleValuesParser::new(words.iter().map(|(word, _)| *word));
    known.try_map(move |given| {
        words.iter().find(|(word, _)| *word == given).map(|(_, meaning)| *meaning).ok_or("unknown")
    })
}

/// Arguments of both, named as users of evo know them.
#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(crate) struct CompareArgs {
    /// Reference and one estimate or more, after the format of the files (tum, kitti, euroc, npy, g2o or csv) if it is to be
    /// given
    #[arg(value_name = "[FORMAT] REFERENCE ESTIMATE", num_args = 2.., required = true)]
    pub(super) files: Vec<PathBuf>,
    /// Align with Umeyama's method (rotation and translation)
    #[arg(short, long, conflicts_with = "align_origin", help_heading = "Alignment")]
    align: bool,
    /// Correct the scale with Umeyama's method
    #[arg(short = 's', long = "correct_scale", alias = "correct-scale", help_heading = "Alignment")]
    correct_scale: bool,
    /// Align the first pose to the reference's first
    #[arg(long = "align_origin", alias = "align-origin", help_heading = "Alignment")]
    align_origin: bool,
    /// Convert errors to this unit
    #[arg(long = "change_unit", alias = "change-unit", value_name = "UNIT", help_heading = "Error")]
    #[arg(value_parser = words(UNITS))]
    pub(super) change_unit: Option<ErrorUnit>,
    #[command(flatten)]
    pub(super) times: TimeArgs,
    /// Print one JSON object (schema dmp-truth/1; dmp-truth-runs/1 of several estimates)
    #[arg(long, help_heading = "Output")]
    pub(super) json: bool,
    /// Draw trajectories coloured by error, errors over time and way, places and angles over time: FILE.html is a page that needs
    /// no network, FILE.svg one picture
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub(super) plot: Option<PathBuf>,
    /// Open what --plot draws in the browser: that of `BROWSER`, else the one that this system opens pages with
    #[arg(long, requires = "plot", help_heading = "Output")]
    pub(super) view: bool,
    /// Write a result file for `evo_res`; of several estimates one each, FILE.zip becoming FILE.ESTIMATE.zip
    #[arg(long = "save_results", alias = "save-results", value_name = "FILE.zip", help_heading = "Output")]
    pub(super) save_results: Option<PathBuf>,
    /// Put the compared trajectories into the result file too
    #[arg(
        long = "save_traj_in_zip",
        alias = "save-traj-in-zip",
        requires = "save_results",
        help_heading = "Output"
    )]
    pub(super) save_trajectories: bool,
    /// Overwrite a result file that is there
    #[arg(long = "no_warnings", alias = "no-warnings", help_heading = "Output")]
    pub(super) no_warnings: bool,
    /// Print nothing
    #[arg(long, conflicts_with = "json", help_heading = "Output")]
    pub(super) silent: bool,
}

/// How stamps are matched. Not for files without stamps.
#[derive(Debug, Args)]
pub(super) struct TimeArgs {
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
    pub(super) t_start: Option<f64>,
    /// Use the reference only up to this stamp, seconds
    #[arg(
        long = "t_end",
        alias = "t-end",
        value_name = "S",
        allow_negative_numbers = true,
        help_heading = "Time"
    )]
    pub(super) t_end: Option<f64>,
    /// The unit of stamps, for files that are refused without it, as it may be one or another: s, ms, us or ns
    #[arg(long = "time_unit", alias = "time-unit", value_name = "UNIT", help_heading = "Time")]
    pub(super) time_unit: Option<TimeUnit>,
}

/// The files of a comparison, and the formats they must have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Files<'a> {
    pub(super) reference: &'a PathBuf,
    pub(super) reference_format: Option<TrajectoryFormat>,
    /// One at least.
    pub(super) estimates: &'a [PathBuf],
    pub(super) estimate_format: Option<TrajectoryFormat>,
}

impl CompareArgs {
    /// Reference and estimates, and the formats they must have. The first word is a format where it is called like one, or there
    /// is no such file.
    pub(super) fn files(&self) -> anyhow::Result<Files<'_>> {
        let few = || Usage("a reference and an estimate are needed".into());
        let (first, rest) = self.files.split_first().ok_or_else(few)?;
        let format = match (first.to_string_lossy().parse(), rest.len()) {
            (Ok(format), 2..) => Some(format),
            (Err(problem), 2..) if is_missing(first) => return Err(Usage(problem).into()),
            _ => None,
        };
        let files = if format.is_some() { rest } else { &self.files };
        let (reference, estimates) = files.split_first().ok_or_else(few)?;
        Ok(Files {
            reference,
            reference_format: format,
            estimates,
            // As evo has it, but an estimate in EuRoC's own format is found by looking.
            estimate_format: format.filter(|&format| format != TrajectoryFormat::Euroc),
        })
    }

    /// What is done to both before they are compared.
    pub(super) fn preparation(&self, reference: &PosePath) -> anyhow::Result<Preparation> {
        let TimeArgs { t_max_diff, t_offset, t_start, t_end, time_unit } = &self.times;
        let stamped = reference.stamps_s().is_some();
        let timed = [t_max_diff, t_offset, t_start, t_end].iter().any(|option| option.is_some());
        if !stamped && (timed || time_unit.is_some()) {
            let problem = "trajectories without stamps have no options of time";
            return Err(Usage(problem.into()).into());
        }
        // Zero alone asks for nothing, as in evo.
        let cut = [t_start, t_end].iter().any(|time| time.is_some_and(|time| time != 0.0));
        Ok(Preparation {
            start_s: t_start.filter(|_| cut),
            end_s: t_end.filter(|_| cut),
            matching: Matching { max_diff_s: t_max_diff.unwrap_or(0.01), offset_s: t_offset.unwrap_or(0.0) },
            alignment: Alignment { pose: self.align, scale: self.correct_scale, origin: self.align_origin },
        })
    }

    /// The heading, word by word as evo has it.
    pub(super) fn title(&self, metric: &str, relation: Relation, unit: ErrorUnit, tail: &str) -> String {
        let mut title =
            format!("{} w.r.t. {} ({}){}", metric.to_uppercase(), relation.name(), unit.name(), tail);
        title += match (self.align, self.correct_scale, self.align_origin) {
            (true, false, _) => "\n(with SE(3) Umeyama alignment)",
            (true, true, _) => "\n(with Sim(3) Umeyama alignment)",
            (false, true, _) => "\n(scale corrected)",
            (false, false, false) => "\n(not aligned)",
            (false, false, true) => "",
        };
        if self.align_origin {
            title += "\n(with origin alignment)";
        }
        title
    }
}
