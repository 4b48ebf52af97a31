//! Which drives and estimates a study uses, and where it keeps them.

use std::path::PathBuf;

use super::drives::{DriveSpec, drives, find};
use super::estimates::Estimate;

#[derive(Debug, clap::Args)]
pub(super) struct Chosen {
    /// Only these drives, comma-separated [default: the eight of the suite]. There are two more whose places look alike:
    /// alike-32 and tunnel-32
    #[arg(long, value_delimiter = ',')]
    drives: Vec<String>,
    /// Only estimates whose names begin so, comma-separated
    #[arg(long, value_delimiter = ',')]
    estimates: Vec<String>,
    /// Folder for the drives' logs
    #[arg(long, default_value = "target/study", value_name = "FOLDER")]
    pub(super) out: PathBuf,
}

impl Chosen {
    pub(super) fn drives(&self) -> anyhow::Result<Vec<DriveSpec>> {
        if self.drives.is_empty() {
            return Ok(drives());
        }
        self.drives.iter().map(|name| find(name)).collect()
    }

    /// Whether nothing is left out.
    pub(super) fn is_all(&self) -> bool {
        self.drives.is_empty() && self.estimates.is_empty()
    }

    pub(super) fn wants(&self, estimate: &Estimate) -> bool {
        self.estimates.is_empty() || self.estimates.iter().any(|name| estimate.name.starts_with(name))
    }
}
