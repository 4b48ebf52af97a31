//! The places that a drive passes, and the scans that see each of them.

#[cfg(test)]
mod tests;

use std::collections::{BTreeSet, HashMap};

use dmp_runs::RunPoses;

use crate::places::scans::DriveScans;
use crate::places::whereabouts::{Whereabouts, distance};

/// Length of a place along the path, metres.
pub(crate) const LENGTH_M: f64 = 10.0;
/// A scan on a later pass belongs to a place if it is this near to its centre in every run, metres. It is
/// more than half a length, so that no scan falls between two places.
const JOIN_M: f64 = 0.75 * LENGTH_M;
/// Scans at least this near to a place's centre make its map, metres.
const RADIUS_M: f64 = 35.0;
/// Distance travelled between scans that are read for a place, metres.
pub(crate) const SPACING_M: f64 = 4.0;
/// Scans packed together are read together. Then the path behind them is skipped in proportion to their
/// number, up to this distance, metres.
const MOST_LEFT_OUT_M: f64 = 12.0;
/// Above this number of scans for a place, every run is limited to its share of them. So a run that puts the
/// whole drive in one place neither reads all of it nor crowds out the others.
const MAX_SCANS: usize = 240;
const MAX_SCANS_OF_RUN: usize = 120;

/// A stretch of the path with all passes over it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    /// Ordinal of the scan in its middle on the first pass.
    pub(crate) centre: usize,
    /// Ordinals of its scans, of all passes, ascending. Every scan in use belongs to one place.
    pub(crate) scans: Vec<usize>,
}

/// The scans to read for a place.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PlaceScans {
    /// Ordinals of scans, ascending: all of them make its map.
    pub(crate) read: Vec<usize>,
    /// The scored ones.
    pub(crate) scored: BTreeSet<usize>,
    /// Whether the limit of scans for one place cut some.
    pub(crate) cut: bool,
}

/// The path of a drive and the scans' positions in every run, by ordinal.
#[derive(Debug)]
pub(crate) struct Way {
    /// The path length up to each scan, metres.
    along_m: Vec<f64>,
    of_runs: Vec<Whereabouts>,
    /// The group that each scan is packed in.
    groups: Vec<u32>,
    /// Scans within this distance of a place's centre make its map, metres: it covers the other segments that
    /// its scans depend on, on both sides.
    radius_m: f64,
}

impl Way {
    pub(crate) fn new(scans: &DriveScans<'_>) -> Self {
        let drive = scans.drive();
        let place = |frame, run: &RunPoses| {
            // Every scan of the drive has a pose in every run.
            run.of_frame(frame).map_or([f64::NAN; 3], |pose| pose.translation.vector.into())
        };
        let of_run = |run: &RunPoses| drive.frames.iter().map(|frame| place(frame, run)).collect();
        let segment_m = drive.longest_m.max(LENGTH_M);
        let places_m = scans.poses().map(of_run).collect();
        Self::of(drive.along_m.clone(), places_m, scans.groups(), segment_m)
    }

    fn of(along_m: Vec<f64>, places_m: Vec<Vec<[f64; 3]>>, groups: Vec<u32>, segment_m: f64) -> Self {
        let of_runs = places_m.into_iter().map(Whereabouts::new).collect();
        let radius_m = RADIUS_M.max(2.0 * segment_m + LENGTH_M + 1.0);
        Self { along_m, of_runs, groups, radius_m }
    }

    pub(crate) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Cuts the path into places, in their order along it; later passes join existing places. `O(scans)`
    /// unless a run piles up the whole drive.
    pub(crate) fn places(&self) -> Vec<Place> {
        let along_m = &self.along_m;
        let mut places: Vec<Place> = Vec::new();
        // By the cells of their centres in the first run.
        let mut centres: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
        let mut begun: Option<f64> = None;
        for (scan, &here_m) in along_m.iter().enumerate() {
            if let (Some(start_m), Some(place)) = (begun, places.last_mut()) {
                if here_m - start_m < LENGTH_M {
                    place.scans.push(scan);
                    continue;
                }
                place.centre = self.middle_of(&place.scans);
                centres.entry(self.of_runs[0].cell_of(place.centre)).or_default().push(places.len() - 1);
            }
            let around = Whereabouts::cells_around(self.of_runs[0].in_world_m[scan], JOIN_M);
            let near = around.filter_map(|cell| centres.get(&cell)).flatten().copied();
            let back = near
                .filter(|&place| here_m - along_m[places[place].centre] > 2.0 * LENGTH_M)
                .filter_map(|place| Some((self.apart_in_all(scan, places[place].centre, JOIN_M)?, place)))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            if let Some((_, place)) = back {
                places[place].scans.push(scan);
                begun = None;
                continue;
            }
            begun = Some(here_m);
            places.push(Place { centre: scan, scans: vec![scan] });
        }
        if let (Some(_), Some(place)) = (begun, places.last_mut()) {
            place.centre = self.middle_of(&place.scans);
        }
        places
    }

    /// Of consecutive scans the one nearest to the middle of their path.
    fn middle_of(&self, scans: &[usize]) -> usize {
        let [Some(&first), Some(&last)] = [scans.first(), scans.last()] else { return 0 };
        let middle_m = f64::midpoint(self.along_m[first], self.along_m[last]);
        let off_m = |scan: &&usize| (self.along_m[**scan] - middle_m).abs();
        scans.iter().min_by(|a, b| off_m(a).total_cmp(&off_m(b))).copied().unwrap_or(first)
    }

    /// The largest distance between two scans over all runs; `None` if it exceeds `most_m`.
    fn apart_in_all(&self, a: usize, b: usize, most_m: f64) -> Option<f64> {
        let apart = |run: &Whereabouts| distance(run.in_world_m[a], run.in_world_m[b]);
        let apart_m = self.of_runs.iter().map(apart).fold(0.0, f64::max);
        (apart_m <= most_m).then_some(apart_m)
    }

    /// The scans that any run puts within `radius_m` of the scan `centre`.
    fn near_in_any(&self, centre: usize, radius_m: f64) -> BTreeSet<usize> {
        self.of_runs.iter().flat_map(|run| run.within(run.in_world_m[centre], radius_m)).collect()
    }

    /// The scans to read for a place: in steps of [`SPACING_M`], on every pass.
    pub(crate) fn scans_of(&self, place: &Place) -> PlaceScans {
        let own: BTreeSet<usize> = place.scans.iter().copied().collect();
        let wanted = self.spaced(&own, &BTreeSet::new());
        let mut around = self.near_in_any(place.centre, self.radius_m);
        around.extend(&own);
        let mut read = self.spaced(&around, &wanted);
        let cut = read.len() > MAX_SCANS;
        if cut {
            read =
                self.of_runs.iter().flat_map(|run| self.share_of(run, place.centre, &own, &wanted)).collect();
        }
        let scored: BTreeSet<usize> = read.intersection(&own).copied().collect();
        PlaceScans { read: read.into_iter().collect(), scored, cut }
    }

    /// The scans to read for a place with too many: those near in one run, up to its share, and the `wanted`
    /// ones.
    fn share_of(
        &self,
        run: &Whereabouts,
        centre: usize,
        own: &BTreeSet<usize>,
        wanted: &BTreeSet<usize>,
    ) -> BTreeSet<usize> {
        let mut around: BTreeSet<usize> = run.within(run.in_world_m[centre], self.radius_m).collect();
        around.extend(own);
        let read: Vec<usize> = self.spaced(&around, wanted).into_iter().collect();
        let count = read.len().min(MAX_SCANS_OF_RUN);
        (0..count).map(|k| read[k * read.len() / count]).chain(wanted.iter().copied()).collect()
    }

    /// Thins scans to [`SPACING_M`] on average and keeps the `wanted` ones; scans packed together stay
    /// together.
    fn spaced(&self, scans: &BTreeSet<usize>, wanted: &BTreeSet<usize>) -> BTreeSet<usize> {
        let scans: Vec<usize> = scans.iter().copied().collect();
        let (mut kept, mut next_m) = (BTreeSet::new(), f64::NEG_INFINITY);
        for group in scans.chunk_by(|&a, &b| self.groups[a] == self.groups[b]) {
            let here_m = self.along_m[group[0]];
            if here_m >= next_m || group.iter().any(|scan| wanted.contains(scan)) {
                next_m = here_m + (group.len() as f64 * SPACING_M).min(MOST_LEFT_OUT_M);
                kept.extend(group);
            }
        }
        kept
    }
}
