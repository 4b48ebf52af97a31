//! `cargo xtask study places`: what samples of places say, against all places and against all scans.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context as _, ensure};
use dmp::{Config, FrameSums, ScoredPlace, Sink, Watch, drawn_places, evaluate_quick};
use dmp_log::{LogOptions, outline_log};
use dmp_reduce::{Basis, Layout, MissPrice, Reducer};

use super::drives::{DriveSpec, drives, find};
use super::logs::log_and_runs;
use super::sample::counts::Samples;
use super::sample::{Full, frames_of};

/// Samples of each drive's places, drawn by many seeds, against all its places and all its scans
#[derive(Debug, clap::Args)]
pub(super) struct PlacesArgs {
    /// Only these drives, comma-separated; all of them by default
    #[arg(long, value_delimiter = ',')]
    drives: Vec<String>,
    /// Places of a sample, each number in its turn
    #[arg(long, value_delimiter = ',', default_values_t = [12, 20, 28])]
    sizes: Vec<usize>,
    /// Samples that are drawn of each drive
    #[arg(long, default_value_t = 500)]
    seeds: u64,
    /// Where the drives' logs are kept
    #[arg(long, default_value = "target/study", value_name = "FOLDER")]
    out: PathBuf,
}

pub(super) fn run(arguments: &PlacesArgs) -> anyhow::Result<()> {
    std::fs::create_dir_all(&arguments.out).with_context(|| arguments.out.display().to_string())?;
    for name in &arguments.drives {
        find(name)?;
    }
    let wanted =
        |spec: &DriveSpec| arguments.drives.is_empty() || arguments.drives.iter().any(|d| d == spec.name);
    let mut found = Vec::new();
    for spec in drives().iter().filter(|spec| wanted(spec)) {
        found.push(Drive::score(spec, &arguments.out)?);
    }
    println!("all places against all scans\n{}", Bias::HEAD);
    let of_drives: Vec<Bias> = found.iter().map(Drive::bias).collect();
    for (drive, bias) in found.iter().zip(&of_drives) {
        bias.print(drive);
    }
    for of_size in samples(&found, arguments)? {
        of_size.print();
    }
    println!(
        "{} samples of each drive and size. The columns are those of `cargo xtask study sample`, with places for scans",
        arguments.seeds
    );
    Ok(())
}

/// Samples against one of the two truths, and what it is called.
struct Against<'a> {
    title: &'static str,
    /// By drive and size, in that order.
    counts: Vec<(&'a Drive, usize, Samples)>,
}

/// Every sample is drawn once and held against both.
fn samples<'a>(found: &'a [Drive], arguments: &PlacesArgs) -> anyhow::Result<[Against<'a>; 2]> {
    let mut places = Against { title: "samples of places against all places", counts: Vec::new() };
    let mut scans = Against { title: "the same against all scans", counts: Vec::new() };
    for drive in found {
        for &size in &arguments.sizes {
            let (mut by_places, mut by_scans) = (Samples::default(), Samples::default());
            for seed in 0..arguments.seeds {
                let sample = drive.places.reducer(drawn_places(&drive.revisited, size, seed))?;
                by_places.add(&sample, &drive.by_places);
                by_scans.add(&sample, &drive.by_scans);
            }
            places.counts.push((drive, size, by_places));
            scans.counts.push((drive, size, by_scans));
        }
    }
    Ok([places, scans])
}

impl Against<'_> {
    fn print(&self) {
        println!("\n{}\n{}", self.title, Samples::HEAD);
        let mut of_sizes = BTreeMap::new();
        for (drive, size, counts) in &self.counts {
            let of = (drive.revisited.len(), drive.by_scans.pairs.len());
            counts.print(drive.name, Some(of), *size as u64);
            of_sizes.entry(*size).or_insert_with(Samples::default).merge(counts);
        }
        for (size, counts) in &of_sizes {
            counts.print("all drives", None, *size as u64);
        }
    }
}

/// The sums of every place of a drive.
struct PlaceSums {
    sums: Vec<FrameSums>,
    layout: Layout,
}

impl PlaceSums {
    fn reducer(&self, places: impl IntoIterator<Item = usize>) -> anyhow::Result<Reducer> {
        let mut reducer = Reducer::new(self.layout.clone());
        for place in places {
            reducer.add_frame(place as u64, &self.sums[place])?;
        }
        Ok(reducer)
    }
}

/// A drive, scored at all places and on all scans.
struct Drive {
    name: &'static str,
    places: PlaceSums,
    revisited: Vec<bool>,
    by_places: Full,
    by_scans: Full,
}

impl Drive {
    fn score(spec: &DriveSpec, work: &Path) -> anyhow::Result<Self> {
        let frames = frames_of(spec, work)?;
        let by_scans = Full::of(&frames.reducer(0..frames.len())?);
        let (path, runs) = log_and_runs(spec, work)?;
        let outline = outline_log(&path, &LogOptions::default())?;
        let kept = Kept::default();
        evaluate_quick(&outline, &runs, &Config::default(), 1.0, Watch::sink(&kept))
            .with_context(|| spec.name.to_owned())?;
        let kept = kept.0.into_inner().unwrap_or_else(PoisonError::into_inner);
        ensure!(kept.keys().map(|number| number + 1).eq(1..=kept.len()), "{}: not all places", spec.name);
        let (revisited, sums): (Vec<bool>, Vec<FrameSums>) = kept.into_values().unzip();
        let layout = Layout::new(sums.len() as u64, vec![Basis::CrossValidated; runs.len()]);
        let places = PlaceSums { sums, layout: layout.with_miss_price(MissPrice::default()) };
        let by_places = Full::of(&places.reducer(0..revisited.len())?);
        Ok(Self { name: spec.name, places, revisited, by_places, by_scans })
    }

    fn bias(&self) -> Bias {
        let ratio = |(places, scans): (&Option<f64>, &Option<f64>)| Some((*places)? / (*scans)?);
        let runs: Vec<f64> = self.by_places.runs.iter().zip(&self.by_scans.runs).filter_map(ratio).collect();
        let mut bias = Bias { runs: median(runs), ..Bias::default() };
        let (mut both, mut square, mut alike, mut pairs, mut widths) = (0.0, 0.0, 0, 0, Vec::new());
        for (places, scans) in self.by_places.pairs.iter().zip(&self.by_scans.pairs) {
            let (places, scans) = (&places.scales[0], &scans.scales[0]);
            let (Some(a), Some(b)) = (places.difference, scans.difference) else { continue };
            both += a.value_m2 * b.value_m2;
            square += b.value_m2 * b.value_m2;
            pairs += 1;
            alike += usize::from((a.value_m2 < 0.0) == (b.value_m2 < 0.0));
            if let (Some(a), Some(b)) = (places.interval(), scans.interval()) {
                widths.push((a.high_m2 - a.low_m2) / (b.high_m2 - b.low_m2));
            }
        }
        bias.differences = both / square;
        bias.sign = f64::from(alike as u32) / f64::from(pairs.max(1));
        bias.width = median(widths);
        bias
    }
}

/// How all places differ from all scans.
#[derive(Debug, Default)]
struct Bias {
    /// `R_cv(10)`, the median over the runs of one by the other.
    runs: f64,
    /// Differences of pairs at 10 m: the slope of one over the other.
    differences: f64,
    /// Share of pairs with the same sign at 10 m.
    sign: f64,
    /// Intervals of pairs at 10 m: the median of one's width by the other's.
    width: f64,
}

impl Bias {
    const HEAD: &str = "drive          places  revisited     R_cv  differences    sign   width";

    fn print(&self, drive: &Drive) {
        let revisited = drive.revisited.iter().filter(|&&revisited| revisited).count();
        println!(
            "{:<14}{:>7}{revisited:>11}{:>9.3}{:>13.3}{:>8.3}{:>8.3}",
            drive.name,
            drive.revisited.len(),
            self.runs,
            self.differences,
            self.sign,
            self.width
        );
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Keeps what is said of every place.
#[derive(Default)]
struct Kept(Mutex<BTreeMap<usize, (bool, FrameSums)>>);

impl Sink for Kept {
    fn place_scored(&self, place: ScoredPlace, sums: &FrameSums) {
        let kept = (place.is_revisited, sums.clone());
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(place.number, kept);
    }
}
