//! What is free of one's own points by the book: the returns of a segment are cast into maps that were fused
//! without that segment and its neighbours, instead of asking surfels who saw them.

use std::ops::Range;

use anyhow::Context as _;
use dmp::{Config, Ego, MapSource, Residuals, Run, ScoredReturns, ScoredRun, Sink, Watch, fuse_maps};
use dmp_log::{FrameInfo, LogError, LogSummary, ScanLog, ScanReader};
use dmp_sensor::Scan;

use super::observe::{Frame, Observer, PairFrame};

/// Every frame that is scored, and every pair by groups of surface, with what the other parts of the drive predict for
/// it. `starts` are the first frames of the segments; one fusion for each of them.
pub(super) fn frames_without_own(
    log: &dyn ScanLog,
    runs: &[Run],
    starts: &[usize],
    config: &Config,
) -> anyhow::Result<(Vec<Frame>, Vec<Vec<PairFrame>>)> {
    let mut reader = log.reader()?;
    let mut scans = Vec::new();
    for index in (0..log.frames().len()).step_by(config.every) {
        let mut scan = Scan::default();
        reader.read(index, &mut scan)?;
        scans.push((index, scan));
    }
    let folder = tempfile::tempdir()?;
    let config = Config {
        every: 1,
        // The vehicle is looked for in all scans or not at all; the simulated sensor does not see it.
        ego: Ego::None,
        save_maps: Some(folder.path().to_owned()),
        ..config.clone()
    };
    let observer = Observer::new(log.frames().len(), runs.len(), false);
    let segment_of = |frame: usize| starts.partition_point(|&start| start <= frame);
    for segment in 1..=starts.len() {
        let part = |wanted: &dyn Fn(usize) -> bool| {
            let scans = scans.iter().filter(|(frame, _)| wanted(segment_of(*frame)));
            Part::new(log.summary(), scans.collect())
        };
        let (own, others) = (part(&|s| s == segment), part(&|s| s.abs_diff(segment) > 1));
        if own.scans.is_empty() {
            continue;
        }
        let maps = fuse_maps(&others, runs, &config, ()).with_context(|| format!("segment {segment}"))?;
        let given = |run: &Run| Run {
            map: MapSource::Given(folder.path().join(format!("{}.dmpmap", run.name))),
            ..run.clone()
        };
        let given: Vec<Run> = runs.iter().map(given).collect();
        let relay =
            Relay { observer: &observer, frames: own.scans.iter().map(|(frame, _)| *frame).collect() };
        let scoring = Config { save_maps: None, ..config.clone() };
        dmp::evaluate(&own, &given, &scoring, Watch::sink(&relay))
            .with_context(|| format!("segment {segment}"))?;
        drop(maps);
        for run in &given {
            if let MapSource::Given(path) = &run.map {
                std::fs::remove_file(path).with_context(|| path.display().to_string())?;
            }
        }
    }
    let (frames, surfaces, _) = observer.finish();
    Ok((frames, surfaces))
}

/// Hands returns on, with the first surfel of a map without own points as the first independent one.
struct Relay<'a> {
    observer: &'a Observer,
    /// Frames of the log, by their places in the part.
    frames: Vec<usize>,
}

impl Sink for Relay<'_> {
    fn returns_scored(&self, scored: &ScoredReturns<'_>) {
        let independent = |r: &Residuals| Residuals { independent_m: r.first_m, ..*r };
        let residuals: Vec<Vec<Residuals>> =
            scored.runs.iter().map(|run| run.residuals.iter().map(independent).collect()).collect();
        let runs = scored.runs.iter().zip(&residuals);
        let runs: Vec<_> = runs.map(|(run, residuals)| ScoredRun { residuals, ..*run }).collect();
        self.observer.returns_scored(&ScoredReturns {
            frame: self.frames[scored.frame],
            runs: &runs,
            ..*scored
        });
    }
}

/// Some scans of a log, in memory.
#[derive(Debug)]
struct Part<'a> {
    summary: &'a LogSummary,
    /// With their places in the whole log.
    scans: Vec<&'a (usize, Scan)>,
    infos: Vec<FrameInfo>,
}

impl<'a> Part<'a> {
    fn new(summary: &'a LogSummary, scans: Vec<&'a (usize, Scan)>) -> Self {
        let info =
            |scan: &&(usize, Scan)| FrameInfo { stamp_ns: scan.1.stamp_ns, returns: scan.1.len() as u64 };
        Self { summary, infos: scans.iter().map(info).collect(), scans }
    }
}

impl ScanLog for Part<'_> {
    fn summary(&self) -> &LogSummary {
        self.summary
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.infos
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(PartReader(&self.scans)))
    }

    fn groups(&self) -> Vec<Range<usize>> {
        (0..self.scans.len()).map(|frame| frame..frame + 1).collect()
    }
}

struct PartReader<'a>(&'a [&'a (usize, Scan)]);

impl ScanReader for PartReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        scan.clone_from(&self.0[frame].1);
        Ok(())
    }
}
