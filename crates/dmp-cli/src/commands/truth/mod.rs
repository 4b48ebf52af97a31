//! `dmp truth`: comparison with ground truth.

mod compare;
mod compared;
mod files;
mod plot;
mod results_zip;
mod smd;
mod summary;

use crate::options::Spec;

pub(crate) static SPEC: Spec = Spec {
    name: "truth",
    about: "Compare with ground truth",
    commands: &[&compare::APE, &compare::RPE, &smd::SPEC],
    ..Spec::EMPTY
};
