//! `dmp map`: surfel maps on disk.

mod build;
mod export;
mod info;
mod verify;

use crate::options::Spec;

pub(crate) static SPEC: Spec = Spec {
    name: "map",
    about: "Build, inspect, check and export surfel maps (.dmpmap)",
    commands: &[&build::SPEC, &info::SPEC, &verify::SPEC, &export::SPEC],
    ..Spec::EMPTY
};
