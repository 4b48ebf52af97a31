//! `dmp shard inputs`: what a part reads, for schedulers that copy files.

use std::io::Write as _;

use dmp_shard::Shard;

use super::document::{OpenedPlan, in_words};
use crate::console::{Common, Exit};
use crate::options::{Asked, Out, Spec, scoring, tools};

pub(super) static SPEC: Spec = Spec {
    name: "inputs",
    about: "Print as JSON what a part reads: of which files which bytes",
    more: "For schedulers that copy files to where parts run. `log` has the files of the log (`null`: all of it), `files` those of \
           the plan's folder besides plan.json and *.part, which every part reads and which must exist. Other bytes are never \
           read: a file of the same length with holes is enough.",
    options: &[tools::PLANNED, &[&tools::STAGE, &tools::PART], scoring::MEANS],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, _: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let opened = OpenedPlan::read(&asked.need(&tools::PLAN)?)?;
    let log = opened.unopened_log(asked.get(&tools::MOVED_LOG).as_deref())?;
    let means = Shard::means(&asked.config());
    let OpenedPlan { folder, plan, runs } = &opened;
    let shard = Shard::new(plan, runs, log.as_ref(), folder, &means, ());
    let (stage, part) = (asked.need(&tools::STAGE)?, asked.need(&tools::PART)?);
    let needs = shard.needs(stage, part).map_err(in_words)?;
    serde_json::to_writer(&mut *out, &needs).map_err(std::io::Error::from)?;
    writeln!(out)?;
    Ok(Exit::Done)
}
