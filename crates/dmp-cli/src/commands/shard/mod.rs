//! `dmp shard`: a score in parts, for any scheduler.

mod document;
mod inputs;
mod part;
mod plan;
mod reduce;

use crate::options::Spec;

pub(crate) static SPEC: Spec = Spec {
    name: "shard",
    about: "Score in parts on any number of machines: plan, fuse, merge, cast, drift, reduce",
    more: "`plan` decides what all parts must agree on, and writes it to a folder. Every part of a stage is a command that reads \
           and writes files there. Parts of a stage may run at the same time, in any order, and again: they write the same \
           bytes. All parts of a stage must be done before the next stage; `drift` needs only the plan. `reduce` prints the \
           scores of `dmp score`, to the bit.",
    after: "Example, on one machine:\n  \
            dmp shard plan drive.mcap -t a.tum -t b.tum -o work\n  \
            for i in 1 2 3 4; do dmp shard fuse work --part $i/4; done\n  \
            dmp shard merge work --part 1/1\n  \
            for i in 1 2 3 4; do dmp shard cast work --part $i/4; done\n  \
            dmp shard drift work --part 1/1\n  \
            dmp shard reduce work",
    commands: &[
        &plan::SPEC,
        &part::FUSE,
        &part::MERGE,
        &part::CAST,
        &part::DRIFT,
        &reduce::SPEC,
        &inputs::SPEC,
    ],
    ..Spec::EMPTY
};
