//! The truth about a map's consistency: the distance that an estimate puts between two sightings of one true place.
//!
//! An estimate puts a return that truly hit X at X + u: u is the estimate's endpoint minus the true one. Two returns of one
//! small place, from different frames, disagree by the distance between their two u. The estimate's own world frame does
//! not matter, up to a small rotation. This number uses no map, ray or score.

use std::collections::{BTreeMap, HashMap};

use dmp::ScoredReturns;

/// Edge of a place, metres.
const PLACE_M: f64 = 0.5;
/// One return of so many is kept, chosen by a hash of its frame and direction.
const EVERY: u64 = 8;
/// Sightings of a place that are kept: those with the lowest hashes.
const KEPT: usize = 8;

/// Returns by true place.
#[derive(Debug)]
pub(super) struct Sightings {
    runs: usize,
    /// By place and hash.
    places: HashMap<[i64; 3], BTreeMap<u64, Sighting>>,
}

/// One return: its frame and each run's displacement u, metres.
#[derive(Debug)]
struct Sighting {
    frame: usize,
    displacement_m: Box<[[f32; 3]]>,
}

impl Sightings {
    pub(super) fn new(runs: usize) -> Self {
        Self { runs, places: HashMap::new() }
    }

    /// Of a part of a frame, the returns with a pose in every run; the first run is the truth.
    pub(super) fn of(scored: &ScoredReturns<'_>) -> Self {
        let mut seen = Self::new(scored.runs.len());
        let Some(runs) = scored.runs.iter().map(Option::as_ref).collect::<Option<Vec<_>>>() else {
            return seen;
        };
        let is_posed = |&index: &usize| runs.iter().all(|run| run.is_posed[index]);
        for index in (0..scored.offsets_ns.len()).filter(is_posed) {
            let ray = runs[0].own_ray(index);
            // Directions distinguish a frame's returns, in whatever parts they come.
            let d = ray.direction_in_world;
            let hash = mix(mix(mix(scored.frame as u64 ^ d[0].to_bits()) ^ d[1].to_bits()) ^ d[2].to_bits());
            if !hash.is_multiple_of(EVERY) {
                continue;
            }
            let truth = ray.endpoint_in_world();
            let displacement = |run: usize| {
                let end = runs[run].own_ray(index).endpoint_in_world();
                std::array::from_fn(|k| (end[k] - truth[k]) as f32)
            };
            let displacement_m = (0..runs.len()).map(displacement).collect();
            let place = truth.map(|c| (c / PLACE_M).floor() as i64);
            seen.keep(place, hash, Sighting { frame: scored.frame, displacement_m });
        }
        seen
    }

    fn keep(&mut self, place: [i64; 3], hash: u64, sighting: Sighting) {
        let kept = self.places.entry(place).or_default();
        kept.insert(hash, sighting);
        if kept.len() > KEPT {
            kept.pop_last();
        }
    }

    pub(super) fn merge(&mut self, other: Self) {
        for (place, seen) in other.places {
            seen.into_iter().for_each(|(hash, sighting)| self.keep(place, hash, sighting));
        }
    }

    /// For each run the mean distance of two sightings of one place, metres, over those from two frames that `apart` calls
    /// far enough apart. `None` where there are none.
    pub(super) fn inconsistency_m(&self, apart: impl Fn(usize, usize) -> bool) -> Option<Vec<f64>> {
        let mut places: Vec<_> = self.places.iter().collect();
        places.sort_unstable_by_key(|(place, _)| **place);
        let (mut sums_m, mut count) = (vec![0.0; self.runs], 0_u64);
        for (_, kept) in places {
            let sightings: Vec<&Sighting> = kept.values().collect();
            for (k, a) in sightings.iter().enumerate() {
                for b in sightings[k + 1..].iter().filter(|b| a.frame != b.frame && apart(a.frame, b.frame)) {
                    count += 1;
                    for ((sum_m, u), v) in sums_m.iter_mut().zip(&a.displacement_m).zip(&b.displacement_m) {
                        *sum_m += (0..3).map(|k| f64::from(u[k] - v[k]).powi(2)).sum::<f64>().sqrt();
                    }
                }
            }
        }
        (count > 0).then(|| sums_m.iter().map(|sum_m| sum_m / count as f64).collect())
    }
}

/// `SplitMix64`'s output function: spreads every bit over all.
pub(super) fn mix(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(at: &[(u64, usize, [f32; 3])]) -> Sightings {
        let mut seen = Sightings::new(2);
        for &(hash, frame, off) in at {
            seen.keep([0; 3], hash, Sighting { frame, displacement_m: Box::new([[0.0; 3], off]) });
        }
        seen
    }

    #[test]
    fn distances_are_between_frames_and_merging_has_no_order() {
        let parts: [&[_]; 2] =
            [&[(5, 0, [0.0; 3]), (1, 1, [3.0, 4.0, 0.0])], &[(3, 1, [3.0, 4.0, 0.0]), (9, 2, [0.0; 3])]];
        for order in [[0, 1], [1, 0]] {
            let mut all = seen(parts[order[0]]);
            all.merge(seen(parts[order[1]]));
            // Of six pairs one is within a frame; four are 5 m apart, one not at all.
            assert_eq!(all.inconsistency_m(|_, _| true), Some(vec![0.0, 4.0]));
            assert_eq!(all.inconsistency_m(|a, b| a.abs_diff(b) > 1), Some(vec![0.0, 0.0]));
            assert_eq!(all.inconsistency_m(|_, _| false), None);
        }
    }

    #[test]
    fn the_lowest_hashes_stay() {
        let at: Vec<(u64, usize, [f32; 3])> = (0..20).rev().map(|k| (k, k as usize, [0.0; 3])).collect();
        let kept: Vec<u64> = seen(&at).places[&[0; 3]].keys().copied().collect();
        assert_eq!(kept, (0..KEPT as u64).collect::<Vec<_>>());
    }
}
