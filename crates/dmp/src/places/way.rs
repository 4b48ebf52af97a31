//! The places that a drive passes, and the scans that see each of them.

use std::collections::{BTreeSet, HashMap};

use super::scans::DriveScans;
use crate::plan::Drive;
use crate::pose::RunPoses;
use crate::segment_length::SegmentLength;

/// Length of the stretch of the way that is a place, metres.
pub(crate) const LENGTH_M: f64 = 10.0;
/// A scan on a later pass belongs to the place whose centre it comes this near to in every run, metres: half a length
/// and some more, so that no scan falls between two places.
const JOIN_M: f64 = 0.75 * LENGTH_M;
/// Scans at least this near to a place's centre make its map, metres.
const RADIUS_M: f64 = 35.0;
/// The way between scans that are read for a place, metres.
pub(crate) const SPACING_M: f64 = 4.0;
/// Scans that are packed together are read together, and then as much of the way as they stand for is left out behind
/// them: up to so much, metres.
const MOST_LEFT_OUT_M: f64 = 12.0;
/// Segments that must lie between two scans for one to see a place again: as for the coverage by revisits.
const REVISIT_SEGMENTS: f64 = 5.0;
/// How near the way must come back, metres.
const REVISIT_M: f64 = 20.0;
/// Scans beyond which every run is given its share of those that are read for a place, and the share: a run that
/// puts the whole drive in one place must neither have all of it read nor leave no room for the others.
const MAX_SCANS: usize = 240;
const MAX_SCANS_OF_RUN: usize = 120;

/// The way that the longest segment takes, metres.
fn longest_m(drive: &Drive) -> f64 {
    let last = drive.along_m.len() - 1;
    let ends = drive.segments.starts.iter().skip(1).chain([&last]);
    let ways = drive
        .segments
        .starts
        .iter()
        .zip(ends)
        .map(|(&start, &end)| drive.along_m[end] - drive.along_m[start]);
    ways.fold(0.0, f64::max)
}

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

/// How the way of a drive leads, and where every run has its scans, by their ordinals.
#[derive(Debug)]
pub(crate) struct Way {
    /// The way up to each scan, metres.
    along_m: Vec<f64>,
    of_runs: Vec<Whereabouts>,
    /// What each scan is packed in.
    groups: Vec<u32>,
    /// Length of the segments of the drive, metres.
    segment_m: f64,
    /// How near to a place's centre scans make its map, metres: what its scans need of other segments, on both sides,
    /// as far as they are independent.
    radius_m: f64,
}

/// Where a run has the scans, by cells of the plane.
#[derive(Debug)]
struct Whereabouts {
    in_world_m: Vec<[f64; 3]>,
    cells: HashMap<[i64; 2], Vec<usize>>,
}

impl Way {
    pub(crate) fn new(scans: &DriveScans<'_>) -> Self {
        let drive = scans.drive();
        let place = |frame, run: &RunPoses| {
            // Every scan in use has a pose in every run.
            run.of_frame(frame).map_or([f64::NAN; 3], |pose| pose.translation.vector.into())
        };
        let of_run = |run: &RunPoses| drive.frames().iter().map(|frame| place(frame, run)).collect();
        let segment_m = match drive.segments.length {
            Some(SegmentLength::Metres(m)) => m.max(LENGTH_M),
            // The way that the longest takes.
            Some(SegmentLength::Seconds(_) | SegmentLength::Scans(_)) => longest_m(drive).max(LENGTH_M),
            None => LENGTH_M,
        };
        let places_m = scans.poses().map(of_run).collect();
        Self::of(drive.along_m.clone(), places_m, scans.groups(), segment_m)
    }

    fn of(along_m: Vec<f64>, places_m: Vec<Vec<[f64; 3]>>, groups: Vec<u32>, segment_m: f64) -> Self {
        let of_runs = places_m.into_iter().map(Whereabouts::new).collect();
        let radius_m = RADIUS_M.max(2.0 * segment_m + LENGTH_M + 1.0);
        Self { along_m, of_runs, groups, segment_m, radius_m }
    }

    pub(crate) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// The longest pass through a place: scans that follow one another.
    pub(crate) fn pass_of<'p>(&self, place: &'p PlaceScans) -> &'p [usize] {
        let follows =
            |a: &usize, b: &usize| self.along_m[*b] - self.along_m[*a] <= MOST_LEFT_OUT_M + SPACING_M;
        place.read.chunk_by(follows).max_by_key(|pass| pass.len()).unwrap_or_default()
    }

    /// Cuts the way into places, in their order along it: stretches of it, but for later passes over them. `O(scans)`
    /// where no run heaps up the drive.
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

    /// Of scans that follow each other the one nearest to the middle of the way from the first to the last.
    fn middle_of(&self, scans: &[usize]) -> usize {
        let [Some(&first), Some(&last)] = [scans.first(), scans.last()] else { return 0 };
        let middle_m = f64::midpoint(self.along_m[first], self.along_m[last]);
        let off_m = |scan: &&usize| (self.along_m[**scan] - middle_m).abs();
        scans.iter().min_by(|a, b| off_m(a).total_cmp(&off_m(b))).copied().unwrap_or(first)
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

    /// What is read for a place where there is too much for all: the scans that one run has near, no more than its
    /// share, and those that are `wanted`.
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

    /// Those of the scans that are steps of the way apart, [`SPACING_M`] on average, and those that are `wanted`; what
    /// is packed together stays together.
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

    /// Whether most runs have the way come back to the place.
    pub(crate) fn is_revisited(&self, place: &Place) -> bool {
        let along_m = &self.along_m;
        let far = |scan: &usize| {
            (along_m[*scan] - along_m[place.centre]).abs() > REVISIT_SEGMENTS * self.segment_m + REVISIT_M
        };
        let comes_back =
            |run: &&Whereabouts| run.within(run.in_world_m[place.centre], REVISIT_M).any(|scan| far(&scan));
        2 * self.of_runs.iter().filter(comes_back).count() > self.of_runs.len()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A way that goes through these points, a scan every metre.
    fn through(corners: &[[f64; 2]]) -> Vec<[f64; 3]> {
        let mut places = Vec::new();
        for leg in corners.windows(2) {
            let length_m = (leg[1][0] - leg[0][0]).hypot(leg[1][1] - leg[0][1]);
            for k in 0..length_m as usize {
                let part = k as f64 / length_m;
                let at = |c: usize| leg[0][c] + part * (leg[1][c] - leg[0][c]);
                places.push([at(0), at(1), 0.0]);
            }
        }
        places
    }

    fn way(of_runs: &[Vec<[f64; 3]>], in_a_group: u32) -> Way {
        let scans = of_runs[0].len();
        let groups = (0..scans as u32).map(|scan| scan / in_a_group).collect();
        Way::of((0..scans).map(|scan| scan as f64).collect(), of_runs.to_vec(), groups, 12.0)
    }

    /// Twice round a block of 100 m by 60 m, and on for 200 m.
    fn twice_round() -> Vec<[f64; 3]> {
        let round = [[0.0, 0.0], [100.0, 0.0], [100.0, 60.0], [0.0, 60.0]];
        let corners = [&round[..], &round[..], &[[0.0, 0.0], [-200.0, 0.0]]].concat();
        through(&corners)
    }

    fn shifted(places: &[[f64; 3]], by: impl Fn(usize) -> [f64; 3]) -> Vec<[f64; 3]> {
        let shift = |(k, place): (usize, &[f64; 3])| std::array::from_fn(|c| place[c] + by(k)[c]);
        places.iter().enumerate().map(shift).collect()
    }

    #[test]
    fn every_scan_is_in_one_place_and_later_passes_join() {
        let truth = twice_round();
        // In a world of its own, and off by up to a metre.
        let drifting = shifted(&truth, |k| [5000.0 + 0.001 * k as f64, -7.0, 0.0]);
        for runs in [vec![truth.clone()], vec![truth.clone(), drifting]] {
            let way = way(&runs, 1);
            let places = way.places();
            let mut scans: Vec<usize> = places.iter().flat_map(|place| place.scans.clone()).collect();
            scans.sort_unstable();
            assert!(scans.iter().copied().eq(0..truth.len()));
            // 320 m round and 200 m on: the second round makes hardly a place of its own.
            assert!((50..=58).contains(&places.len()), "{}", places.len());
            let twice = places.iter().filter(|place| place.scans.len() > 15).count();
            assert!(twice >= 25, "{twice}");
            for place in &places {
                let [x, y, _] = truth[place.centre];
                for &scan in &place.scans {
                    assert!((truth[scan][0] - x).hypot(truth[scan][1] - y) <= 10.0, "{place:?}");
                }
                let back = place.scans.last().unwrap() - place.scans[0] > 100;
                assert!(!back || way.is_revisited(place));
                assert!(way.is_revisited(place) || place.centre > 600 || x < -1.0, "{place:?}");
            }
        }
    }

    #[test]
    fn a_run_that_lost_its_way_does_not_make_places_of_others() {
        let truth = twice_round();
        let collapsed = vec![[0.0; 3]; truth.len()];
        let (alone, both) = (way(std::slice::from_ref(&truth), 1), way(&[truth.clone(), collapsed], 1));
        assert_eq!(alone.places(), both.places());
        let place = &both.places()[20];
        let scans = both.scans_of(place);
        // It puts every scan there: not all are read, but those that are scored are.
        assert!(scans.read.len() <= MAX_SCANS && scans.scored.iter().all(|scan| scans.read.contains(scan)));
        assert!(scans.read.len() > alone.scans_of(place).read.len());
    }

    #[test]
    fn a_run_that_lost_its_way_leaves_the_others_their_scans() {
        let truth = through(&[[0.0, 0.0], [3000.0, 0.0], [3000.0, 2000.0]]);
        let collapsed = vec![[0.0; 3]; truth.len()];
        let (alone, both) =
            (way(std::slice::from_ref(&truth), 1), way(&[truth.clone(), collapsed.clone(), collapsed], 1));
        for place in both.places().iter().step_by(37) {
            let (of_one, of_all) = (alone.scans_of(place), both.scans_of(place));
            assert!(of_all.cut && of_all.read.len() <= MAX_SCANS + of_one.read.len());
            assert!(of_one.read.iter().all(|scan| of_all.read.contains(scan)), "{place:?}");
            assert!(of_one.scored.is_subset(&of_all.scored));
        }
        let two = way(&[truth.clone(), vec![[0.0; 3]; truth.len()]], 1);
        assert!(two.places().iter().all(|place| !two.is_revisited(place)));
    }

    #[test]
    fn the_middle_of_a_place_is_one_of_its_scans() {
        // Steps of 20 m, of 6 m, and a gap of 500 m.
        let mut along_m: Vec<f64> = (0..20).map(|k| 20.0 * f64::from(k)).collect();
        along_m.extend((1..50).map(|k| 380.0 + 6.0 * f64::from(k)));
        along_m.extend((1..100).map(|k| 1174.0 + f64::from(k)));
        let places_m = along_m.iter().map(|&m| [m, 0.0, 0.0]).collect();
        let groups = (0..along_m.len() as u32).collect();
        let way = Way::of(along_m.clone(), vec![places_m], groups, 12.0);
        for place in way.places() {
            assert!(place.scans.contains(&place.centre), "{place:?}");
            let [first, last] = [place.scans[0], *place.scans.last().unwrap()].map(|scan| along_m[scan]);
            assert!(last - first < LENGTH_M);
            let scans = way.scans_of(&place);
            let near = |scan: &usize| (along_m[*scan] - along_m[place.centre]).abs() <= 35.0;
            assert!(scans.read.iter().all(near), "{place:?}");
        }
    }

    #[test]
    fn longer_segments_are_looked_at_from_further_away() {
        let truth = through(&[[0.0, 0.0], [400.0, 0.0]]);
        let scans = truth.len();
        let of = |segment_m| {
            let along_m = (0..scans).map(|scan| scan as f64).collect();
            Way::of(along_m, vec![truth.clone()], (0..scans as u32).collect(), segment_m)
        };
        assert_eq!([of(12.0), of(4.0), of(50.0)].map(|way| way.radius_m()), [35.0, 35.0, 111.0]);
        let place = of(50.0).places()[20].clone();
        let read = of(50.0).scans_of(&place).read;
        assert!(read.last().unwrap() - read[0] > 200);
    }

    #[test]
    fn what_is_read_is_what_any_run_has_near_in_steps() {
        let truth = twice_round();
        let bent = shifted(&truth, |k| [0.0, if k > 400 { 30.0 } else { 0.0 }, 0.0]);
        for in_a_group in [1, 2, 5] {
            let way = way(&[truth.clone(), bent.clone()], in_a_group);
            for place in way.places() {
                let scans = way.scans_of(&place);
                assert!(!scans.cut && scans.read.windows(2).all(|pair| pair[0] < pair[1]));
                assert!(!scans.scored.is_empty());
                assert!(
                    scans.scored.iter().all(|scan| place.scans.contains(scan) && scans.read.contains(scan))
                );
                let near = |scan: usize| {
                    [&truth, &bent].iter().any(|run| distance(run[scan], run[place.centre]) <= way.radius_m())
                };
                for &scan in &scans.read {
                    assert!(near(scan) || place.scans.contains(&scan), "{scan} at {place:?}");
                }
                // No stretch of the way that is near is left out.
                for scan in (0..truth.len()).filter(|&scan| near(scan)) {
                    let beside =
                        scans.read.iter().any(|&read| read.abs_diff(scan) <= MOST_LEFT_OUT_M as usize);
                    assert!(beside, "{scan} at {place:?}");
                }
                // And none is read much more densely than the steps say.
                assert!(scans.read.len() <= (0..truth.len()).filter(|&scan| near(scan)).count() / 2 + 12);
            }
        }
    }

    #[test]
    fn a_way_that_never_comes_back_has_no_place_twice() {
        let way = way(&[through(&[[0.0, 0.0], [300.0, 0.0], [300.0, 200.0]])], 1);
        let places = way.places();
        assert_eq!(places.len(), 50);
        assert!(places.iter().all(|place| !way.is_revisited(place) && place.scans.len() == 10));
    }

    #[test]
    fn where_the_sensor_stands_one_scan_is_enough() {
        let mut along_m: Vec<f64> = (0..100).map(f64::from).collect();
        along_m.splice(50..50, std::iter::repeat_n(50.0, 600));
        let places = along_m.iter().map(|&m| [m, 0.0, 0.0]).collect();
        let groups = (0..along_m.len() as u32).collect();
        let way = Way::of(along_m, vec![places], groups, 12.0);
        let standing = way.places().into_iter().find(|place| place.scans.len() > 500).unwrap();
        assert!(way.scans_of(&standing).read.len() <= 20 && way.scans_of(&standing).scored.len() <= 4);
    }
}
