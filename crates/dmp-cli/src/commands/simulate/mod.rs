//! `dmp simulate`: logs and trajectories with known truth.

mod city;
mod error;
mod errors;
mod loops;
mod recording;
mod room;
mod town;

use crate::options::Spec;

pub(crate) static SPEC: Spec = Spec {
    name: "simulate",
    about: "Make logs and trajectories with known truth",
    commands: &[&town::SPEC, &city::SPEC, &room::SPEC, &errors::SPEC, &loops::SPEC],
    ..Spec::EMPTY
};
