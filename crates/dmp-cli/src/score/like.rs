//! Scoring as a saved result was made, so that both can be compared.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use dmp::{Config, MissPrice, Promise, Report, Sample};
use dmp_log::LogSummary;

use crate::saved_result::read_result;

/// A result to be like.
#[derive(Debug)]
pub(crate) struct Like {
    path: PathBuf,
    report: Report,
}

impl Like {
    pub(crate) fn read(path: &Path) -> anyhow::Result<Self> {
        Ok(Self { path: path.to_path_buf(), report: read_result(path)? })
    }

    /// The settings with those that scores depend on as they were. Where the sensor sits and what is added to the
    /// clock belongs to the runs.
    pub(crate) fn settings(&self, config: Config) -> anyhow::Result<Config> {
        let (path, Report { config: was, sampling, promise, .. }) = (self.path.display(), &self.report);
        if was.free_space {
            bail!(
                "{path}: made with --free-space, where maps depend on all runs of a command: score them in one"
            );
        }
        if sampling.places.is_some() {
            bail!(
                "{path}: made with --quick, where places and their maps depend on all runs of a command: score them in one"
            );
        }
        if sampling.looks.is_some() {
            bail!(
                "{path}: made with --decide, where scans depend on what all runs decide: score them in one command"
            );
        }
        let Some(miss_price) = MissPrice::new(was.miss_price) else {
            bail!("{path}: config.miss_price is {}, not a share from 0 to 1", was.miss_price);
        };
        let asked = promise.asked().map_err(|problem| anyhow!("{path}: {problem}"))?;
        let Promise { confidence, margin: same_within } = asked;
        Ok(Config {
            voxel_m: Some(was.voxel_m),
            segments: Some(was.segments.clone()),
            scales: Some(was.scales),
            min_range_m: Some(was.min_range_m),
            max_range_m: Some(was.max_range_m),
            ego: was.ego.known,
            every: was.every,
            miss_price,
            confidence,
            same_within,
            sigma_m: was.sigma_m,
            sample: sampling.seed.map_or(Sample::All, |_| Sample::Frames(sampling.frames_scored)),
            seed: sampling.seed.unwrap_or(config.seed),
            ..config
        })
    }

    /// Refuses another log.
    pub(crate) fn check_log(&self, log: &LogSummary) -> anyhow::Result<()> {
        let was = &self.report.inputs;
        if (&was.fingerprint, &was.topic) == (&log.fingerprint, &log.topic) {
            return Ok(());
        }
        let words = |fingerprint: &str, topic: &Option<String>| match topic {
            Some(topic) => format!("{fingerprint}, topic {topic}"),
            None => fingerprint.to_owned(),
        };
        bail!(
            "{}: made of another log: {}, not {} of {}",
            self.path.display(),
            words(&was.fingerprint, &was.topic),
            words(&log.fingerprint, &log.topic),
            log.path.display()
        );
    }
}
