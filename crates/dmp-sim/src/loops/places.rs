//! Pairs of keyframes: at one place, or at places far apart.

use std::collections::{BTreeMap, BTreeSet};

use dmp_lengths::LoopLengths;
use dmp_sensor::Isometry3;

use super::keyframes::Keyframes;
use crate::error::SimError;
use crate::random::Random;

/// Pairs drawn for one loop between places far apart. Where a pair in a thousand will do, one is found.
const DRAWS: usize = 20_000;

/// The keyframes by place.
pub(super) struct Places<'a> {
    keyframes: &'a Keyframes,
    lengths: LoopLengths,
    /// By square of the map, whose sides are those of one place, in order of time.
    by_square: BTreeMap<[i64; 2], Vec<usize>>,
}

impl<'a> Places<'a> {
    pub(super) fn new(keyframes: &'a Keyframes, lengths: LoopLengths) -> Self {
        let mut by_square: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
        for k in 0..keyframes.len() {
            by_square.entry(square(keyframes, k, lengths.same_place_m)).or_default().push(k);
        }
        Self { keyframes, lengths, by_square }
    }

    /// Pairs of keyframes at one place, the earlier first, spread over what the drive sees again. No keyframe is
    /// the later one of two.
    pub(super) fn seen_again(
        &self,
        count: usize,
        random: &mut Random,
    ) -> Result<Vec<(usize, usize)>, SimError> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let again: Vec<usize> =
            (0..self.keyframes.len()).filter(|&k| self.earlier(k).next().is_some()).collect();
        if again.len() < count {
            let (found, lengths) = (again.len(), self.lengths);
            return Err(SimError::TooFewRevisits { asked: count, found, lengths });
        }
        let pair = |n: usize| {
            let part = &again[n * again.len() / count..(n + 1) * again.len() / count];
            let later = part[random.index(part.len())];
            let earlier: Vec<usize> = self.earlier(later).collect();
            (earlier[random.index(earlier.len())], later)
        };
        Ok((0..count).map(pair).collect())
    }

    /// Pairs of keyframes at places far apart, the earlier first, all different and spread over the drive.
    pub(super) fn far_apart(
        &self,
        count: usize,
        random: &mut Random,
    ) -> Result<Vec<(usize, usize)>, SimError> {
        let first = (0..self.keyframes.len()).find(|&k| self.long_before(k) > 0);
        let mut pairs = Vec::new();
        let mut known = BTreeSet::new();
        for n in 0..count {
            let later: Vec<usize> =
                first.map_or_else(Vec::new, |first| (first..self.keyframes.len()).collect());
            // The n-th part of the drive; all of it where nothing is found there, or the parts are empty.
            let part = &later[n * later.len() / count..(n + 1) * later.len() / count];
            let mut draw = |from: &[usize]| {
                if from.is_empty() {
                    return None;
                }
                let b = from[random.index(from.len())];
                let a = random.index(self.long_before(b));
                let poses = &self.keyframes.poses;
                (self.are_others(&poses[a], &poses[b]) && known.insert((a, b))).then_some((a, b))
            };
            let found = (0..DRAWS).find_map(|k| draw(if k < DRAWS / 2 { part } else { &later }));
            let (until_now, lengths) = (pairs.len(), self.lengths);
            let found = found.ok_or(SimError::TooFewPlaces { asked: count, found: until_now, lengths })?;
            pairs.push(found);
        }
        Ok(pairs)
    }

    /// The keyframes of this one's place that are long before it.
    fn earlier(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        let [i, j] = square(self.keyframes, k, self.lengths.same_place_m);
        let before = self.long_before(k);
        let squares = (i - 1..=i + 1).flat_map(move |i| (j - 1..=j + 1).map(move |j| [i, j]));
        let lists = squares.filter_map(|square| self.by_square.get(&square));
        let near = lists.flat_map(move |list| list.iter().copied().take_while(move |&m| m < before));
        let poses = &self.keyframes.poses;
        near.filter(move |&m| self.are_one(&poses[m], &poses[k]))
    }

    /// Whether two poses are at one place, and look at the same things.
    fn are_one(&self, a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
        let views = self.lengths.views.is_none_or(|views| a.rotation.angle_to(&b.rotation) <= views.same_rad);
        apart_m(a, b) <= self.lengths.same_place_m && views
    }

    /// Whether two poses are at places far apart, or look at other things.
    fn are_others(&self, a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
        let views =
            self.lengths.views.is_some_and(|views| a.rotation.angle_to(&b.rotation) > views.other_rad);
        apart_m(a, b) > self.lengths.other_place_m || views
    }

    /// How many of the keyframes have more travel to this one than lies between those of a loop: the first ones.
    fn long_before(&self, k: usize) -> usize {
        let travel_m = &self.keyframes.travel_m;
        travel_m.partition_point(|&m| m < travel_m[k] - self.lengths.between_m)
    }
}

fn apart_m(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    (a.translation.vector - b.translation.vector).norm()
}

fn square(keyframes: &Keyframes, k: usize, side_m: f64) -> [i64; 2] {
    let place = keyframes.poses[k].translation.vector;
    [place.x, place.y].map(|c| libm::floor(c / side_m) as i64)
}
