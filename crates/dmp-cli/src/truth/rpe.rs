//! `dmp truth rpe`: the relative pose error, as `evo_rpe` has it.

use clap::Args;
use dmp_truth::trajectory::{DELTA_TOLERANCE, DeltaUnit, PairOptions, Relation, relative};

use super::compare::as_python;
use super::compare_args::{CompareArgs, RELATIONS, Words, words};
use super::compared::{Metric, PairsJson};
use crate::common::Common;
use crate::exit::Exit;

const DELTA_UNITS: Words<DeltaUnit> = &[
    ("f", DeltaUnit::Frames),
    ("d", DeltaUnit::Degrees),
    ("r", DeltaUnit::Radians),
    ("m", DeltaUnit::Meters),
];

/// Relative pose error of a trajectory against a reference, as `evo_rpe`
///
/// Pairs of poses at a distance of delta (frames, metres, degrees or radians) are compared by their
/// relative motion. Options, printed text and numbers are those of `evo_rpe` 1.38.1.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp truth rpe [OPTIONS] [tum|kitti|euroc] REFERENCE ESTIMATE [ESTIMATE2 ...]",
    after_help = "Examples:\n  \
    dmp truth rpe truth.tum run.tum\n  \
    dmp truth rpe kitti gt/00.txt run.txt -d 100 -u m --all_pairs\n  \
    dmp truth rpe truth.tum run.tum -d 10 -u m --all_pairs --plot run.svg\n  \
    dmp truth rpe truth.tum run.tum -d 10 -u d -r angle_deg --json"
)]
pub(crate) struct RpeArgs {
    #[command(flatten)]
    compare: CompareArgs,
    /// What of the difference of two motions is the error
    #[arg(
        short = 'r',
        long = "pose_relation",
        alias = "pose-relation",
        value_name = "RELATION",
        default_value = "trans_part",
        value_parser = words(RELATIONS),
        help_heading = "Error"
    )]
    relation: Relation,
    /// Distance of the poses of a pair [default: 1]
    #[arg(short = 'd', long, value_name = "DELTA", allow_negative_numbers = true, help_heading = "Pairs")]
    delta: Option<f64>,
    /// Unit of delta: frames, degrees, radians, metres
    #[arg(
        short = 'u',
        long = "delta_unit",
        alias = "delta-unit",
        value_name = "UNIT",
        default_value = "f",
        value_parser = words(DELTA_UNITS),
        help_heading = "Pairs"
    )]
    delta_unit: DeltaUnit,
    /// A pair from every pose, not only one behind the other
    #[arg(long = "all_pairs", alias = "all-pairs", help_heading = "Pairs")]
    all_pairs: bool,
}

pub(crate) fn run(
    arguments: &RpeArgs,
    common: &Common,
    out: &mut impl std::io::Write,
) -> anyhow::Result<Exit> {
    let relation = arguments.relation;
    let unit = arguments.delta_unit;
    let RpeArgs { delta, all_pairs, .. } = *arguments;
    // A delta that is not given is a whole number in evo's text, whatever its unit.
    let shown = match delta {
        Some(delta) if unit != DeltaUnit::Frames => as_python(delta),
        delta => format!("{:.0}", delta.unwrap_or(1.0)),
    };
    let options = PairOptions { delta: delta.unwrap_or(1.0), unit, all_pairs };
    let which = if all_pairs { "all" } else { "consecutive" };
    let metric = Metric {
        name: "rpe",
        relation,
        title_tail: format!("\nfor delta = {shown} ({}) using {which} pairs", unit.name()),
        pairs: Some(PairsJson {
            delta: options.delta,
            delta_unit: unit.name(),
            delta_tol: DELTA_TOLERANCE,
            all_pairs,
            from_reference: false,
        }),
        errors: &|prepared| relative(&prepared.reference, &prepared.estimate, relation, &options),
    };
    arguments.compare.run(&metric, common, out)
}
