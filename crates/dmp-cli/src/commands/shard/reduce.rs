//! `dmp shard reduce`: the result of all parts, as `dmp score` prints it.

use clap::{Args as _, FromArgMatches as _};
use dmp_shard::Shard;

use super::document::{OpenedPlan, in_words};
use crate::commands::score::print;
use crate::console::{Common, Exit, Progress, when_printed};
use crate::gates::GateArgs;
use crate::inputs::announce;
use crate::options::{Asked, Out, Spec, output, scoring, tools};

pub(super) static SPEC: Spec = Spec {
    name: "reduce",
    about: "Add up the results of all parts, and print them as `dmp score` does",
    more: "The scores are those of `dmp score` to the bit; `timing` and `memory` are those of this command. Fails and names a part \
           that is missing, damaged or of another plan, and a scan that is in no part or in two.",
    after: "Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged, or a run was excluded; \
            4 done, but a gate failed.",
    options: &[tools::PLANNED, scoring::MEANS, &[&output::JSON, &output::VERBOSE]],
    extend: GateArgs::augment_args,
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let opened = OpenedPlan::read(&asked.need(&tools::PLAN)?)?;
    let gate_args = GateArgs::from_arg_matches(asked.matches())?;
    let gates = gate_args.start(&opened.plan.names())?;
    let log = opened.unopened_log(asked.get(&tools::MOVED_LOG).as_deref())?;
    let means = Shard::means(&asked.config());
    let OpenedPlan { folder, plan, runs } = &opened;
    let watch = Progress::new(common);
    let report = Shard::new(plan, runs, log.as_ref(), folder, &means, &watch).reduce().map_err(in_words)?;
    drop(watch);
    let checked = gates.check(&report);
    let exit = if plan.is_incomplete() { Exit::InputDamaged } else { Exit::Done };
    let exit = gates.end(&common.host, &report, &checked, exit)?;
    let printed = print(out, &report, &checked, asked, common.terminal);
    if !common.quiet {
        announce::done(&common.host, &report);
    }
    when_printed(printed, exit)
}
