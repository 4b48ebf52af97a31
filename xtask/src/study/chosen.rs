//! Which drives and estimates a study looks at, and where it keeps them.

use std::path::PathBuf;

use anyhow::Context as _;

use super::drives::{DriveSpec, drives, find, look_alikes};
use super::estimates::Estimate;

#[derive(Debug, clap::Args)]
pub(super) struct Chosen {
    /// Only these drives, comma-separated; all by default. Beside those of the suite there are two whose places look alike,
    /// alike-32 and tunnel-32
    #[arg(long, value_delimiter = ',')]
    drives: Vec<String>,
    /// Only estimates whose names begin so, comma-separated
    #[arg(long, value_delimiter = ',')]
    estimates: Vec<String>,
    /// Where the drives' logs are kept
    #[arg(long, default_value = "target/study", value_name = "FOLDER")]
    pub(super) out: PathBuf,
}

impl Chosen {
    /// The drives, with a folder for their logs.
    pub(super) fn drives(&self) -> anyhow::Result<Vec<DriveSpec>> {
        std::fs::create_dir_all(&self.out).with_context(|| self.out.display().to_string())?;
        if self.drives.is_empty() {
            return Ok(drives());
        }
        let look_alike = |name: &str| look_alikes().into_iter().find(|drive| drive.name == name);
        self.drives.iter().map(|name| look_alike(name).map_or_else(|| find(name), Ok)).collect()
    }

    pub(super) fn wants(&self, estimate: &Estimate) -> bool {
        self.estimates.is_empty() || self.estimates.iter().any(|name| estimate.name.starts_with(name))
    }
}
