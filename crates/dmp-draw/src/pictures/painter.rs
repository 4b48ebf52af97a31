//! What is seen of returns, made into pictures.

use std::collections::HashMap;

use dmp_reduce::{Basis, Scales};

use super::closeup::{Closeup, DiscInWorld};
use super::cloud;
use super::cloud::Cloud;
use super::ground::{Difference, Grid, Ground};
use super::histogram::Histogram;
use super::seen::{SampledReturn, SeenFrame};
use super::worst::{WorstPlace, worst_places};

/// Places with pictures, of all runs together.
const CLOSEUPS: usize = 20;
/// Runs whose maps are drawn.
const GROUNDS: usize = 12;

/// Takes a sample of the returns in the order of the log, and the surfels around the worst places.
///
/// Memory is 64 bytes for each scored scan and run, and for each of the twelve best runs 24 bytes for each of at most
/// 160,000 cells of its map. Points that turn in three dimensions are 160,000 of 8 bytes at most.
#[derive(Debug)]
pub struct Painter {
    pictures: Pictures,
    /// Runs and windows that the returns of a scored scan are drawn in, by its index.
    windows_of: HashMap<usize, Vec<(usize, usize)>>,
}

/// What there is to see of an evaluation.
#[derive(Debug)]
pub struct Pictures {
    /// Lengths that are drawn are in proportion to those of its kind.
    pub(crate) scales: Scales,
    pub(crate) frames: Vec<SeenFrame>,
    /// Stamp of the log's first scan; `None` in a log without stamps.
    pub(crate) start_ns: Option<i64>,
    pub(crate) bases: Vec<Basis>,
    /// Indices of the runs, best first.
    pub(crate) order: Vec<usize>,
    /// The worst places of every run, the worst first.
    pub(crate) places: Vec<Vec<WorstPlace>>,
    /// Pictures of the first of them.
    pub(crate) closeups: Vec<Vec<Closeup>>,
    /// Maps of the best runs; `None` for the others.
    pub(crate) grounds: Vec<Option<Ground>>,
    /// Samples of the maps of the best runs; `None` for the others.
    pub(crate) clouds: Vec<Option<Cloud>>,
    /// The second run against the best one, where there are two.
    pub(crate) difference: Option<Difference>,
    pub(crate) histograms: Vec<Histogram>,
    /// Returns that were drawn.
    pub(crate) sampled: u64,
}

impl Painter {
    /// Of an evaluation whose scored scans are these, in the order of their time, of a log of this kind. `start_ns` is the stamp of the log's
    /// first scan, `bases` says how every run is judged, `order` has the indices of the runs, best first; `returns` is how
    /// many sampled returns a run will have.
    pub fn new(
        scales: Scales,
        frames: Vec<SeenFrame>,
        start_ns: Option<i64>,
        bases: Vec<Basis>,
        order: Vec<usize>,
        returns: u64,
    ) -> Self {
        let runs = bases.len();
        let places = worst_places(&frames, runs, scales);
        let of_each = (CLOSEUPS / runs.max(1)).max(1);
        let a_frame = returns as usize / frames.len().max(1);
        let closeup = |place: &WorstPlace| {
            let scans: usize = place.passes.iter().map(|pass| pass.frames[1] - pass.frames[0] + 1).sum();
            Closeup::new(place, a_frame * scans, scales)
        };
        let mut left = CLOSEUPS;
        let mut closeups: Vec<Vec<Closeup>> = places.iter().map(|_| Vec::new()).collect();
        for &run in &order {
            closeups[run] = places[run].iter().take(of_each.min(left)).map(closeup).collect();
            left -= closeups[run].len();
        }
        let mut windows_of: HashMap<usize, Vec<(usize, usize)>> = HashMap::new();
        for (run, places) in places.iter().enumerate() {
            for (window, place) in places.iter().take(closeups[run].len()).enumerate() {
                for frame in place.passes.iter().flat_map(|pass| pass.frames[0]..=pass.frames[1]) {
                    windows_of.entry(frame).or_default().push((run, window));
                }
            }
        }
        let way = |run: usize| frames.iter().map(move |frame| frame.position_in_world_m[run]);
        let drawn: Vec<usize> = order.iter().copied().take(GROUNDS).collect();
        let mut grounds: Vec<Option<Ground>> = (0..runs).map(|_| None).collect();
        for &run in &drawn {
            grounds[run] = Some(Ground::new(Grid::around(way(run), scales), scales));
        }
        let shown = order.len().min(cloud::RUNS);
        let mut clouds: Vec<Option<Cloud>> = (0..runs).map(|_| None).collect();
        for &run in &order[..shown] {
            clouds[run] = Some(Cloud::new(&way(run), returns, shown, scales));
        }
        let difference =
            (order.len() > 1).then(|| Difference::new(Grid::around(way(order[0]), scales), scales));
        let histograms = vec![Histogram::new(scales); runs];
        let pictures = Pictures {
            scales,
            frames,
            start_ns,
            bases,
            order,
            places,
            closeups,
            grounds,
            clouds,
            difference,
            histograms,
            sampled: 0,
        };
        Self { pictures, windows_of }
    }

    /// The windows for which surfels are to be given, as run, number of the window, and smallest and largest x and y in
    /// the world of the run.
    pub fn windows(&self) -> Vec<(usize, usize, [[f64; 2]; 2])> {
        let of_run = |(run, closeups): (usize, &Vec<Closeup>)| {
            let window = |(number, closeup): (usize, &Closeup)| (run, number, closeup.extent_m());
            closeups.iter().enumerate().map(window).collect::<Vec<_>>()
        };
        self.pictures.closeups.iter().enumerate().flat_map(of_run).collect()
    }

    /// Draws a surfel of a run's map in one of its windows. What lies outside is left out.
    pub fn disc(&mut self, run: usize, window: usize, disc: &DiscInWorld) {
        if let Some(closeup) =
            self.pictures.closeups.get_mut(run).and_then(|closeups| closeups.get_mut(window))
        {
            closeup.disc(disc);
        }
    }

    /// The runs whose whole maps are drawn: their surfels are to be given.
    pub fn clouds(&self) -> Vec<usize> {
        let clouds = self.pictures.clouds.iter().enumerate();
        clouds.filter_map(|(run, cloud)| cloud.as_ref().map(|_| run)).collect()
    }

    /// Draws the surfel of this number, from 0, of the map of a run, which has so many in all. Of a large map one of several is
    /// kept.
    pub fn surfel(&mut self, run: usize, (number, of_all): (u64, u64), disc: &DiscInWorld) {
        if let Some(Some(cloud)) = self.pictures.clouds.get_mut(run) {
            cloud.disc(number, of_all, disc);
        }
    }

    /// Draws one return of the scored scan of this index: what every run makes of it, in the order of the runs.
    pub fn sampled(&mut self, frame: usize, of_runs: &[SampledReturn]) {
        let pictures = &mut self.pictures;
        let Some(positions) = pictures.frames.get(frame).map(|frame| &frame.position_in_world_m) else {
            return;
        };
        pictures.sampled += 1;
        for (run, (sampled, sensor_m)) in of_runs.iter().zip(positions).enumerate() {
            let at_m = endpoint_m(*sensor_m, sampled);
            if let Some(ground) = &mut pictures.grounds[run] {
                ground.add(at_m, sampled);
            }
            if let Some(cloud) = &mut pictures.clouds[run] {
                cloud.sampled(*sensor_m, sampled);
            }
            pictures.histograms[run].add(sampled);
        }
        for &(run, window) in self.windows_of.get(&frame).into_iter().flatten() {
            pictures.closeups[run][window].sampled(positions[run], &of_runs[run]);
        }
        let Some(difference) = &mut pictures.difference else { return };
        let [best, second] = [pictures.order[0], pictures.order[1]];
        if let (Some(a), Some(b)) = (of_runs[best].residual_m, of_runs[second].residual_m) {
            difference.add(endpoint_m(positions[best], &of_runs[best]), [a, b]);
        }
    }

    /// Everything that was drawn.
    pub fn finish(self) -> Pictures {
        let Pictures { grounds, difference, .. } = self.pictures;
        let grounds = grounds.into_iter().map(|ground| ground.map(Ground::trimmed)).collect();
        Pictures { grounds, difference: difference.map(Difference::trimmed), ..self.pictures }
    }
}

impl Pictures {
    /// The worst places of every run, the worst first.
    pub fn worst_places(&self) -> &[Vec<WorstPlace>] {
        &self.places
    }
}

fn endpoint_m(sensor_m: [f64; 3], sampled: &SampledReturn) -> [f64; 2] {
    [0, 1].map(|axis: usize| sensor_m[axis] + f64::from(sampled.from_sensor_m[axis]))
}
