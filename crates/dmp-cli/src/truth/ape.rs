//! `dmp truth ape`: the absolute pose error, as `evo_ape` has it.

use clap::Args;
use dmp_truth::trajectory::{Relation, absolute};

use super::compare_args::{CompareArgs, RELATIONS, Words, words};
use super::compared::Metric;
use crate::common::Common;
use crate::exit::Exit;

const OF_POSES: Words<Relation> = RELATIONS.split_at(6).0;

/// Absolute pose error of a trajectory against a reference, as `evo_ape`
///
/// Poses are brought together by their stamps (KITTI files: line by line), the estimate is aligned if
/// asked, and the errors of all poses are summed up. Options, printed text and numbers are those of
/// `evo_ape` 1.38.1.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp truth ape [OPTIONS] [tum|kitti|euroc] REFERENCE ESTIMATE [ESTIMATE2 ...]",
    after_help = "Examples:\n  \
    dmp truth ape truth.tum run.tum -a\n  \
    dmp truth ape kitti gt/00.txt run.txt -as\n  \
    dmp truth ape euroc data.csv run.tum -a -r angle_deg --json\n  \
    dmp truth ape truth.tum kiss.tum lio.csv -a --plot runs.html\n  \
    dmp truth ape truth.tum run.tum -a --save_results run.zip && evo_res run.zip"
)]
pub(crate) struct ApeArgs {
    #[command(flatten)]
    compare: CompareArgs,
    /// What of the difference of two poses is the error
    #[arg(
        short = 'r',
        long = "pose_relation",
        alias = "pose-relation",
        value_name = "RELATION",
        default_value = "trans_part",
        value_parser = words(OF_POSES),
        help_heading = "Error"
    )]
    relation: Relation,
}

pub(crate) fn run(
    arguments: &ApeArgs,
    common: &Common,
    out: &mut impl std::io::Write,
) -> anyhow::Result<Exit> {
    let relation = arguments.relation;
    let metric = Metric {
        name: "ape",
        relation,
        title_tail: String::new(),
        pairs: None,
        errors: &|prepared| absolute(&prepared.reference, &prepared.estimate, relation),
    };
    arguments.compare.run(&metric, common, out)
}
