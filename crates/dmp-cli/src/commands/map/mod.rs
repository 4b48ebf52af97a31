//! `dmp map`: surfel maps on disk.

mod build;
mod check;
mod export;
mod info;
mod verify;

use crate::options::Spec;

pub(crate) static SPEC: Spec = Spec {
    name: "map",
    about: "Build, check, inspect, verify and export surfel maps (.dmpmap)",
    commands: &[&build::SPEC, &check::SPEC, &info::SPEC, &verify::SPEC, &export::SPEC],
    ..Spec::EMPTY
};
