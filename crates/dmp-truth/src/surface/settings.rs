//! How a map is measured.

use std::path::PathBuf;

use super::SurfaceError;

/// Everything that can be set.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceSettings {
    /// A distance beyond this counts as this, metres.
    pub cap_m: f64,
    /// Lengths at which accuracy and completeness are given, metres, rising.
    pub thresholds_m: Vec<f64>,
    /// Edge of the voxels of which only one point counts, metres; `None`: every point counts.
    pub thin_m: Option<f64>,
    /// Whether only the reference within the cap of the evaluated points' bounding box is to be complete.
    pub crop: bool,
    /// A mesh is sampled once for every square of this edge, metres.
    pub spacing_m: f64,
    /// Edge of a tile, metres. It changes no number.
    pub tile_edge_m: f64,
    /// Memory to aim for, bytes; less than 4 MiB counts as that.
    pub memory_bytes: usize,
    /// Threads that measure.
    pub threads: usize,
    /// Where scratch files go.
    pub work_folder: PathBuf,
}

impl Default for SurfaceSettings {
    fn default() -> Self {
        Self {
            cap_m: 1.0,
            thresholds_m: vec![0.05, 0.1, 0.2, 0.5],
            thin_m: None,
            crop: false,
            spacing_m: 0.1,
            tile_edge_m: 32.0,
            memory_bytes: 2 << 30,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            work_folder: std::env::temp_dir(),
        }
    }
}

impl SurfaceSettings {
    /// Checks every setting by itself.
    ///
    /// # Errors
    /// The first that makes no sense, with its value and what it must be.
    pub fn check(&self) -> Result<(), SurfaceError> {
        let bad = |setting, value: String, why| Err(SurfaceError::Setting { setting, value, why });
        if !(0.001..=100.0).contains(&self.cap_m) {
            return bad("cap", format!("{} m", self.cap_m), "it must lie between 1 mm and 100 m");
        }
        let inside = self.thresholds_m.iter().all(|t| *t > 0.0 && *t <= self.cap_m);
        if !inside || !self.thresholds_m.is_sorted_by(|a, b| a < b) {
            let value = format!("{:?} m", self.thresholds_m);
            return bad("thresholds", value, "they must rise, from above 0 to at most the cap");
        }
        if let Some(thin_m) = self.thin_m.filter(|thin_m| !(0.001..=10.0).contains(thin_m)) {
            return bad("thin", format!("{thin_m} m"), "it must lie between 1 mm and 10 m");
        }
        if !(0.001..=100.0).contains(&self.spacing_m) {
            return bad("spacing", format!("{} m", self.spacing_m), "it must lie between 1 mm and 100 m");
        }
        if !(1.0..=10_000.0).contains(&self.tile_edge_m) {
            return bad("tile edge", format!("{} m", self.tile_edge_m), "it must lie between 1 m and 10 km");
        }
        if self.threads == 0 || self.threads > 1024 {
            return bad("threads", self.threads.to_string(), "it must lie between 1 and 1024");
        }
        Ok(())
    }

    /// The memory to aim for, bytes: with less than a little, parts on disk would be a few points long.
    pub(super) fn memory(&self) -> usize {
        self.memory_bytes.max(4 << 20)
    }
}
