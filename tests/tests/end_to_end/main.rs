//! The project seen from outside: whole evaluations against slow oracles and real recordings, the
//! command with good and bad input.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(
    clippy::assigning_clones,
    clippy::format_collect,
    clippy::format_push_string,
    clippy::implicit_clone,
    clippy::items_after_statements,
    clippy::type_complexity,
    reason = "tables of cases read better as they are; nothing here is hot"
)]

mod alone;
mod apart;
mod bad_input;
mod browser;
mod budget;
mod command;
mod common;
mod compare;
mod contradictions;
mod conventions;
mod counts;
mod determinism;
mod direct;
mod disk;
mod drawn;
mod drift;
mod examples;
mod formats;
mod gallery;
mod gates;
mod given_maps;
mod kept;
mod loops;
mod manual;
mod map_command;
mod mesh_maps;
mod null;
mod pages;
mod paper;
mod pinhole;
mod quick;
mod real;
mod repair;
mod report;
mod residuals;
mod resume;
#[path = "../../../crates/dmp-log/tests/it/ros1.rs"]
#[allow(dead_code, reason = "the tests of the reader use more of it")]
mod ros1;
mod scene;
mod shard;
mod simulated_room;
mod sink;
mod store_format;
mod suite;
mod trails;
mod truth_runs;
mod truth_surface;
mod truth_trajectory;
