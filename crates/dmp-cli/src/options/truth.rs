//! Options of `dmp truth`. Those of `ape` and `rpe` are called as users of evo know them.

use std::path::PathBuf;

use dmp_log::TimeUnit;
use dmp_truth::trajectory::{DeltaUnit, ErrorUnit, Relation};

use super::Group::{Alignment, Error, Input, Measure, Output, Pairs, Time};
use super::values::{self, parsed};
use super::{Entry, Opt, Role, output};
use crate::named::NamedFile;

/// What of the difference of two poses or motions may be the error; only of motions the last.
const RELATIONS: &[(&str, Relation)] = &[
    ("full", Relation::FullTransformation),
    ("trans_part", Relation::TranslationPart),
    ("rot_part", Relation::RotationPart),
    ("angle_deg", Relation::RotationAngleDeg),
    ("angle_rad", Relation::RotationAngleRad),
    ("point_distance", Relation::PointDistance),
    ("point_distance_error_ratio", Relation::PointDistanceErrorRatio),
];

pub(crate) static FILES: Opt<PathBuf> = Opt {
    count: Some((2, usize::MAX)),
    example: "a.tum b.tum",
    help: "Reference and one estimate or more, perhaps after the format of the files: tum, kitti, euroc, npy, g2o or csv",
    ..Opt::argument("files", "[FORMAT] REFERENCE ESTIMATE")
};
pub(crate) static ALIGN: Opt<bool> = Opt {
    short: Some('a'),
    conflicts: &[&ALIGN_ORIGIN],
    help: "Align with Umeyama's method (rotation and translation)",
    ..Opt::switch(Alignment, "align")
};
pub(crate) static CORRECT_SCALE: Opt<bool> = Opt {
    short: Some('s'),
    alias: Some("correct-scale"),
    help: "Correct the scale with Umeyama's method",
    ..Opt::switch(Alignment, "correct_scale")
};
pub(crate) static ALIGN_ORIGIN: Opt<bool> = Opt {
    alias: Some("align-origin"),
    help: "Align the first pose to the reference's first",
    ..Opt::switch(Alignment, "align_origin")
};
pub(crate) static APE_RELATION: Opt<Relation> = Opt {
    short: Some('r'),
    alias: Some("pose-relation"),
    help: "What of the difference of two poses is the error. Default: trans_part",
    ..Opt::words(Error, "pose_relation", "RELATION", RELATIONS.split_at(6).0)
};
pub(crate) static RPE_RELATION: Opt<Relation> = Opt {
    short: Some('r'),
    alias: Some("pose-relation"),
    help: "What of the difference of two motions is the error. Default: trans_part",
    ..Opt::words(Error, "pose_relation", "RELATION", RELATIONS)
};
pub(crate) static CHANGE_UNIT: Opt<ErrorUnit> = Opt {
    alias: Some("change-unit"),
    help: "The unit of the errors",
    ..Opt::words(
        Error,
        "change_unit",
        "UNIT",
        &[
            ("deg", ErrorUnit::Degrees),
            ("rad", ErrorUnit::Radians),
            ("mm", ErrorUnit::Millimeters),
            ("cm", ErrorUnit::Centimeters),
            ("m", ErrorUnit::Meters),
            ("km", ErrorUnit::Kilometers),
        ],
    )
};
pub(crate) static T_MAX_DIFF: Opt<f64> = Opt {
    alias: Some("t-max-diff"),
    help: "Largest difference of matched stamps, seconds. Default: 0.01",
    ..Opt::text(Time, "t_max_diff", "S", "0.1", parsed)
};
pub(crate) static T_OFFSET: Opt<f64> = Opt {
    alias: Some("t-offset"),
    is_signed: true,
    help: "Seconds to add to the estimate's stamps",
    ..Opt::text(Time, "t_offset", "S", "-18", parsed)
};
pub(crate) static T_START: Opt<f64> = Opt {
    alias: Some("t-start"),
    is_signed: true,
    help: "Use the reference only from this stamp on, seconds",
    ..Opt::text(Time, "t_start", "S", "0.5", parsed)
};
pub(crate) static T_END: Opt<f64> = Opt {
    alias: Some("t-end"),
    is_signed: true,
    help: "Use the reference only up to this stamp, seconds",
    ..Opt::text(Time, "t_end", "S", "0.5", parsed)
};
pub(crate) static TIME_UNIT: Opt<TimeUnit> = Opt {
    alias: Some("time-unit"),
    help: "The unit of stamps, where it is ambiguous: s, ms, us or ns",
    ..Opt::text(Time, "time_unit", "UNIT", "us", parsed)
};
pub(crate) static DELTA: Opt<f64> = Opt {
    short: Some('d'),
    is_signed: true,
    help: "Distance of the poses of a pair. Default: 1",
    ..Opt::text(Pairs, "delta", "DELTA", "100", parsed)
};
pub(crate) static DELTA_UNIT: Opt<DeltaUnit> = Opt {
    short: Some('u'),
    alias: Some("delta-unit"),
    help: "Unit of delta: frames, degrees, radians, metres. Default: f",
    ..Opt::words(
        Pairs,
        "delta_unit",
        "UNIT",
        &[
            ("f", DeltaUnit::Frames),
            ("d", DeltaUnit::Degrees),
            ("r", DeltaUnit::Radians),
            ("m", DeltaUnit::Meters),
        ],
    )
};
pub(crate) static ALL_PAIRS: Opt<bool> = Opt {
    alias: Some("all-pairs"),
    help: "A pair from every pose, not only one behind the other",
    ..Opt::switch(Pairs, "all_pairs")
};
pub(crate) static PLOT: Opt<PathBuf> = Opt {
    help: "Draw trajectories coloured by error, and errors over time and path length: FILE.html, a page that needs no network, \
           or FILE.svg",
    ..Opt::path(Output, "plot", "FILE", Role::Written)
};
pub(crate) static SAVE_RESULTS: Opt<PathBuf> = Opt {
    alias: Some("save-results"),
    help: "Write a result file for `evo_res`; of several estimates FILE.ESTIMATE.zip each",
    ..Opt::path(Output, "save_results", "FILE.zip", Role::Written)
};

/// What both share.
pub(crate) const COMPARED: &[&dyn Entry] = &[
    &FILES,
    &ALIGN,
    &CORRECT_SCALE,
    &ALIGN_ORIGIN,
    &CHANGE_UNIT,
    &T_MAX_DIFF,
    &T_OFFSET,
    &T_START,
    &T_END,
    &TIME_UNIT,
    &output::JSON,
    &PLOT,
    &SAVE_RESULTS,
];

pub(crate) static SURFACE: Opt<PathBuf> = Opt {
    help: "The reference: a mesh (PLY with faces, OBJ) or a cloud (LAS, LAZ, PLY), metres",
    ..Opt::argument("reference", "REFERENCE")
};
pub(crate) static MEASURED: Opt<PathBuf> = Opt {
    help: "What is measured: a cloud (LAS, LAZ, PLY) or a map (.dmpmap); with -t the log that the runs' maps are fused from",
    ..Opt::argument("map", "MAP|LOG")
};
pub(crate) static RUNS: Opt<NamedFile> = Opt {
    short: Some('t'),
    is_many: true,
    help: "A run of the log whose map is measured",
    ..Opt::file(Input, "trajectory", "[NAME=]RUN")
};
pub(crate) static ALIGN_MAP: Opt<PathBuf> = Opt {
    is_many: true,
    count: Some((1, 2)),
    example: "a.tum b.tum",
    help: "Move the map by the rigid alignment of its trajectory to the reference's: REFERENCE.tum ESTIMATE.tum, or with -t \
           only REFERENCE.tum",
    ..Opt::path(Input, "align", "REFERENCE ESTIMATE", Role::Read)
};
pub(crate) static CAP: Opt<f64> = Opt {
    help: "Distances are capped at this, metres. Default: 1",
    ..Opt::text(Measure, "cap", "METRES", "2", values::length_m)
};
pub(crate) static THRESHOLDS: Opt<Vec<f64>> = Opt {
    help: "Distances at which accuracy and completeness are printed, metres. Default: those of 0.05,0.1,0.2,0.5 within the cap",
    ..Opt::text(Measure, "thresholds", "METRES,...", "0.1,0.2", values::lengths_m)
};
pub(crate) static THIN: Opt<f64> = Opt {
    help: "Count one point of each voxel of this edge, metres, on both sides, so that density has no weight. Default: every \
           point counts",
    ..Opt::text(Measure, "thin", "METRES", "0.05", values::length_m)
};
pub(crate) static CROP: Opt<bool> = Opt {
    help: "Measure completeness only within the cap of the map's bounding box",
    ..Opt::switch(Measure, "crop")
};
pub(crate) static SPACING: Opt<f64> = Opt {
    help: "For completeness a mesh is sampled once for each square of this edge, metres. Default: 0.1",
    ..Opt::text(Measure, "spacing", "METRES", "0.2", values::length_m)
};

/// Of `dmp truth smd`, besides what is fused from a log.
pub(crate) const SURFACES: &[&dyn Entry] =
    &[&SURFACE, &MEASURED, &RUNS, &ALIGN_MAP, &CAP, &THRESHOLDS, &THIN, &CROP, &SPACING];
