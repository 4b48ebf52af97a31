//! The truth about a map's consistency: how far apart one true place comes to lie when two frames see it.
//!
//! A return that truly hit X is put at X + u by an estimate, u being the estimate's endpoint minus the true
//! one. Two returns of one small place, made in different frames, disagree by the distance d between their
//! two u, whatever the estimate's own world frame is, up to a small rotation. No map, ray or score occurs in
//! this number.

use std::collections::{BTreeMap, HashMap};

use dmp::ScoredReturns;

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
    places: HashMap<[i64; 3], BTreeMap<u64, Sighting>>,
}

/// One return: its frame and each run's displacement u, metres.
#[derive(Debug)]
struct Sighting {
    frame: usize,
    displacement_m: Box<[[f32; 3]]>,
}

/// How far apart one true place comes to lie.
#[derive(Debug)]
pub(super) struct Inconsistency {
    /// For each run and truncation τ, the mean of min(d², τ²).
    pub(super) squares_m2: Vec<Vec<f64>>,
    /// For each run, the mean of d.
    pub(super) distances_m: Vec<f64>,
    /// Pairs of sightings.
    pub(super) pairs: u64,
}

impl Sightings {
    pub(super) fn new(runs: usize) -> Self {
        Self { runs, places: HashMap::new() }
    }

    /// Of a part of a frame; the first run is the truth.
    pub(super) fn of(scored: &ScoredReturns<'_>) -> Self {
        let mut seen = Self::new(scored.rays.len());
        for (index, ray) in scored.rays[0].iter().enumerate() {
            // The direction tells a frame's returns apart, in whatever parts they come.
            let d = ray.direction_in_world;
            let hash = mix(mix(mix(scored.frame as u64 ^ d[0].to_bits()) ^ d[1].to_bits()) ^ d[2].to_bits());
            if !hash.is_multiple_of(EVERY) {
                continue;
            }
            let truth = ray.endpoint_in_world();
            let displacement = |rays: &Vec<dmp_sensor::Ray>| {
                let end = rays[index].endpoint_in_world();
                std::array::from_fn(|k| (end[k] - truth[k]) as f32)
            };
            let displacement_m = scored.rays.iter().map(displacement).collect();
            seen.keep(truth.map(|c| (c / PLACE_M).floor() as i64), hash, || Sighting {
                frame: scored.frame,
                displacement_m,
            });
        }
        seen
    }

    fn keep(&mut self, place: [i64; 3], hash: u64, sighting: impl FnOnce() -> Sighting) {
        let kept = self.places.entry(place).or_default();
        if kept.len() < KEPT || kept.last_key_value().is_some_and(|(&last, _)| hash < last) {
            kept.insert(hash, sighting());
            if kept.len() > KEPT {
                kept.pop_last();
            }
        }
    }

    pub(super) fn merge(&mut self, other: Self) {
        for (place, sightings) in other.places {
            for (hash, sighting) in sightings {
                self.keep(place, hash, || sighting);
            }
        }
    }

    /// For each run, means over all pairs of sightings of one place from two frames that `apart` calls far
    /// enough apart.
    pub(super) fn inconsistency(
        &self,
        truncations_m: &[f64],
        apart: impl Fn(usize, usize) -> bool,
    ) -> Inconsistency {
        let mut places: Vec<_> = self.places.iter().collect();
        places.sort_unstable_by_key(|(place, _)| **place);
        let mut sums = vec![vec![0.0; truncations_m.len()]; self.runs];
        let mut distances_m = vec![0.0; self.runs];
        let mut count = 0u64;
        for (_, sightings) in places {
            let sightings: Vec<&Sighting> = sightings.values().collect();
            for (k, a) in sightings.iter().enumerate() {
                for b in &sightings[k + 1..] {
                    if a.frame == b.frame || !apart(a.frame, b.frame) {
                        continue;
                    }
                    count += 1;
                    for (run, (sums, distance_m)) in sums.iter_mut().zip(&mut distances_m).enumerate() {
                        let (u, v) = (a.displacement_m[run], b.displacement_m[run]);
                        let square: f64 = (0..3).map(|k| f64::from(u[k] - v[k]).powi(2)).sum();
                        *distance_m += square.sqrt();
                        for (sum, t) in sums.iter_mut().zip(truncations_m) {
                            *sum += square.min(t * t);
                        }
                    }
                }
            }
        }
        for sum in sums.iter_mut().flatten().chain(&mut distances_m) {
            *sum /= count.max(1) as f64;
        }
        Inconsistency { squares_m2: sums, distances_m, pairs: count }
    }
}

/// `SplitMix64`'s output function: spreads every bit over all.
fn mix(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
