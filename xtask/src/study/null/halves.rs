//! One run on the odd and on the even scans of a log, and through other traffic: scores that are equal but for chance.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use anyhow::Context as _;
use dmp::{Config, Run, Scales, ScoredReturns, Sink, SurfaceGroup, Watch};
use dmp_log::{FrameInfo, LogError, LogSummary, ScanLog, ScanReader, StaticFrames};
use dmp_sensor::Scan;

use super::super::interval::{difference_of_two, total};
use super::super::result::Both;
use super::logs::NullLog;

/// One run scored twice.
pub(super) struct Twice {
    what: &'static str,
    /// (scale, difference in parts of the score, chance of so large a one).
    scales: Vec<(f64, f64, f64)>,
}

/// All ways to score one run of a log twice.
pub(super) struct Halves(Vec<Twice>);

impl Halves {
    pub(super) fn print(&self, log: &str) {
        for Twice { what, scales } in &self.0 {
            let differences: Vec<String> = scales
                .iter()
                .map(|(scale_m, apart, chance)| {
                    format!("{:+.2} % at {scale_m} m (p {chance:.2})", 100.0 * apart)
                })
                .collect();
            // Four scales share the error of a pair.
            let differ = scales.iter().any(|(_, _, chance)| *chance <= 0.01 / scales.len() as f64);
            let verdict = if differ { "DIFFERENT" } else { "no difference" };
            println!("{log:<14}{what:<24}{verdict}: {}", differences.join(", "));
        }
    }
}

pub(super) fn halves(log: &NullLog) -> anyhow::Result<Halves> {
    let part = |first: usize| EveryOther::new(log.log.as_ref(), first);
    let mut twice = vec![compare("odd and even scans", log, &part(0), &part(1))?];
    if let Some(other) = &log.other_traffic {
        twice.push(compare("other traffic", log, log.log.as_ref(), other.as_ref())?);
    }
    Ok(Halves(twice))
}

fn compare(what: &'static str, log: &NullLog, a: &dyn ScanLog, b: &dyn ScanLog) -> anyhow::Result<Twice> {
    let sums = |of: &dyn ScanLog| -> anyhow::Result<Sums> {
        let sums = Sums { scales: log.scales, frames: Mutex::default(), groups: Mutex::default() };
        let runs = [Run::new("base", log.base.clone())];
        dmp::evaluate(of, &runs, &Config::default(), Watch::sink(&sums))
            .with_context(|| format!("{what} of {}", log.name))?;
        Ok(sums)
    };
    let (a, b) = (sums(a)?.finish(), sums(b)?.finish());
    let scales_m = &log.scales.lengths().cv_m[1..];
    let scales = scales_m.iter().enumerate().filter_map(|(k, &scale_m)| {
        let of = |sums: &(Vec<[Both; SCALES]>, Vec<[Both; SCALES]>)| {
            let at = |units: &[[Both; SCALES]]| units.iter().map(|unit| unit[k]).collect::<Vec<Both>>();
            (at(&sums.0), at(&sums.1))
        };
        let ((frames_a, groups_a), (frames_b, groups_b)) = (of(&a), of(&b));
        let difference = difference_of_two([&frames_a, &frames_b], [&groups_a, &groups_b])?;
        let level = total(&frames_a);
        Some((scale_m, difference.value_m2 / (level.difference_m2 / level.returns), difference.chance()))
    });
    Ok(Twice { what, scales: scales.collect() })
}

/// Scales of `R_cv` that decide.
const SCALES: usize = 4;

/// Sums of one run's squares by frame and by group of surface.
struct Sums {
    scales: Scales,
    frames: Mutex<BTreeMap<usize, [Both; SCALES]>>,
    groups: Mutex<BTreeMap<SurfaceGroup, [Both; SCALES]>>,
}

impl Sums {
    /// By frame in their order, and by group, those without a return too.
    fn finish(self) -> (Vec<[Both; SCALES]>, Vec<[Both; SCALES]>) {
        let frames = self.frames.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut groups = self.groups.into_inner().unwrap_or_else(PoisonError::into_inner);
        let of_group = |group| groups.remove(&group).unwrap_or_default();
        (frames.into_values().collect(), SurfaceGroup::all().map(of_group).collect())
    }
}

impl Sink for Sums {
    fn returns_scored(&self, scored: &ScoredReturns<'_>) {
        let mut groups: BTreeMap<SurfaceGroup, [Both; SCALES]> = BTreeMap::new();
        let mut frame = [Both::default(); SCALES];
        let posed = scored.runs.iter().flatten().flat_map(|run| run.residuals.iter().zip(run.is_posed));
        for (residuals, _) in posed.filter(|(_, is_posed)| **is_posed) {
            let Some(residual_m) = residuals.independent_m else { continue };
            let group = groups.entry(residuals.surfaces[0]).or_default();
            for (k, scale_m) in self.scales.lengths().cv_m[1..].iter().enumerate() {
                let square = Both {
                    difference_m2: (residual_m * residual_m).min(scale_m * scale_m),
                    level_m2: 0.0,
                    returns: 1.0,
                };
                group[k].merge(&square);
                frame[k].merge(&square);
            }
        }
        let merge = |to: &mut [Both; SCALES], from: &[Both; SCALES]| {
            to.iter_mut().zip(from).for_each(|(to, from)| to.merge(from));
        };
        let mut frames = self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        merge(frames.entry(scored.frame).or_default(), &frame);
        drop(frames);
        let mut all = self.groups.lock().unwrap_or_else(PoisonError::into_inner);
        groups.iter().for_each(|(group, sums)| merge(all.entry(*group).or_default(), sums));
    }
}

/// Every other scan of a log.
#[derive(Debug)]
struct EveryOther<'a> {
    log: &'a dyn ScanLog,
    frames: Vec<usize>,
    infos: Vec<FrameInfo>,
}

impl<'a> EveryOther<'a> {
    fn new(log: &'a dyn ScanLog, first: usize) -> Self {
        let frames: Vec<usize> = (first..log.frames().len()).step_by(2).collect();
        Self { log, infos: frames.iter().map(|&frame| log.frames()[frame]).collect(), frames }
    }
}

impl ScanLog for EveryOther<'_> {
    fn summary(&self) -> &LogSummary {
        self.log.summary()
    }

    fn static_frames(&self) -> &StaticFrames {
        self.log.static_frames()
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.infos
    }

    fn number_in_log(&self, frame: usize) -> usize {
        self.log.number_in_log(self.frames[frame])
    }

    fn scans_in_log(&self) -> usize {
        self.log.scans_in_log()
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        Ok(Box::new(OtherReader { reader: self.log.reader()?, frames: &self.frames }))
    }

    fn groups(&self) -> Vec<Range<usize>> {
        (0..self.frames.len()).map(|frame| frame..frame + 1).collect()
    }
}

struct OtherReader<'a> {
    reader: Box<dyn ScanReader + 'a>,
    frames: &'a [usize],
}

impl ScanReader for OtherReader<'_> {
    fn read(&mut self, frame: usize, scan: &mut Scan) -> Result<(), LogError> {
        self.reader.read(self.frames[frame], scan)
    }
}
