//! The map of a graph: its scans as rigid patches, one around each keyframe, read from the log once.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use dmp::{Config, PosedLog, PosedScan, Progress, Scales};
use dmp_disk::WorkFolder;
use dmp_log::ScanLog;
use dmp_map::{Lattice, MapError, PatchBuilder, PatchWriter, Patches, Placement};
use dmp_sensor::{Isometry3, Ray, ReturnCounts};

use super::rays::{KeyframeRays, RayInPatch, is_drawn};
use crate::{Keyframes, LoopError};

/// Most rays that are held and cast into each map, of all keyframes together: some 40 MB with what they leave.
const MOST_RAYS: usize = 1_000_000;

/// A path shorter than this many stretches is cut into this many shorter ones. Only those with a keyframe count, so that there are
/// fewer where keyframes are few, or stand close to each other with gaps between; where none moved, there is one.
const FEWEST_STRETCHES: f64 = 20.0;

/// How the map of a graph is made and scored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapOptions {
    /// Rays of each keyframe that are cast, about; of more than a million in all each keyframe has fewer.
    pub rays_per_keyframe: usize,
    /// A place where no patch moved more than this against the others there is as it was, metres; 0 looks at all. `None`:
    /// 0.02 m, in a room 0.002 m.
    pub moved_m: Option<f64>,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self { rays_per_keyframe: 2048, moved_m: None }
    }
}

impl MapOptions {
    /// Checks every option by itself.
    ///
    /// # Errors
    /// The first that makes no sense.
    pub fn check(&self) -> Result<(), LoopError> {
        if self.rays_per_keyframe == 0 {
            let why = "it must be 1 or more";
            return Err(LoopError::Setting { setting: "rays of a keyframe", value: 0.0, why });
        }
        if let Some(value) = self.moved_m.filter(|&m| !(m >= 0.0 && m.is_finite())) {
            let why = "it must be a length of 0 m or more";
            return Err(LoopError::Setting { setting: "motion of a place", value, why });
        }
        Ok(())
    }
}

/// The scans of a log as rigid patches around the keyframes of a graph, and a sample of their rays.
///
/// The log is read once. What is rigid: all returns nearer in time to a keyframe than to others, as they lie to it where
/// the graph's poses are those that the patches were made at.
#[derive(Debug)]
pub struct LoopMap {
    pub(super) patches: Patches,
    pub(super) rays: Vec<KeyframeRays>,
    /// For each keyframe the stretch of the drive that it is in.
    pub(super) stretches: Vec<usize>,
    pub(super) options: MapOptions,
    pub(super) max_range_m: f64,
    pub(super) scales: Scales,
    /// Memory for the tiles of one map, bytes, and maps that are put together at a time.
    pub(super) tile_bytes: usize,
    threads: usize,
    counts: ReturnCounts,
    scans: usize,
}

/// A keyframe whose scans are not all there yet.
struct Open {
    scans_left: usize,
    patch: PatchBuilder,
    rays: Vec<RayInPatch>,
}

impl LoopMap {
    /// Reads the log and makes a patch of the scans of every keyframe, at the poses `world_from_body` of the keyframes.
    ///
    /// # Errors
    /// When log and keyframes do not belong together, the log is damaged beyond what can be excluded, the work folder is
    /// full, or a setting makes no sense.
    pub fn new(
        log: &dyn ScanLog,
        keyframes: &Keyframes,
        world_from_body: &[Isometry3<f64>],
        config: &Config,
        options: MapOptions,
        progress: &dyn Progress,
    ) -> Result<Self, LoopError> {
        let run = keyframes.run("graph", world_from_body)?;
        let posed = PosedLog::new(log, &run, config, progress)?;
        let of_scan: Vec<usize> =
            posed.scans().map(|scan| keyframes.nearest(scan.stamp_ns, scan.number)).collect();
        Self::of_posed(&posed, &of_scan, world_from_body, options)
    }

    /// The same of a log with the poses of a run, and for each of its scans in use the keyframe that it belongs to; these are at
    /// `world_from_body`, in the world of the run.
    pub(crate) fn of_posed(
        posed: &PosedLog<'_>,
        of_scan: &[usize],
        world_from_body: &[Isometry3<f64>],
        options: MapOptions,
    ) -> Result<Self, LoopError> {
        options.check()?;
        let (settings, means) = (posed.settings(), posed.means());
        let lattice = Lattice::new(posed.voxel_m())?;
        let folder = WorkFolder::new(&means.work_folder).map_err(MapError::from)?;
        let count = world_from_body.len();
        let writer = PatchWriter::new(lattice, count, folder.path())?;

        let scans: Vec<PosedScan> = posed.scans().collect();
        let mut left = vec![(0, 0); count];
        for (scan, &keyframe) in scans.iter().zip(of_scan) {
            left[keyframe].0 += 1;
            left[keyframe].1 += scan.returns;
        }
        let used = left.iter().filter(|(scans, _)| *scans > 0).count().max(1);
        let rays_each = options.rays_per_keyframe.min(MOST_RAYS / used).max(1) as f64;
        let open: Mutex<BTreeMap<usize, Open>> = Mutex::default();
        let rays: Mutex<Vec<KeyframeRays>> = Mutex::new(vec![KeyframeRays::default(); count]);
        let body_from_world: Vec<_> = world_from_body.iter().map(Isometry3::inverse).collect();
        let take = |ordinal: usize, of_scan_rays: &[Ray]| -> Result<(), LoopError> {
            let keyframe = of_scan[ordinal];
            let body_from_world = &body_from_world[keyframe];
            let (scans_left, returns) = left[keyframe];
            let mut patch = PatchBuilder::new(lattice);
            let in_patch =
                |ray: &Ray| (body_from_world * nalgebra::Point3::from(ray.endpoint_in_world())).coords.into();
            patch.add(&of_scan_rays.iter().map(in_patch).collect::<Vec<_>>())?;
            let share = rays_each / returns.max(1) as f64;
            let drawn =
                of_scan_rays.iter().enumerate().filter(|(k, _)| is_drawn(scans[ordinal].number, *k, share));
            let drawn: Vec<_> = drawn.map(|(_, ray)| RayInPatch::of(body_from_world, ray)).collect();
            let done = {
                let mut open = open.lock().unwrap_or_else(PoisonError::into_inner);
                let empty = || Open { scans_left, patch: PatchBuilder::new(lattice), rays: Vec::new() };
                let of_keyframe = open.entry(keyframe).or_insert_with(empty);
                of_keyframe.scans_left -= 1;
                of_keyframe.patch.merge(patch);
                of_keyframe.rays.extend(drawn);
                if of_keyframe.scans_left == 0 { open.remove(&keyframe) } else { None }
            };
            if let Some(Open { patch, rays: drawn, .. }) = done {
                let grouped = KeyframeRays::new(drawn, settings.scales);
                rays.lock().unwrap_or_else(PoisonError::into_inner)[keyframe] = grouped;
                writer.put(keyframe, patch)?;
            }
            Ok(())
        };
        let counts = posed.each(&take)?;
        Ok(Self {
            patches: writer.finish()?,
            stretches: stretches(world_from_body, settings.scales),
            rays: rays.into_inner().unwrap_or_else(PoisonError::into_inner),
            options,
            max_range_m: settings.max_range_m,
            scales: settings.scales,
            tile_bytes: means.patched_tiles_bytes(),
            threads: means.threads,
            counts,
            scans: scans.len(),
        })
    }

    /// What became of the returns of the log.
    pub fn counts(&self) -> &ReturnCounts {
        &self.counts
    }

    /// Scans in use.
    pub fn scans(&self) -> usize {
        self.scans
    }

    /// A place where no patch moved more than this is as it was, metres.
    pub fn moved_m(&self) -> f64 {
        self.options.moved_m.unwrap_or(self.scales.lengths().loop_map.moved_m)
    }

    /// Edge of the voxels, metres.
    pub fn voxel_m(&self) -> f64 {
        self.patches.lattice().voxel_m()
    }

    /// The lengths by which returns are judged.
    pub fn scales(&self) -> Scales {
        self.scales
    }

    /// Keyframes that have scans.
    pub fn keyframes_seen(&self) -> usize {
        self.rays.iter().filter(|rays| !rays.all().is_empty()).count()
    }

    /// Rays that are cast into each map.
    pub fn rays(&self) -> usize {
        self.rays.iter().map(|rays| rays.all().len()).sum()
    }

    /// Bytes of the patches, which lie in a file while they are needed.
    pub fn patch_bytes(&self) -> u64 {
        self.patches.file_bytes()
    }

    /// Maps that are put together at a time.
    pub(crate) fn threads(&self) -> usize {
        self.threads
    }
}

/// Cuts the path through the keyframes.
fn stretches(world_from_body: &[Isometry3<f64>], scales: Scales) -> Vec<usize> {
    let places = || world_from_body.iter().map(|pose| pose.translation.vector);
    let steps_m = places().zip(places().skip(1)).map(|(a, b)| (b - a).norm());
    let along_m: Vec<f64> = std::iter::once(0.0)
        .chain(steps_m.scan(0.0, |along_m, step_m| {
            *along_m += step_m;
            Some(*along_m)
        }))
        .collect();
    let length_m = scales.lengths().loop_map.stretch_m;
    let length_m = length_m.min(along_m.last().copied().unwrap_or_default() / FEWEST_STRETCHES);
    let stretch = |along_m: &f64| if length_m > 0.0 { (along_m / length_m) as usize } else { 0 };
    along_m.iter().map(stretch).collect()
}

/// Where the patch of a keyframe lies.
pub(super) fn placement(world_from_body: &Isometry3<f64>) -> Placement {
    let rotation = world_from_body.rotation.to_rotation_matrix();
    Placement {
        rotation: std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)])),
        origin_in_world_m: world_from_body.translation.vector.into(),
    }
}
