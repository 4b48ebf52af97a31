//! How much disk an evaluation will need, told before it writes.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use dmp_disk::disk_space;
use dmp_map::{Lattice, SCRATCH_VOXEL_BYTES};
use dmp_sensor::{Ray, Scan};

use crate::config::MapSource;
use crate::error::{EvaluateError, in_words};
use crate::evaluation::Evaluation;
use crate::pose::{Poser, RunPoses};
use crate::setting_name::SettingName;
use crate::settings::Means;

/// Scans that are looked at, evenly spread.
const SCANS: usize = 16;
/// A map has the voxels of one scan, and as many again for each cell of this edge, metres, that the sensor comes
/// into. This and what follows is measured: docs/performance.md.
const CELL_M: f64 = 10.0;
/// Bytes of a map for each voxel with any return in it, about; and for each with enough for a surfel, at least.
const MAP_VOXEL_BYTES: f64 = 6.0;
const LEAST_MAP_VOXEL_BYTES: u64 = 3;
/// What a voxel takes in memory while maps are fused, bytes.
const TABLE_VOXEL_BYTES: f64 = 110.0;
/// How often a voxel is put aside where not all find place in memory: more than once where the drive returns.
const TIMES_ASIDE: f64 = 1.3;
/// What a thread takes for one return of one run, seconds, about: how many checkpoints there will be.
const FUSE_S: f64 = 1e-7;
/// Returns that a voxel needs for a surfel.
const FILLED: u32 = 3;

/// What is known of the disk before it is written to.
#[derive(Debug, Clone, Default)]
pub(crate) struct DiskEstimate {
    /// Bytes that will be written, about.
    pub(crate) bytes: u64,
    /// Where there may be too few.
    pub(crate) warning: Option<String>,
}

/// Bytes that fusing the maps will write.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct DiskNeed {
    /// Partial sums, and maps that are removed at the end.
    work: Bytes,
    /// Maps that are kept.
    saved: Bytes,
}

/// So many bytes, about and at least.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Bytes {
    about: u64,
    least: u64,
}

/// Voxels of a scan, on average and at least.
#[derive(Debug, Clone, Copy, Default)]
struct ScanVoxels {
    /// With any return in them.
    mean: f64,
    /// With enough returns for a surfel.
    least_filled: u64,
}

impl<M> Evaluation<'_, M> {
    /// Estimates what will be written and whether there is space for it; where there may be none, whoever watches is told.
    /// What is gone on with has its place already.
    ///
    /// # Errors
    /// Where it is too little for sure.
    pub(crate) fn estimate_disk(&self) -> Result<DiskEstimate, EvaluateError> {
        let need = self.disk_need()?;
        let warning = if self.work.is_resumed() { None } else { need.check(&self.means)? };
        warning.iter().for_each(|warning| self.progress.note(&warning.clone().into()));
        Ok(DiskEstimate { bytes: need.work.about + need.saved.about, warning })
    }

    /// What fusing the maps will write, from a sample of scans, the ways and the memory.
    fn disk_need(&self) -> Result<DiskNeed, EvaluateError> {
        let (plan, means) = (&self.plan, &self.means);
        let fused = || self.runs.iter().filter(|run| run.run.map == MapSource::Fused).map(|run| &run.poses);
        let Some(first) = fused().next() else { return Ok(DiskNeed::default()) };
        let voxels = self.scan_voxels(first)?;
        let count = fused().count() as f64;
        let in_memory = self.work.budget().all_map_bytes() as f64 / count / TABLE_VOXEL_BYTES;
        let fuse_s = plan.returns() as f64 * count * FUSE_S / means.threads as f64;
        let kept_between = means.checkpoint_every.is_some_and(|every| fuse_s > every.as_secs_f64());
        let (mut aside_bytes, mut map_bytes, mut least_bytes) = (0, 0, 0);
        for poses in fused() {
            let places = self.places(poses);
            let of_map = (voxels.mean * (1.0 + cells(&places) as f64)).min(plan.returns() as f64);
            let all = of_map * TIMES_ASIDE;
            let aside = if kept_between { all } else { (all - in_memory).max(0.0) };
            aside_bytes += aside as u64 * SCRATCH_VOXEL_BYTES as u64;
            map_bytes += (of_map * MAP_VOXEL_BYTES) as u64;
            // What is seen from places so far apart has no voxel in common.
            let apart = apart(&places, 2.0 * self.settings.max_range_m);
            least_bytes += apart * voxels.least_filled * LEAST_MAP_VOXEL_BYTES;
        }
        // Without trails, all is fused once more.
        let rounds = 1 + u64::from(self.settings.free_space);
        let saved = u64::from(means.save_maps.is_some());
        let maps = |times: u64| Bytes { about: map_bytes * times, least: least_bytes * times };
        let mut work = maps(rounds - saved);
        work.about += aside_bytes * rounds;
        Ok(DiskNeed { work, saved: maps(saved) })
    }

    fn places(&self, poses: &RunPoses) -> Vec<[f64; 2]> {
        let place = |frame| poses.of_frame(frame).map(|pose| [pose.translation.x, pose.translation.y]);
        self.plan.frames().iter().filter_map(place).collect()
    }

    /// Looks at some scans.
    fn scan_voxels(&self, poses: &RunPoses) -> Result<ScanVoxels, EvaluateError> {
        let lattice = Lattice::new(self.plan.voxel.voxel_m)?;
        let frames = self.plan.frames();
        let count = SCANS.min(frames.len());
        let (mut reader, mut scan) = (self.log.reader()?, Scan::default());
        let mut poser = Poser::new([poses], &self.plan.filter);
        let mut voxels = ScanVoxels { mean: 0.0, least_filled: u64::MAX };
        let mut returns: HashMap<[i64; 3], u32> = HashMap::new();
        for k in 0..count {
            let frame = &frames[k * frames.len() / count];
            reader.read(frame.frame, &mut scan)?;
            returns.clear();
            poser.blocks(frame, &scan, |block| {
                for end in block.rays(0).iter().map(Ray::endpoint_in_world) {
                    let voxel = end.map(|c| (c / lattice.voxel_m()).floor() as i64);
                    *returns.entry(voxel).or_default() += 1;
                }
                Ok::<(), EvaluateError>(())
            })?;
            voxels.mean += returns.len() as f64 / count as f64;
            let filled = returns.values().filter(|&&count| count >= FILLED).count() as u64;
            voxels.least_filled = voxels.least_filled.min(filled);
        }
        Ok(voxels)
    }
}

impl DiskNeed {
    /// Compares with what the file systems have: a warning where it is likely too little.
    ///
    /// # Errors
    /// Where it is too little for sure.
    fn check(&self, means: &Means) -> Result<Option<String>, EvaluateError> {
        let mut work =
            Target { folder: &means.work_folder, setting: SettingName::WorkFolder, bytes: self.work };
        let mut saved = None;
        if let Some(folder) = &means.save_maps {
            let same = matches!((disk_space(folder), disk_space(work.folder)),
                (Some(a), Some(b)) if a.file_system == b.file_system);
            if same {
                work.bytes.about += self.saved.about;
                work.bytes.least += self.saved.least;
            } else {
                saved = Some(Target { folder, setting: SettingName::SaveMaps, bytes: self.saved });
            }
        }
        let mut warnings = Vec::new();
        for place in [work].into_iter().chain(saved) {
            warnings.extend(place.check(disk_space(place.folder).map(|free| free.free_bytes))?);
        }
        Ok((!warnings.is_empty()).then(|| warnings.join("; ")))
    }
}

/// Where something is written.
#[derive(Debug, Clone, Copy)]
struct Target<'a> {
    folder: &'a Path,
    /// What moves it elsewhere.
    setting: SettingName,
    bytes: Bytes,
}

impl Target<'_> {
    fn check(self, free_bytes: Option<u64>) -> Result<Option<String>, EvaluateError> {
        let Some(free_bytes) = free_bytes else { return Ok(None) };
        let Self { folder, setting, bytes: Bytes { about: bytes, least: least_bytes } } = self;
        if least_bytes > free_bytes {
            let (folder, bytes) = (folder.to_path_buf(), bytes.max(least_bytes));
            return Err(EvaluateError::NoRoom { folder, bytes, least_bytes, free_bytes, setting });
        }
        // Stands in the report, whose words do not change.
        let option = if setting == SettingName::SaveMaps { "--save-maps or -o" } else { "--work" };
        Ok((bytes > free_bytes).then(|| {
            format!(
                "about {} will be written in {}, where {} are free: the disk may run full ({option} names another place)",
                in_words(bytes),
                folder.display(),
                in_words(free_bytes)
            )
        }))
    }
}

/// The cell of a grid of this edge.
fn cell([x, y]: [f64; 2], edge_m: f64) -> [i64; 2] {
    [x, y].map(|c| (c / edge_m).floor() as i64)
}

/// Cells with any place in them.
fn cells(places: &[[f64; 2]]) -> usize {
    places.iter().map(|&place| cell(place, CELL_M)).collect::<HashSet<_>>().len()
}

/// Places that are all farther than this from each other: as many as are found in their order.
fn apart(places: &[[f64; 2]], least_m: f64) -> u64 {
    let mut found: HashMap<[i64; 2], Vec<[f64; 2]>> = HashMap::new();
    let mut count = 0;
    for &place in places {
        let [i, j] = cell(place, least_m);
        let around = (i - 1..=i + 1).flat_map(|i| (j - 1..=j + 1).map(move |j| [i, j]));
        let mut near = around.filter_map(|cell| found.get(&cell)).flatten();
        let square = |x: f64| x * x;
        if near.all(|other| square(other[0] - place[0]) + square(other[1] - place[1]) > square(least_m)) {
            found.entry([i, j]).or_default().push(place);
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_apart_are_those_that_a_search_through_all_finds() {
        let mut state = 7u64;
        let mut unit = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31)
        };
        let places: Vec<[f64; 2]> = (0..500).map(|_| [unit() * 900.0 - 400.0, unit() * 700.0]).collect();
        for least_m in [1.0, 37.0, 200.0, 5000.0] {
            let mut found: Vec<[f64; 2]> = Vec::new();
            for &[x, y] in &places {
                if found.iter().all(|&[a, b]| (x - a).hypot(y - b) > least_m) {
                    found.push([x, y]);
                }
            }
            assert_eq!(apart(&places, least_m), found.len() as u64, "{least_m} m");
        }
        assert_eq!(apart(&places, 5000.0), 1);
    }

    #[test]
    fn too_little_space_is_refused_or_warned_of() {
        let place = |about, least| Target {
            folder: Path::new("w"),
            setting: SettingName::WorkFolder,
            bytes: Bytes { about, least },
        };
        assert_eq!(place(10 << 20, 5).check(None).unwrap(), None);
        assert_eq!(place(10 << 20, 5).check(Some(10 << 20)).unwrap(), None);
        let warning = place(10 << 20, 5).check(Some(3 << 20)).unwrap().unwrap();
        assert!(
            warning.contains("10 MiB") && warning.contains("3072 KiB") && warning.contains("--work"),
            "{warning}"
        );
        let error = place(10 << 20, 4 << 20).check(Some(3 << 20)).unwrap_err();
        assert!(!error.is_usage());
        let told = error.to_string();
        assert!(
            told.starts_with("w: ") && told.contains("10 MiB") && told.contains("(`work-folder`)"),
            "{told}"
        );
    }
}
