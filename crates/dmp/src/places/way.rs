//! The places that a drive passes, and the scans that see each of them.

use std::collections::{BTreeSet, HashMap};

use dmp_log::LogOutline;

use crate::plan::Drive;

/// Length of the stretch of the way that is a place, metres.
pub(crate) const LENGTH_M: f64 = 10.0;
/// A scan on a later pass belongs to the place whose centre it comes this near to in every run, metres: half a length
/// and some more, so that no scan falls between two places.
const JOIN_M: f64 = 0.75 * LENGTH_M;
/// Scans this near to a place's centre make its map, metres: what its scans need of other segments, on both sides.
pub(crate) const RADIUS_M: f64 = 35.0;
/// The way between scans that are read for a place, metres.
pub(crate) const SPACING_M: f64 = 4.0;
/// Scans that are packed together are read together, and then as much of the way as they stand for is left out behind
/// them: up to so much, metres.
const MOST_LEFT_OUT_M: f64 = 12.0;
/// Segments that must lie between two scans for one to see a place again: as for the coverage by revisits.
const REVISIT_SEGMENTS: f64 = 5.0;
/// How near the way must come back, metres.
const REVISIT_M: f64 = 20.0;
/// Scans that are read for one place at most: a run that puts the whole drive in one place must not have all of it
/// read.
const MAX_SCANS: usize = 240;

/// A stretch of the way with all passes over it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    /// Ordinal of the scan in its middle on the first pass.
    pub(crate) centre: usize,
    /// Ordinals of its scans, of all passes, ascending. Every scan in use belongs to one place.
    pub(crate) scans: Vec<usize>,
}

/// What is read for a place.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PlaceScans {
    /// Ordinals of scans, ascending: its map is made of all of them.
    pub(crate) read: Vec<usize>,
    /// Those that are scored.
    pub(crate) scored: BTreeSet<usize>,
    /// Whether there were more than are read for one place.
    pub(crate) cut: bool,
}

/// A drive, and where every run has its scans.
#[derive(Debug)]
pub(crate) struct Way<'a> {
    drive: &'a Drive<'a>,
    of_runs: Vec<Whereabouts>,
    /// By the number of a scan in the log, its ordinal in the drive.
    ordinals: HashMap<usize, usize>,
    /// For each scan of the drive what it is packed in.
    groups: Vec<u32>,
}

/// Where a run has the scans, by cells of the plane.
#[derive(Debug)]
struct Whereabouts {
    in_world_m: Vec<[f64; 3]>,
    cells: HashMap<[i64; 2], Vec<usize>>,
}

impl<'a> Way<'a> {
    /// The way of a drive on the log that `outline` tells of.
    pub(crate) fn new(drive: &'a Drive<'a>, outline: &LogOutline) -> Self {
        let place = |frame, run: &crate::pose::RunPoses<'_>| {
            // Every scan in use has a pose in every run.
            run.of_frame(frame).map_or([f64::NAN; 3], |pose| pose.translation.vector.into())
        };
        let whereabouts =
            |run| Whereabouts::new(drive.frames().iter().map(|frame| place(frame, run)).collect());
        let numbers = drive.frames().iter().enumerate().map(|(ordinal, frame)| (frame.number, ordinal));
        let ordinals = numbers.collect();
        let groups = drive.frames().iter().map(|frame| outline.scans()[frame.number].group).collect();
        Self { drive, of_runs: drive.poses.iter().map(whereabouts).collect(), ordinals, groups }
    }

    pub(crate) fn drive(&self) -> &'a Drive<'a> {
        self.drive
    }

    /// The ordinal in the drive of the scan that has this number in the log; `None` where it is not in use.
    pub(crate) fn ordinal_of(&self, number: usize) -> Option<usize> {
        self.ordinals.get(&number).copied()
    }

    /// Cuts the way into places, in their order along it: stretches of it, but for later passes over them. `O(scans)`
    /// where no run heaps up the drive.
    pub(crate) fn places(&self) -> Vec<Place> {
        let along_m = &self.drive.along_m;
        let mut places: Vec<Place> = Vec::new();
        // By the cells of their centres in the first run.
        let mut centres: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
        let mut at: Option<(usize, f64)> = None;
        for (scan, &here_m) in along_m.iter().enumerate() {
            if let Some((place, _)) = at.filter(|(_, start_m)| here_m - start_m < LENGTH_M) {
                places[place].scans.push(scan);
                continue;
            }
            let around = Whereabouts::cells_around(self.of_runs[0].in_world_m[scan], JOIN_M);
            let near = around.filter_map(|cell| centres.get(&cell)).flatten().copied();
            let back = near
                .filter(|&place| here_m - along_m[places[place].centre] > 2.0 * LENGTH_M)
                .filter_map(|place| Some((self.apart_in_all(scan, places[place].centre, JOIN_M)?, place)))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            if let Some((_, place)) = back {
                places[place].scans.push(scan);
                at = None;
                continue;
            }
            let centre = along_m.partition_point(|&m| m < here_m + 0.5 * LENGTH_M);
            let centre = centre.clamp(scan, along_m.len() - 1);
            centres.entry(self.of_runs[0].cell_of(centre)).or_default().push(places.len());
            at = Some((places.len(), here_m));
            places.push(Place { centre, scans: vec![scan] });
        }
        places
    }

    /// How far two scans are apart in the run where that is most; `None` where that is more than `most_m`.
    fn apart_in_all(&self, a: usize, b: usize, most_m: f64) -> Option<f64> {
        let apart = |run: &Whereabouts| distance(run.in_world_m[a], run.in_world_m[b]);
        let apart_m = self.of_runs.iter().map(apart).fold(0.0, f64::max);
        (apart_m <= most_m).then_some(apart_m)
    }

    /// The scans that any run has within `radius_m` of where it has the scan `centre`.
    fn near_in_any(&self, centre: usize, radius_m: f64) -> BTreeSet<usize> {
        self.of_runs.iter().flat_map(|run| run.within(run.in_world_m[centre], radius_m)).collect()
    }

    /// What is to be read for a place: scans in steps of [`SPACING_M`], on every pass.
    pub(crate) fn scans_of(&self, place: &Place) -> PlaceScans {
        let own: BTreeSet<usize> = place.scans.iter().copied().collect();
        let wanted = self.spaced(&own, &BTreeSet::new());
        let mut around = self.near_in_any(place.centre, RADIUS_M);
        around.extend(&own);
        let mut read = self.spaced(&around, &wanted);
        let scored: BTreeSet<usize> = read.intersection(&own).copied().collect();
        let cut = read.len() > MAX_SCANS;
        if cut {
            let beside: Vec<usize> = read.difference(&scored).copied().collect();
            let room = MAX_SCANS.saturating_sub(scored.len());
            let kept = (0..room).filter_map(|k| beside.get(k * beside.len() / room.max(1)));
            read = kept.chain(&scored).copied().collect();
        }
        PlaceScans { read: read.into_iter().collect(), scored, cut }
    }

    /// Those of the scans that are steps of the way apart, [`SPACING_M`] on average, and those that are `wanted`; what
    /// is packed together stays together.
    fn spaced(&self, scans: &BTreeSet<usize>, wanted: &BTreeSet<usize>) -> BTreeSet<usize> {
        let scans: Vec<usize> = scans.iter().copied().collect();
        let (mut kept, mut next_m) = (BTreeSet::new(), f64::NEG_INFINITY);
        for group in scans.chunk_by(|&a, &b| self.groups[a] == self.groups[b]) {
            let here_m = self.drive.along_m[group[0]];
            if here_m >= next_m || group.iter().any(|scan| wanted.contains(scan)) {
                next_m = here_m + (group.len() as f64 * SPACING_M).min(MOST_LEFT_OUT_M);
                kept.extend(group);
            }
        }
        kept
    }

    /// Whether any run has the way come back to the place.
    pub(crate) fn is_revisited(&self, place: &Place) -> bool {
        let along_m = &self.drive.along_m;
        let segment_m = self.drive.segments.length_m.unwrap_or(LENGTH_M).max(LENGTH_M);
        let far = |scan: &usize| {
            (along_m[*scan] - along_m[place.centre]).abs() > REVISIT_SEGMENTS * segment_m + REVISIT_M
        };
        self.near_in_any(place.centre, REVISIT_M).iter().any(far)
    }
}

impl Whereabouts {
    /// Edge of the cells, metres.
    const CELL_M: f64 = RADIUS_M;

    fn new(in_world_m: Vec<[f64; 3]>) -> Self {
        let mut cells: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
        for (scan, &[x, y, _]) in in_world_m.iter().enumerate() {
            cells.entry(Self::cell([x, y])).or_default().push(scan);
        }
        Self { in_world_m, cells }
    }

    fn cell(place_m: [f64; 2]) -> [i64; 2] {
        place_m.map(|c| (c / Self::CELL_M).floor() as i64)
    }

    fn cell_of(&self, scan: usize) -> [i64; 2] {
        let [x, y, _] = self.in_world_m[scan];
        Self::cell([x, y])
    }

    /// The cells that hold what is within `radius_m`, at most a cell's edge.
    fn cells_around([x, y, _]: [f64; 3], radius_m: f64) -> impl Iterator<Item = [i64; 2]> + use<> {
        let (low, high) =
            (Self::cell([x - radius_m, y - radius_m]), Self::cell([x + radius_m, y + radius_m]));
        (low[0]..=high[0]).flat_map(move |i| (low[1]..=high[1]).map(move |j| [i, j]))
    }

    fn within(&self, centre_m: [f64; 3], radius_m: f64) -> impl Iterator<Item = usize> + '_ {
        let scans = Self::cells_around(centre_m, radius_m).filter_map(|cell| self.cells.get(&cell)).flatten();
        scans.copied().filter(move |&scan| distance(self.in_world_m[scan], centre_m) <= radius_m)
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
