//! `dmp simulate`: logs and trajectories with known truth.

mod city;
mod errors;
mod loops;
mod recording;
mod room;
mod town;

use dmp_sim::SimError;

use crate::exit::Usage;
use crate::options::Spec;

pub(crate) static SPEC: Spec = Spec {
    name: "simulate",
    about: "Make logs and trajectories with known truth",
    commands: &[&town::SPEC, &city::SPEC, &room::SPEC, &errors::SPEC, &loops::SPEC],
    ..Spec::EMPTY
};

/// A number out of range, or a route of other scenery, is wrong usage; any other error is a failure.
fn in_words(error: SimError) -> anyhow::Error {
    match error {
        SimError::OutOfRange { .. } | SimError::OtherPlace { .. } => Usage(error.to_string()).into(),
        other => other.into(),
    }
}
