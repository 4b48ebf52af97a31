//! `cargo xtask study sample`: what samples of the scans say, against what all scans say.

pub(super) mod counts;
mod full;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context as _, ensure};
use dmp::{Confidence, Config, FrameSums, Looks, Sample, Sink, Watch};
use dmp_log::{LogOptions, open_log};
use dmp_reduce::{Basis, Layout, MissPrice, Promise, Reducer};

use super::drives::{DriveSpec, drives, find};
use super::logs::log_and_runs;
use counts::{Samples, Share};
pub(super) use full::Full;
use full::decided;

/// Samples of each drive's scans, drawn by many seeds, against all its scans
#[derive(Debug, clap::Args)]
pub(super) struct SampleArgs {
    /// Only these drives, comma-separated; all of them by default
    #[arg(long, value_delimiter = ',')]
    drives: Vec<String>,
    /// Scans of a sample, each number in its turn
    #[arg(long, value_delimiter = ',', default_values_t = [14, 28, 56])]
    sizes: Vec<u64>,
    /// Samples that are drawn of each drive
    #[arg(long, default_value_t = 500)]
    seeds: u64,
    /// Where the drives' logs are kept
    #[arg(long, default_value = "target/study", value_name = "FOLDER")]
    out: PathBuf,
}

/// Scales at which a pair is looked at.
const CASCADE_SCALES: u32 = 4;

/// The sums of every frame of a drive, in order of time.
pub(super) struct Frames {
    frames: Vec<FrameSums>,
    layout: Layout,
}

pub(super) fn run(arguments: &SampleArgs) -> anyhow::Result<()> {
    std::fs::create_dir_all(&arguments.out).with_context(|| arguments.out.display().to_string())?;
    for name in &arguments.drives {
        find(name)?;
    }
    let wanted =
        |spec: &DriveSpec| arguments.drives.is_empty() || arguments.drives.iter().any(|d| d == spec.name);
    let (mut of_samples, mut of_decisions) = (BTreeMap::new(), Decisions::default());
    println!("{}", Samples::HEAD);
    for spec in drives().iter().filter(|spec| wanted(spec)) {
        let drive = frames_of(spec, &arguments.out)?;
        let whole = drive.reducer(0..drive.frames.len())?;
        let full = Full::of(&whole);
        for &size in &arguments.sizes {
            let mut counts = Samples::default();
            for seed in 0..arguments.seeds {
                let looks = Looks::new(drive.frames.len() as u64, Sample::Frames(size), seed, false);
                counts.add(&drive.reducer(looks.frames(0))?, &full);
            }
            let pairs = drive.layout.bases().len() * (drive.layout.bases().len() - 1) / 2;
            counts.print(spec.name, Some((drive.frames.len(), pairs)), size);
            of_samples.entry(size).or_insert_with(Samples::default).merge(&counts);
        }
        of_decisions.merge(&decisions(&drive, &full, arguments.seeds)?);
    }
    for (size, counts) in &of_samples {
        counts.print("all drives", None, *size);
    }
    of_decisions.print();
    println!(
        "{} samples of each drive and size. sign: of R_cv(10) over common returns, as of all scans; covered: intervals of\n\
         pairs, all scales, around the value of all scans; of runs: the same of the runs' R_cv(10); decided: pairs, of\n\
         these wrong: better is what all scans show to be worse at the scale that decided; by chance: what all scans leave\n\
         undecided; mixed: decided, but mixed; of all: mixed by all scans, of the pairs that they decide",
        arguments.seeds
    );
    Ok(())
}

/// Scores all estimates of the drive on all its scans.
pub(super) fn frames_of(spec: &DriveSpec, work: &Path) -> anyhow::Result<Frames> {
    let (path, runs) = log_and_runs(spec, work)?;
    let log = open_log(&path, &LogOptions::default())?;
    let kept = Kept::default();
    dmp::evaluate(log.as_ref(), &runs, &Config::default(), Watch::sink(&kept))
        .with_context(|| spec.name.to_owned())?;
    let frames: Vec<FrameSums> =
        kept.0.into_inner().unwrap_or_else(PoisonError::into_inner).into_values().collect();
    ensure!(!frames.is_empty(), "{}: nothing was scored", spec.name);
    let layout = Layout::new(frames.len() as u64, vec![Basis::CrossValidated; runs.len()]);
    Ok(Frames { frames, layout: layout.with_miss_price(MissPrice::default()) })
}

/// Keeps what is said of every frame.
#[derive(Default)]
struct Kept(Mutex<BTreeMap<usize, FrameSums>>);

impl Sink for Kept {
    fn frame_scored(&self, frame: usize, sums: &FrameSums) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(frame, sums.clone());
    }
}

impl Frames {
    pub(super) fn len(&self) -> usize {
        self.frames.len()
    }

    pub(super) fn reducer(&self, ordinals: impl Iterator<Item = usize>) -> anyhow::Result<Reducer> {
        let mut reducer = Reducer::new(self.layout.clone());
        self.add(&mut reducer, ordinals)?;
        Ok(reducer)
    }

    fn add(&self, reducer: &mut Reducer, ordinals: impl Iterator<Item = usize>) -> anyhow::Result<()> {
        for ordinal in ordinals {
            reducer.add_frame(ordinal as u64, &self.frames[ordinal])?;
        }
        Ok(())
    }
}

/// What `--decide` says of pairs, each by itself.
#[derive(Debug, Clone, Default)]
struct Decisions {
    /// Pairs decided by a sample.
    by_sample: Share,
    /// Of these, those that all scans contradict.
    wrong: Share,
    /// Share of the scans that were scored, added up.
    scored: f64,
}

fn decisions(drive: &Frames, full: &Full, seeds: u64) -> anyhow::Result<Decisions> {
    let mut found = Decisions::default();
    let all = drive.frames.len() as u64;
    for seed in 0..seeds {
        let looks = Looks::new(all, Sample::All, seed, true);
        let mut reducer = drive.reducer(std::iter::empty())?;
        let mut seen = BTreeSet::new();
        let mut open: Vec<usize> = (0..full.pairs.len()).collect();
        for (look, &size) in looks.sizes().iter().enumerate() {
            if size == all {
                break;
            }
            drive.add(&mut reducer, looks.frames(look).filter(|frame| seen.insert(*frame)))?;
            // Each pair by itself: its scales share what a look has of the error.
            let of_look = looks.confidence(size, Confidence::P99);
            let confidence = of_look.of_each_look(CASCADE_SCALES);
            open.retain(|&index| {
                let pair = &full.pairs[index];
                let said = reducer.compare(pair.a, pair.b, Promise { confidence, ..Promise::default() });
                if decided(&said).is_none() {
                    return true;
                }
                found.by_sample.add(true);
                found.wrong.add(full.contradicts(index, &said));
                found.scored += size as f64 / all as f64;
                false
            });
        }
        for _ in open {
            found.by_sample.add(false);
            found.scored += 1.0;
        }
    }
    Ok(found)
}

impl Decisions {
    fn merge(&mut self, other: &Self) {
        self.by_sample.merge(other.by_sample);
        self.wrong.merge(other.wrong);
        self.scored += other.scored;
    }

    fn print(&self) {
        println!(
            "\n--decide from 28 scans, each pair by itself: {} decided by a sample, of these {} wrong; {:.3} of the scans \
             scored in the mean",
            self.by_sample.show(),
            self.wrong.show(),
            self.scored / self.by_sample.of.max(1) as f64
        );
    }
}
