//! `dmp shard fuse`, `merge`, `cast`, `drift`: a part of a stage.

use dmp_shard::{Shard, ShardStage};

use super::document::{OpenedPlan, in_words};
use crate::console::{Common, Exit, Progress, say};
use crate::inputs::in_threads;
use crate::options::{Asked, Out, Spec, scoring, tools};

/// A part of any stage.
const PART: Spec = Spec {
    after: "Exit codes: 0 done; 1 failed, also where an earlier part is missing, damaged or of another plan; 2 wrong usage.",
    options: &[tools::PLANNED, &[&tools::PART], scoring::MEANS],
    run,
    ..Spec::EMPTY
};
pub(super) static FUSE: Spec =
    Spec { name: "fuse", about: "Fuse some scans into sums of voxels, with the poses of every run", ..PART };
pub(super) static MERGE: Spec =
    Spec { name: "merge", about: "Make surfels of the sums of some tiles; all parts must be fused", ..PART };
pub(super) static CAST: Spec =
    Spec { name: "cast", about: "Cast some scans into the maps; all parts must be merged", ..PART };
pub(super) static DRIFT: Spec =
    Spec { name: "drift", about: "Register some visits to the same places, to measure drift", ..PART };

fn run(asked: &Asked, common: &Common, _: &mut Out<'_>) -> anyhow::Result<Exit> {
    let stage = ShardStage::ALL.into_iter().find(|stage| stage.name() == asked.spec().name);
    let (stage, part) = (stage.unwrap_or(ShardStage::Fuse), asked.need(&tools::PART)?);
    let opened = OpenedPlan::read(&asked.need(&tools::PLAN)?)?;
    let (config, now_at) = (asked.config(), asked.get(&tools::MOVED_LOG));
    let log = match stage {
        ShardStage::Merge => opened.unopened_log(now_at.as_deref())?,
        _ => in_threads(config.threads, || opened.open_log(now_at.as_deref()))??,
    };
    let means = Shard::means(&config);
    let watch = Progress::new(common);
    let OpenedPlan { folder, plan, runs } = &opened;
    let shard = Shard::new(plan, runs, log.as_ref(), folder, &means, &watch);
    let done = match stage {
        ShardStage::Fuse => shard.fuse(part),
        ShardStage::Merge => shard.merge(part),
        ShardStage::Cast => shard.cast(part),
        _ => shard.drift(part),
    };
    done.map_err(in_words)?;
    drop(watch);
    if let (false, Some(bytes)) = (common.quiet, log.bytes_read().filter(|&bytes| bytes > 0)) {
        let all = log.summary().bytes;
        say!(common.host, "{stage} {part} is done: {bytes} of the log's {all} bytes were read");
    }
    Ok(Exit::Done)
}
