//! Scores places in parallel, each on one thread, look by look.

use std::sync::atomic::{AtomicUsize, Ordering};

use dmp_disk::WorkFolder;
use dmp_reduce::{Basis, Layout, Reducer};
use dmp_runs::{EvaluateError, Means, Run, RunPoses, ScoredPlace, Settings, Stage, Watch};

use super::scans::DriveScans;
use super::score::{PlaceScorer, PlaceTotals};
use super::way::PlaceScans;
use crate::means::{Extent, PlaceNeeds};
use crate::passes::Plan;

/// State shared by the threads.
pub(super) struct Pass<'p> {
    pub(super) scans: &'p DriveScans<'p>,
    pub(super) plan: &'p Plan,
    /// Returns of the largest scan that was read.
    pub(super) largest_scan: u64,
    pub(super) asked: &'p [Run],
    pub(super) settings: &'p Settings,
    pub(super) means: &'p Means,
    pub(super) watch: Watch<'p>,
}

/// The sums over the places scored so far.
pub(super) struct PlaceSums {
    pub(super) reducer: Reducer,
    pub(super) totals: PlaceTotals,
    /// How many looks they are of.
    pub(super) looks: usize,
    pub(super) threads: usize,
}

impl Pass<'_> {
    /// Scores places out of `all`, one per thread at a time: those of one look after the other, until they are enough.
    pub(super) fn run(
        &self,
        looks: &[Vec<(ScoredPlace, PlaceScans)>],
        all: u64,
        are_enough: impl Fn(&Reducer) -> bool,
    ) -> Result<PlaceSums, EvaluateError> {
        let needs = self.needs(looks)?;
        let most = looks.iter().map(Vec::len).max().unwrap_or(0);
        let (threads, mut means) = needs.share(self.means, most)?;
        // Every place writes to its own folder in this one.
        let folder = WorkFolder::new(&self.means.work_folder)?;
        means.work_folder = folder.path().to_path_buf();
        let layout = Layout::new(all, vec![Basis::CrossValidated; self.asked.len()])
            .with_miss_price(self.settings.miss_price);
        let mut sums = PlaceSums {
            reducer: Reducer::new(layout),
            totals: PlaceTotals::new(self.asked.len()),
            looks: 0,
            threads,
        };
        for look in looks {
            self.look(look, &means, needs.place, &mut sums)?;
            if are_enough(&sums.reducer) {
                break;
            }
        }
        Ok(sums)
    }

    /// Adds the places of a look.
    fn look(
        &self,
        drawn: &[(ScoredPlace, PlaceScans)],
        means: &Means,
        extent: Extent,
        sums: &mut PlaceSums,
    ) -> Result<(), EvaluateError> {
        let layout = sums.reducer.layout().clone();
        let progress = self.watch.progress;
        progress.begin(Stage::Places, drawn.len() as u64);
        let next = AtomicUsize::new(0);
        let work = || -> Result<(Reducer, PlaceTotals), EvaluateError> {
            let scorer = self.scorer(means, extent);
            let mut reducer = Reducer::new(layout.clone());
            let mut totals = PlaceTotals::new(self.asked.len());
            while let Some((place, scans)) = drawn.get(next.fetch_add(1, Ordering::Relaxed)) {
                if progress.cancelled() {
                    return Err(EvaluateError::Cancelled);
                }
                let sums = scorer.score(place.number, scans, &mut totals)?;
                reducer.add_frame(place.number as u64, &sums)?;
                self.watch.sink.place_scored(*place, &sums);
                progress.advance(1);
            }
            Ok((reducer, totals))
        };
        // After an error no thread begins another place.
        let stop = |_: &EvaluateError| next.store(drawn.len(), Ordering::Relaxed);
        let done: Vec<Result<(Reducer, PlaceTotals), EvaluateError>> = std::thread::scope(|scope| {
            let threads: Vec<_> =
                (0..sums.threads).map(|_| scope.spawn(|| work().inspect_err(stop))).collect();
            let resume = |panic| std::panic::resume_unwind(panic);
            threads.into_iter().map(|thread| thread.join().unwrap_or_else(resume)).collect()
        });
        for of_thread in done {
            let (reducer, totals) = of_thread?;
            sums.reducer.merge(&reducer)?;
            sums.totals.merge(totals);
        }
        sums.looks += 1;
        Ok(())
    }

    fn scorer<'s>(&'s self, means: &'s Means, extent: Extent) -> PlaceScorer<'s> {
        PlaceScorer {
            scans: self.scans,
            plan: self.plan,
            asked: self.asked,
            runs: self.scans.runs(),
            settings: self.settings,
            means,
            extent,
            watch: self.watch,
        }
    }

    /// Resources of a thread that scores one of some places.
    fn needs(&self, looks: &[Vec<(ScoredPlace, PlaceScans)>]) -> Result<PlaceNeeds, EvaluateError> {
        let largest_scan = self.largest_scan;
        let places = || looks.iter().flatten();
        let most_scans = places().map(|(_, scans)| scans.read.len()).max().unwrap_or(0);
        let (frames, runs) = (&self.scans.drive().frames, self.scans.runs());
        let extent_of = |scans: &PlaceScans| {
            let in_run = |run: &RunPoses| {
                let poses = scans.read.iter().filter_map(|&scan| run.of_frame(&frames[scan]));
                poses.map(|pose| [pose.translation.x, pose.translation.y]).collect::<Vec<_>>().into_iter()
            };
            Extent::of_place(runs.iter().map(|run| in_run(&run.poses)), self.settings)
        };
        let mut place = extent_of(&PlaceScans::default())?;
        for (_, scans) in places() {
            place = place.or_larger(extent_of(scans)?);
        }
        Ok(PlaceNeeds {
            returns: most_scans as u64 * largest_scan,
            largest_scan,
            row_bytes: self.scans.outline().summary().point_bytes as usize,
            scans: most_scans,
            scans_of_drive: frames.len(),
            poses: self.asked.iter().map(|run| run.trajectory.len()).sum(),
            place,
        })
    }
}
