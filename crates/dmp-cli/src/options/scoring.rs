//! Options of how returns become a score, and of the means for it.

use std::path::PathBuf;
use std::time::Duration;

use dmp::{CastReturns, Confidence, DriftPairs, Ego, LengthUnit, Scales, SegmentLength};

use super::Group::{Input, Resources, ReturnsAndMap, Sampling, Verdicts};
use super::values::{self, parsed};
use super::{Entry, Opt, Role, input, output};

pub(crate) static SCALES: Opt<Option<Scales>> = Opt {
    sets: Some(|config, scales| config.scales = scales),
    help: "The truncations of the scores and the defaults that go with them: `drive` (R_cv at 10, 2, 0.5 and 0.2 m) or `room` \
           (a tenth). Default: room for depth cameras, else drive",
    ..Opt::text(ReturnsAndMap, "scales", "SCALES", "room", values::scales)
};
pub(crate) static MIN_RANGE: Opt<f64> = Opt {
    sets: Some(|config, metres| config.min_range_m = Some(metres)),
    help: "Smallest range used, metres. Default: 1.5, in a room 0.3",
    ..Opt::text(ReturnsAndMap, "min-range", "METRES", "2", values::length_m)
};
pub(crate) static MAX_RANGE: Opt<f64> = Opt {
    sets: Some(|config, metres| config.max_range_m = Some(metres)),
    help: "Largest range used, metres. Default: 100, in a room 10",
    ..Opt::text(ReturnsAndMap, "max-range", "METRES", "60m", values::length_m)
};
pub(crate) static EGO: Opt<Ego> = Opt {
    is_signed: true,
    sets: Some(|config, ego| config.ego = ego),
    help: "The vehicle, whose returns are excluded: `auto` (what moves with the sensor), `none`, or a box in the sensor frame, \
           metres: xmin,ymin,zmin,xmax,ymax,zmax. Default: auto",
    ..Opt::text(ReturnsAndMap, "ego", "EGO", "-1,-1,-2,1,1,0.5", values::ego)
};
pub(crate) static VOXEL: Opt<Option<f64>> = Opt {
    sets: Some(|config, metres| config.voxel_m = metres),
    help: "Edge of a voxel, metres. Default: `auto`, 0.2, 0.3 or 0.5 by the density of the scans, in a room a tenth",
    ..Opt::text(ReturnsAndMap, "voxel", "METRES", "0.2", values::auto_length)
};
pub(crate) static SEGMENT: Opt<Option<SegmentLength>> = Opt {
    sets: Some(|config, length| config.segment = length),
    help: "Length of a segment, as `12m`, `2s` or `30scans`: a return is not compared with what its own segment and the two \
           beside it saw. Default: `auto`, 12 m or a sixteenth of a shorter drive; in a room a sixteenth of the scans",
    ..Opt::text(ReturnsAndMap, "segment", "LENGTH", "2s", values::segment)
};
pub(crate) static DRIFT: Opt<DriftPairs> = Opt {
    alone: Some("all"),
    sets: Some(|config, pairs| config.drift = pairs),
    conflicts: &[&QUICK],
    help: "Measure drift in metres on at most N pairs of visits to the same places, on `all` or on `none`. Default: a pair \
           for each two segments; `--drift` alone: all. Drift decides between runs where the scores do not",
    ..Opt::text(ReturnsAndMap, "drift", "N", "50", values::drift_pairs)
};
pub(crate) static MAP_UNIT: Opt<Option<LengthUnit>> = Opt {
    sets: Some(|config, unit| config.map_unit = unit),
    help: "The unit of a cloud or mesh: m, ft or us-ft. Default: `auto`, what the file says, else metres",
    ..Opt::text(Input, "map-unit", "UNIT", "ft", values::unit)
};

pub(crate) static CONFIDENCE: Opt<Confidence> = Opt {
    sets: Some(|config, confidence| config.confidence = confidence),
    help: "Confidence of all verdicts by scores together, and of all by drift: over all pairs and scales, the family-wise error \
           rate is what it leaves. \
           Default: 99%",
    ..Opt::text(Verdicts, "confidence", "P%", "95%", values::confidence)
};
pub(crate) static SAME_WITHIN: Opt<f64> = Opt {
    sets: Some(|config, length_m| config.same_within_m = Some(length_m)),
    help: "Two runs are the same where, at every place, they put 95 % of the points no farther apart than this along the way, \
           and twice this between visits. Default: 4cm, in a room 4mm",
    ..Opt::text(Verdicts, "same-within", "LENGTH", "3cm", values::length_m)
};

pub(crate) static RETURNS: Opt<CastReturns> = Opt {
    sets: Some(|config, returns| config.returns = returns),
    help: "Cast one of every few consecutive returns of a scan, or `all`. The maps are made of all returns. Default: 1/8 of a long \
           log, less of dense scans, more of a short log; all with --residuals",
    ..Opt::text(Sampling, "returns", "SHARE", "1/4", values::returns)
};
pub(crate) static QUICK: Opt<bool> = Opt {
    is_short_help: true,
    conflicts: &[
        &input::MAPS,
        &input::EVERY,
        &RESUME,
        &output::RESIDUALS,
        &output::PER_FRAME,
        &output::PER_TILE,
        &output::SCENE,
        &output::KEEP,
        &output::REFERENCE,
    ],
    help: "Score every 32nd scan, then every 16th, 8th and 4th, until all pairs of runs are decided; each look has a hundred scans or more, \
           and maps of these scans alone. Of a log with an index only what these scans lie in is read. All of a log below 400 scans is scored",
    ..Opt::switch(Sampling, "quick")
};

pub(crate) static MEMORY: Opt<usize> = Opt {
    is_short_help: true,
    sets: Some(|config, bytes| config.memory_bytes = bytes),
    help: "Memory to aim for, as 2GiB or 500MB, or `unlimited`; the rest is spilled to --work. Fails if too small; the error \
           states the minimum. Default: a quarter of the machine's",
    ..Opt::text(Resources, "memory", "SIZE", "2GiB", values::memory_bytes)
};
pub(crate) static THREADS: Opt<usize> = Opt {
    sets: Some(|config, threads| config.threads = threads),
    help: "Threads. Default: one for each core",
    ..Opt::text(Resources, "threads", "N", "4", parsed)
};
pub(crate) static WORK: Opt<PathBuf> = Opt {
    sets: Some(|config, folder| config.work_folder = folder),
    help: "Folder for scratch files and temporary maps. Default: the system's folder for temporary files",
    ..Opt::path(Resources, "work", "FOLDER", Role::Scratch)
};
pub(crate) static RESUME: Opt<Option<Duration>> = Opt {
    alone: Some("30"),
    sets: Some(|config, every| {
        config.resume = true;
        config.checkpoint_every = every;
    }),
    help: "Resume the same command from its last checkpoint in --work, where there is one. With a number: write checkpoints \
           after each so many seconds. Default: 30",
    ..Opt::text(Resources, "resume", "SECONDS", "5", values::every)
};

/// What scores depend on besides the runs, for fused maps.
pub(crate) const MAPPING: &[&dyn Entry] =
    &[&input::EVERY, &SCALES, &MIN_RANGE, &MAX_RANGE, &EGO, &VOXEL, &SEGMENT];
/// What may be taken of the machine.
pub(crate) const MEANS: &[&dyn Entry] = &[&MEMORY, &THREADS, &WORK];
/// What `dmp score` and `dmp shard plan` evaluate, and how, besides the runs.
pub(crate) const EVALUATION: &[&dyn Entry] = &[&input::MAPS, &DRIFT, &CONFIDENCE, &SAME_WITHIN, &RETURNS];
/// Which returns are used, as drift, repair and calibrate need them.
pub(crate) const RANGES: &[&dyn Entry] = &[&SCALES, &MIN_RANGE, &MAX_RANGE, &EGO];
