use dmp_log::ScanLog;
use dmp_map::{DensityProbe, Lattice};
use dmp_sensor::{EgoMask, EgoVotes, ReturnFilter, Scan};

use super::{Segments, VoxelChoice};
use crate::config::{Config, Ego, Run};
use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::pose::{Poser, RunPoses};
use crate::watch::{Stage, Watch};

/// Scans that vote on the vehicle, spread evenly over the log.
const EGO_SCANS: usize = 50;
/// A log that travels less than this, metres, may stand still for most of its scans: then everything
/// would look like the vehicle.
const EGO_TRAVEL_M: f64 = 20.0;
/// Blocks of successive scans in which the density is looked at, scans of one, and where one ends at
/// the latest.
const BLOCKS: usize = 5;
const BLOCK_SCANS: usize = 20;
const BLOCK_RETURNS: u64 = 1_500_000;
/// The voxel edges to choose from, metres, and the share of returns in filled voxels that is enough.
const VOXELS_M: [f64; 3] = [0.2, 0.3, 0.5];
const FILLED_SHARE: f64 = 0.7;

/// Which returns are used: the ranges, and the vehicle as it is found or given.
pub(super) fn filter(
    log: &dyn ScanLog,
    frames: &[PlannedFrame],
    segments: &Segments,
    config: &Config,
    watch: &dyn Watch,
) -> Result<ReturnFilter, EvaluateError> {
    let Config { min_range_m, max_range_m, .. } = *config;
    let mut filter = ReturnFilter { min_range_m, max_range_m, ego: EgoMask::default() };
    match config.ego {
        Ego::None => {}
        Ego::BoxMm(min, max) => filter.ego = EgoMask::from_box_mm(min, max),
        Ego::Auto if segments.travel_m < EGO_TRAVEL_M => {}
        Ego::Auto => {
            let voters = spread(frames.len(), EGO_SCANS);
            watch.begin(Stage::Survey, voters.len() as u64);
            let (mut reader, mut scan) = (log.reader()?, Scan::default());
            let mut votes = EgoVotes::default();
            for ordinal in voters {
                reader.read(frames[ordinal].frame, &mut scan)?;
                let used = scan.points_in_sensor_m.iter().filter(|&&point| filter.check(point).is_ok());
                votes.add_scan(used.copied());
                watch.advance(1);
            }
            filter.ego = votes.mask();
        }
    }
    Ok(filter)
}

/// The smallest edge at which enough returns share their voxel with two others, in the run that
/// gathers them best: a poor trajectory scatters what a good one gathers, and density is a matter of
/// the sensor and the drive.
pub(super) fn voxel(
    log: &dyn ScanLog,
    frames: &[PlannedFrame],
    runs: &[Run],
    poses: &[RunPoses<'_>],
    filter: &ReturnFilter,
    config: &Config,
    watch: &dyn Watch,
) -> Result<VoxelChoice, EvaluateError> {
    if let Some(voxel_m) = config.voxel_m {
        return Ok(VoxelChoice { voxel_m, filled_share: None });
    }
    let blocks = blocks_of(frames);
    watch.begin(Stage::Survey, blocks.iter().map(ExactSizeIterator::len).sum::<usize>() as u64);
    let mut shares = [0.0f64; VOXELS_M.len()];
    let mut probes = vec![[DensityProbe::default(); VOXELS_M.len()]; runs.len()];
    let mut reader = log.reader()?;
    let mut scan = Scan::default();
    let mut poser = Poser::new(poses, filter);
    let lattices = VOXELS_M.iter().map(|&voxel_m| Lattice::new(voxel_m)).collect::<Result<Vec<_>, _>>();
    let lattices = lattices.map_err(EvaluateError::Work)?;
    for block in blocks {
        let mut points = vec![Vec::new(); runs.len()];
        for ordinal in block.clone() {
            let frame = &frames[ordinal];
            reader.read(frame.frame, &mut scan)?;
            poser.blocks(frame, &scan, |rays| {
                for (points, rays) in points.iter_mut().zip(rays) {
                    points.extend(rays.iter().map(dmp_sensor::Ray::endpoint_in_world));
                }
                Ok::<(), EvaluateError>(())
            })?;
            watch.advance(1);
        }
        for ((probes, points), run) in probes.iter_mut().zip(&points).zip(runs) {
            for (probe, lattice) in probes.iter_mut().zip(&lattices) {
                let block = DensityProbe::of_block(lattice, points.iter().copied());
                probe.merge(&block.map_err(EvaluateError::map_of(&run.name))?);
            }
        }
    }
    for probes in &probes {
        for (share, probe) in shares.iter_mut().zip(probes) {
            *share = share.max(probe.filled_share().unwrap_or(0.0));
        }
    }
    let chosen = shares.iter().position(|&share| share >= FILLED_SHARE).unwrap_or(VOXELS_M.len() - 1);
    Ok(VoxelChoice { voxel_m: VOXELS_M[chosen], filled_share: Some(shares[chosen]) })
}

/// Up to `count` of `total` ordinals, evenly spread.
fn spread(total: usize, count: usize) -> Vec<usize> {
    let count = count.min(total);
    (0..count).map(|k| k * total / count).collect()
}

/// Blocks of successive frames, evenly spread over the log, none of them over another.
fn blocks_of(frames: &[PlannedFrame]) -> Vec<std::ops::Range<usize>> {
    let mut blocks: Vec<std::ops::Range<usize>> = Vec::new();
    for start in spread(frames.len(), BLOCKS) {
        let start = start.max(blocks.last().map_or(0, |block| block.end));
        let (mut end, mut returns) = (start, 0);
        while end < frames.len() && end - start < BLOCK_SCANS && returns < BLOCK_RETURNS {
            returns += frames[end].returns;
            end += 1;
        }
        if end > start {
            blocks.push(start..end);
        }
    }
    blocks
}
