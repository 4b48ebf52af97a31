//! The truth about a map's consistency: how far apart one true place comes to lie when two frames see it.
//!
//! A return that truly hit X is put at X + u by an estimate, u being the estimate's endpoint minus the true
//! one. Two returns of one small place, made in different frames, disagree by the distance d between their
//! two u, whatever the estimate's own world frame is, up to a small rotation. No map, ray or score occurs in
//! this number.

use std::collections::{BTreeMap, HashMap};

use dmp::ScoredReturns;
use serde::{Deserialize, Serialize};

/// Edge of a place, metres.
const PLACE_M: f64 = 0.5;
/// Every so many returns one is remembered; which, depends on a hash of frame and place in the frame.
const EVERY: u64 = 8;
/// Sightings of a place that are kept: those with the lowest hashes.
const KEPT: usize = 8;

/// Returns remembered by true place.
#[derive(Debug)]
pub(super) struct Sightings {
    runs: usize,
    places: HashMap<[i64; 3], PlaceSightings>,
}

/// What is remembered of a place.
#[derive(Debug, Default)]
struct PlaceSightings {
    /// Returns that were remembered, kept or not.
    returns: u64,
    /// The kept ones by their hashes.
    kept: BTreeMap<u64, Sighting>,
}

/// One return: its frame and each run's displacement u, metres.
#[derive(Debug)]
struct Sighting {
    frame: usize,
    displacement_m: Box<[[f32; 3]]>,
}

/// What counts how much.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Weigh {
    /// Every pair of sightings alike.
    Pairs,
    /// A place by the returns that it gave, as they count in a score.
    Returns,
}

/// How far apart one true place comes to lie in a run.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Inconsistency {
    /// For each truncation τ, the mean of min(d², τ²).
    pub(super) squares_m2: Vec<f64>,
    /// The mean of d.
    pub(super) distance_m: f64,
}

impl Sightings {
    pub(super) fn new(runs: usize) -> Self {
        Self { runs, places: HashMap::new() }
    }

    /// Of a part of a frame; the first run is the truth.
    pub(super) fn of(scored: &ScoredReturns<'_>) -> Self {
        let mut seen = Self::new(scored.runs.len());
        for index in 0..scored.offsets_ns.len() {
            let ray = scored.runs[0].own_ray(index);
            // The direction tells a frame's returns apart, in whatever parts they come.
            let d = ray.direction_in_world;
            let hash = mix(mix(mix(scored.frame as u64 ^ d[0].to_bits()) ^ d[1].to_bits()) ^ d[2].to_bits());
            if !hash.is_multiple_of(EVERY) {
                continue;
            }
            let truth = ray.endpoint_in_world();
            let displacement = |run: usize| {
                let end = scored.runs[run].own_ray(index).endpoint_in_world();
                std::array::from_fn(|k| (end[k] - truth[k]) as f32)
            };
            let displacement_m = (0..scored.runs.len()).map(displacement).collect();
            seen.keep(truth.map(|c| (c / PLACE_M).floor() as i64), hash, || Sighting {
                frame: scored.frame,
                displacement_m,
            });
        }
        seen
    }

    fn keep(&mut self, place: [i64; 3], hash: u64, sighting: impl FnOnce() -> Sighting) {
        let place = self.places.entry(place).or_default();
        place.returns += 1;
        place.keep(hash, sighting);
    }

    pub(super) fn merge(&mut self, other: Self) {
        for (place, seen) in other.places {
            let place = self.places.entry(place).or_default();
            place.returns += seen.returns;
            for (hash, sighting) in seen.kept {
                place.keep(hash, || sighting);
            }
        }
    }

    /// For each run, means over the pairs of sightings of one place from two frames that `apart` calls far
    /// enough apart; and how many pairs there are.
    pub(super) fn inconsistency(
        &self,
        truncations_m: &[f64],
        weigh: Weigh,
        apart: impl Fn(usize, usize) -> bool,
    ) -> (Vec<Inconsistency>, u64) {
        let mut places: Vec<_> = self.places.iter().collect();
        places.sort_unstable_by_key(|(place, _)| **place);
        let none = Inconsistency { squares_m2: vec![0.0; truncations_m.len()], distance_m: 0.0 };
        let mut runs = vec![none; self.runs];
        let (mut count, mut total) = (0u64, 0.0);
        for (_, place) in places {
            let sightings: Vec<&Sighting> = place.kept.values().collect();
            let weight = match weigh {
                Weigh::Pairs => 1.0,
                Weigh::Returns => place.returns as f64 / choose_two(sightings.len()),
            };
            for (k, a) in sightings.iter().enumerate() {
                for b in &sightings[k + 1..] {
                    if a.frame == b.frame || !apart(a.frame, b.frame) {
                        continue;
                    }
                    (count, total) = (count + 1, total + weight);
                    for (run, sums) in runs.iter_mut().enumerate() {
                        let (u, v) = (a.displacement_m[run], b.displacement_m[run]);
                        let square: f64 = (0..3).map(|k| f64::from(u[k] - v[k]).powi(2)).sum();
                        sums.distance_m += weight * square.sqrt();
                        for (sum, t) in sums.squares_m2.iter_mut().zip(truncations_m) {
                            *sum += weight * square.min(t * t);
                        }
                    }
                }
            }
        }
        for run in &mut runs {
            for sum in run.squares_m2.iter_mut().chain([&mut run.distance_m]) {
                *sum /= if count == 0 { 1.0 } else { total };
            }
        }
        (runs, count)
    }
}

impl PlaceSightings {
    fn keep(&mut self, hash: u64, sighting: impl FnOnce() -> Sighting) {
        if self.kept.len() < KEPT || self.kept.last_key_value().is_some_and(|(&last, _)| hash < last) {
            self.kept.insert(hash, sighting());
            if self.kept.len() > KEPT {
                self.kept.pop_last();
            }
        }
    }
}

fn choose_two(count: usize) -> f64 {
    (count * count.saturating_sub(1)) as f64 / 2.0
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
            seen.keep([0; 3], hash, || Sighting { frame, displacement_m: Box::new([[0.0; 3], off]) });
        }
        seen
    }

    #[test]
    fn distances_are_between_frames_and_merging_has_no_order() {
        let parts = [
            seen(&[(5, 0, [0.0; 3]), (1, 1, [3.0, 4.0, 0.0])]),
            seen(&[(3, 1, [3.0, 4.0, 0.0]), (9, 2, [0.0; 3])]),
        ];
        let merged = |order: [usize; 2]| {
            let mut all = Sightings::new(2);
            order.into_iter().for_each(|k| {
                let at: Vec<_> = parts[k].places[&[0; 3]]
                    .kept
                    .iter()
                    .map(|(&hash, s)| (hash, s.frame, s.displacement_m[1]))
                    .collect();
                all.merge(seen(&at));
            });
            all
        };
        for order in [[0, 1], [1, 0]] {
            let (runs, pairs) = merged(order).inconsistency(&[2.0], Weigh::Pairs, |_, _| true);
            // Of six pairs one is within a frame; four are 5 m apart, one not at all.
            assert_eq!(pairs, 5);
            assert_eq!((runs[0].distance_m, runs[0].squares_m2[0]), (0.0, 0.0));
            assert!((runs[1].distance_m - 4.0).abs() < 1e-12);
            assert!((runs[1].squares_m2[0] - 16.0 / 5.0).abs() < 1e-12);
            let (_, apart) = merged(order).inconsistency(&[2.0], Weigh::Returns, |a, b| a.abs_diff(b) > 1);
            assert_eq!(apart, 1);
        }
    }

    #[test]
    fn the_lowest_hashes_stay() {
        let at: Vec<(u64, usize, [f32; 3])> = (0..20).rev().map(|k| (k, k as usize, [0.0; 3])).collect();
        let seen = seen(&at);
        let place = &seen.places[&[0; 3]];
        assert_eq!(place.returns, 20);
        assert_eq!(place.kept.keys().copied().collect::<Vec<_>>(), (0..KEPT as u64).collect::<Vec<_>>());
    }
}
