//! `dmp convert`: logs and trajectories in other formats.

mod log;
mod trajectory;

use crate::options::Spec;

pub(crate) static SPEC: Spec = Spec {
    name: "convert",
    about: "Write a log or a trajectory in another format",
    commands: &[&log::SPEC, &trajectory::SPEC],
    ..Spec::EMPTY
};
