//! Long logs for benchmarks: drives through a simulated city.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A drive that is made once and kept.
#[derive(Debug, Clone, Copy)]
pub(super) struct City {
    pub(super) km: f64,
    /// Share of the way that is driven a second time.
    pub(super) revisit: f64,
    /// Firings of the sensor per turn.
    pub(super) azimuth_steps: u32,
}

impl City {
    /// Its log in `folder`, made by the command `dmp` where it is not there yet.
    pub(super) fn log(self, folder: &Path, dmp: &Path) -> anyhow::Result<PathBuf> {
        let Self { km, revisit, azimuth_steps } = self;
        let log = folder.join(format!("city-{km}-{revisit}-{azimuth_steps}.mcap"));
        if !log.exists() {
            let mut command = Command::new(dmp);
            command.args(["simulate", "city", "--no-progress", "--quiet", "--km", &km.to_string()]);
            command.args(["--revisit", &revisit.to_string()]);
            command.args(["--azimuth-steps", &azimuth_steps.to_string(), "-o"]).arg(&log);
            finished(&mut command)?;
        }
        Ok(log)
    }
}

/// The true trajectory beside a log.
pub(super) fn truth_of(log: &Path) -> PathBuf {
    log.with_extension("truth.tum")
}

/// A trajectory beside a log that drifts from the truth by an ATE of 1 m; made where it is not there yet.
pub(super) fn drift_of(log: &Path, seed: u32, dmp: &Path) -> anyhow::Result<PathBuf> {
    let wrong = log.with_extension(format!("drift-{seed}.tum"));
    if !wrong.exists() {
        let mut command = Command::new(dmp);
        command.args(["simulate", "errors", "--quiet"]).arg(truth_of(log));
        command.args(["--drift-ate", "1", "--seed", &seed.to_string(), "-o"]).arg(&wrong);
        finished(&mut command)?;
    }
    Ok(wrong)
}

fn finished(command: &mut Command) -> anyhow::Result<()> {
    let output = command.stdin(Stdio::null()).output()?;
    anyhow::ensure!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    Ok(())
}
