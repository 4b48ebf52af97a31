//! The seeds: small files that are well, of every format that is read, and the commands that read them.

mod folders;
mod logs;
mod maps;
mod texts;

use std::path::Path;

use crate::trials::{Kind, Shop};

/// What the seeds are made of. Few returns: a command on them takes some hundredths of a second.
const COMMANDS: [&str; 4] = [
    "simulate town -o t.mcap --truth t.tum --truth-rate 4 --seed 1 --scans 16 --rate 2 --speed 7 --beams 8 \
     --elevation=-14,6 --azimuth-steps 48 --max-range 60 --resolution 0.0625",
    // A way long enough for places to choose among, and for loops.
    "simulate town -o q.mcap --truth q.tum --truth-rate 2 --seed 1 --scans 40 --rate 1 --speed 15 --beams 4 \
     --elevation=-14,6 --azimuth-steps 36 --max-range 60 --resolution 0.0625",
    // A pose a scan.
    "simulate town -o s.mcap --truth scans.tum --truth-rate 2 --seed 1 --scans 16 --rate 2 --speed 7 --beams 8 \
     --elevation=-14,6 --azimuth-steps 48 --max-range 60 --resolution 0.0625",
    "simulate room -o room --size 40x30 --frames 8 --rate 1",
];

/// Every kind of input with its seeds.
pub(super) fn kinds(dmp: &Path) -> anyhow::Result<Vec<Kind>> {
    let shop = Shop::open(dmp)?;
    for line in COMMANDS {
        shop.make(line)?;
    }
    let mut kinds = logs::kinds(&shop)?;
    kinds.extend(folders::kinds(&shop)?);
    kinds.extend(texts::kinds(&shop)?);
    kinds.extend(maps::kinds(&shop)?);
    Ok(kinds)
}
