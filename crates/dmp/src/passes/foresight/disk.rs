//! Estimates the disk space of an evaluation before it writes.

use std::path::Path;

use dmp_disk::disk_space;
use dmp_map::{MapFuser, SCRATCH_VOXEL_BYTES};
use dmp_runs::{EvaluateError, Means, SettingName, in_words};

use super::sounding::Sounding;
use crate::drawn::{Choice, DRAWN_BYTES};
use crate::passes::evaluation::Evaluation;

// Measured: docs/performance.md.

/// Approximate bytes of a map per surfel.
const MAP_SURFEL_BYTES: f64 = 7.7;
/// Approximate time of a thread per return and run, seconds: gives the number of checkpoints.
const FUSE_S: f64 = 2e-7;
/// Safety factor of the estimate: below it a warning is due.
const SURE: f64 = 1.5;

/// The disk estimate, made before anything is written.
#[derive(Debug, Clone, Default)]
pub(crate) struct DiskEstimate {
    /// Approximate peak bytes on disk.
    pub(crate) bytes: u64,
    /// A warning if space may run out.
    pub(crate) warning: Option<String>,
}

/// Approximate bytes on disk.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct DiskNeed {
    /// Partial sums, maps that are removed at the end, and the data of the watcher.
    work: u64,
    /// Maps that are kept.
    saved: u64,
}

impl<M: Sync + Send> Evaluation<'_, M> {
    /// Reports the expected disk use before anything is fused; the watcher gets a note if space may run out.
    /// Files of a resumed evaluation are already there.
    ///
    /// # Errors
    /// When the disk is too small, even if the estimate is off by its largest measured error.
    pub(crate) fn foresee_disk(&self, sounding: &Sounding) -> Result<DiskEstimate, EvaluateError> {
        let need = self.disk_need(sounding);
        let warning = if self.work.is_resumed() { None } else { need.check(&self.means)? };
        warning.iter().for_each(|warning| self.progress.note(&warning.clone().into()));
        Ok(DiskEstimate { bytes: need.work + need.saved, warning })
    }

    /// Peak disk use: checkpoints keep partial sums until the end.
    fn disk_need(&self, sounding: &Sounding) -> DiskNeed {
        let (means, runs) = (&self.means, &sounding.runs);
        let budget_bytes = MapFuser::tiles_bytes(self.work.budget().map_bytes(runs.len())) as f64;
        let fuse_s = self.returns() as f64 * runs.len() as f64 * FUSE_S / means.threads as f64;
        let pauses = means.checkpoint_every.map_or(0.0, |every| fuse_s / every.as_secs_f64().max(1e-3));
        let aside: f64 = runs.iter().map(|run| run.put_aside(budget_bytes, pauses as u32)).sum();
        let aside_bytes = aside as u64 * SCRATCH_VOXEL_BYTES as u64;
        let map_bytes = (MAP_SURFEL_BYTES * runs.iter().map(|run| run.surfels).sum::<f64>()) as u64;
        // A map is written with trails and without, one after the other. Only checkpoints keep the first until the end.
        let largest = runs.iter().map(|run| run.surfels).fold(0.0, f64::max);
        let twice =
            if means.checkpoint_every.is_none() { (MAP_SURFEL_BYTES * largest) as u64 } else { map_bytes };
        let saved = u64::from(means.save_maps.is_some());
        let watched = self.sink.work_bytes(self.returns());
        let share: f64 = self.to_keep().iter().flatten().map(Choice::share).sum();
        let drawn = (DRAWN_BYTES * share * self.returns() as f64) as u64;
        let work = map_bytes * (1 - saved) + twice + aside_bytes + watched + drawn;
        DiskNeed { work, saved: map_bytes * saved }
    }
}

impl DiskNeed {
    /// Compares with the free space of the file systems: a warning if it is likely too small.
    ///
    /// # Errors
    /// When it is too small.
    fn check(&self, means: &Means) -> Result<Option<String>, EvaluateError> {
        let mut work =
            Target { folder: &means.work_folder, setting: SettingName::WorkFolder, bytes: self.work };
        let mut saved = None;
        if let Some(folder) = &means.save_maps {
            let same = matches!((disk_space(folder), disk_space(work.folder)),
                (Some(a), Some(b)) if a.file_system == b.file_system);
            if same {
                work.bytes += self.saved;
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

/// A folder that is written to.
#[derive(Debug, Clone, Copy)]
struct Target<'a> {
    folder: &'a Path,
    /// The setting that changes it.
    setting: SettingName,
    bytes: u64,
}

impl Target<'_> {
    fn check(self, free_bytes: Option<u64>) -> Result<Option<String>, EvaluateError> {
        let Some(free_bytes) = free_bytes else { return Ok(None) };
        let Self { folder, setting, bytes } = self;
        let least_bytes = (bytes as f64 / SURE) as u64;
        if least_bytes > free_bytes {
            let folder = folder.to_path_buf();
            return Err(EvaluateError::NoRoom { folder, bytes, least_bytes, free_bytes, setting });
        }
        // The text is part of the report: it must be the same everywhere and name no folder.
        let (place, option) = match setting {
            SettingName::SaveMaps => ("the maps' folder", "--save-maps or -o"),
            _ => ("the work folder", "--work"),
        };
        Ok((bytes > free_bytes).then(|| {
            format!(
                "about {} will be written to {place}, which has {} free: the disk may run full (change it with {option})",
                in_words(bytes),
                in_words(free_bytes)
            )
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_little_space_is_refused_or_warned_of() {
        let place = Target { folder: Path::new("w"), setting: SettingName::WorkFolder, bytes: 10 << 20 };
        assert_eq!(place.check(None).unwrap(), None);
        assert_eq!(place.check(Some(10 << 20)).unwrap(), None);
        let warning = place.check(Some(7 << 20)).unwrap().unwrap();
        assert!(
            warning.contains("10 MiB") && warning.contains("7168 KiB") && warning.contains("--work"),
            "{warning}"
        );
        let error = place.check(Some(6 << 20)).unwrap_err();
        assert!(!error.is_usage());
        let text = error.to_string();
        assert!(
            text.starts_with("w: ") && text.contains("10 MiB") && text.contains("(`work-folder`)"),
            "{text}"
        );
    }
}
