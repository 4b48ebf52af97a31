//! Options of what is written and printed.

use std::path::PathBuf;

use super::Group::{Output, Plain};
use super::{Entry, Opt, Role};
use crate::named::NamedFile;

pub(crate) static QUIET: Opt<bool> = Opt {
    short: Some('q'),
    is_short_help: true,
    help: "Print only errors and results; no progress bar",
    ..Opt::switch(Plain, "quiet")
};
pub(crate) static JSON: Opt<bool> = Opt {
    is_short_help: true,
    help: "Print one JSON object instead of tables; docs/json.md has the schema",
    ..Opt::switch(Output, "json")
};
pub(crate) static VERBOSE: Opt<bool> = Opt {
    short: Some('v'),
    is_short_help: true,
    conflicts: &[&JSON],
    help: "Also print all scales of all pairs, all scores, where returns went, times and memory",
    ..Opt::switch(Output, "verbose")
};
pub(crate) static REPORT: Opt<PathBuf> = Opt {
    is_short_help: true,
    help: "Write a page, FILE.html: the ranking in words, maps from above, where and when runs are wrong. It needs no network",
    ..Opt::path(Output, "report", "FILE", Role::Written)
};
pub(crate) static REFERENCE: Opt<String> = Opt {
    requires: &[&REPORT],
    help: "The run that is ground truth: the page shows where it is worse than the others",
    ..Opt::text(Output, "reference", "NAME", "a", super::values::parsed)
};
pub(crate) static SCENE: Opt<PathBuf> = Opt {
    help: "Write a scene for viewers such as rerun and Foxglove, FILE.mcap: for each run the map coloured by residual, the \
           path, residuals over time, single returns and the worst places",
    ..Opt::path(Output, "scene", "FILE", Role::Written)
};
pub(crate) static KEEP: Opt<PathBuf> = Opt {
    is_short_help: true,
    help: "Keep the result with the residual of every return, FILE.dmp, about two bytes a return and run: `dmp compare` then \
           compares these runs with those of other days",
    ..Opt::path(Output, "keep", "FILE", Role::Written)
};
pub(crate) static RESIDUALS: Opt<NamedFile> = Opt {
    is_many: true,
    role: Role::WrittenByRun,
    help: "Write every scored return with its residuals to FILE.laz, .las, .ply or .pcd (world coordinates) or .mcap (scan by \
           scan). Of several runs, out.laz becomes out.NAME.laz for each",
    ..Opt::file(Output, "residuals", "[NAME=]FILE")
};
pub(crate) static PER_FRAME: Opt<PathBuf> = Opt {
    help: "Write the scores of every run in every scored scan, FILE.csv",
    ..Opt::path(Output, "per-frame", "FILE", Role::Written)
};
pub(crate) static PER_TILE: Opt<PathBuf> = Opt {
    sets: Some(|config, _| config.per_tile = true),
    help: "Write the scores of every run in every tile of the ground, FILE.csv",
    ..Opt::path(Output, "per-tile", "FILE", Role::Written)
};
/// What `dmp score` writes and prints.
pub(crate) const OF_SCORE: &[&dyn Entry] =
    &[&JSON, &VERBOSE, &REPORT, &REFERENCE, &SCENE, &KEEP, &RESIDUALS, &PER_FRAME, &PER_TILE];
