//! Which of several guesses is best, and whether another one fits as well.

use dmp_sensor::{Isometry3, Vector3};

use crate::align::held::LEAST_HELD;
use crate::align::refusal::{LEAST_OVERLAP, Refusal};
use crate::align::side::{Counterparts, FINEST, Found, STAGES, Side, Stage};

/// Places are apart from this on, voxels and radians: far more than one match leaves open.
pub(crate) const APART: f64 = 2.0;
const APART_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Where the coarsest surfels match less than this as well as at the best place, the finest ones are not looked at. Of streets
/// that repeat themselves they match from 0.75, of others up to 0.65.
const LEAST_COARSE: f64 = 0.7;
/// From places that are no further apart, the coarsest stage ends at the same place, voxels and radians.
const SAME_END: f64 = 0.5;
const SAME_END_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// Most places that are looked at beside the best.
const MOST_OTHERS: usize = 12;
/// Surfaces that support another place by this share leave open which it is. In streets that repeat themselves every 6 to 15 m it
/// is mostly 0.6 and more (half a bay matched with half of another has half), in others up to 0.31 and on a real path 0.43.
const AMBIGUOUS: f64 = 0.45;
/// Less will do where the other place is nearer to the first guess: of two houses that are alike, the one that a run claims may be
/// seen worse.
const AMBIGUOUS_IF_CLAIMED: f64 = 0.25;

/// Where the coarsest stage ended.
struct Start {
    guess: Isometry3<f64>,
    pose: Isometry3<f64>,
    weight: f64,
    /// Whether it is from the first guess.
    is_claimed: bool,
}

impl Side<'_> {
    /// The result of the guess from which the surfaces match best.
    ///
    /// # Errors
    /// [`Refusal::Ambiguous`], where they match as well at another place.
    pub(crate) fn best_of(&self, guesses: &[Isometry3<f64>]) -> Result<Found, Refusal> {
        let mut found = self.apart_from_each_other(&self.starts(guesses));
        let mut best = 0;
        for other in 1..found.len() {
            let [for_best, for_other] = self.support(&found[best], &found[other]);
            best = if for_other > for_best { other } else { best };
        }
        let best = found.swap_remove(best);
        // Too little to be ambiguous.
        if best.overlap(self.source) < LEAST_OVERLAP {
            return Ok(best);
        }
        let mut rival: Option<(f64, Found)> = None;
        for other in found {
            let [for_best, for_other] = self.support(&best, &other);
            let share = for_other / for_best.max(f64::MIN_POSITIVE);
            let [best_m, other_m] =
                [&best, &other].map(|found| between(&guesses[0], &found.pose, &best.middle_m()).0);
            let limit = if other_m < best_m { AMBIGUOUS_IF_CLAIMED } else { AMBIGUOUS };
            let is_greater = rival.as_ref().is_none_or(|(greatest, _)| share > *greatest);
            if for_best > 0.0 && share >= limit && is_greater {
                rival = Some((share, other));
            }
        }
        let Some((share, rival)) = rival else { return Ok(best) };
        let (apart_m, turned_rad) = between(&best.pose, &rival.pose, &best.middle_m());
        Err(Refusal::Ambiguous { apart_m, turned_rad, share })
    }

    /// Where the best start ends, and others that match nearly as well and end elsewhere.
    fn apart_from_each_other(&self, starts: &[Start]) -> Vec<Found> {
        let mut found: Vec<Found> = Vec::new();
        let mut seen: Vec<Isometry3<f64>> = Vec::new();
        for start in starts {
            if seen.len() > MOST_OTHERS {
                break;
            }
            if start.weight < LEAST_COARSE * starts[0].weight && !start.is_claimed {
                continue;
            }
            let middle_m = found.first().map_or_else(Vector3::zeros, Found::middle_m);
            if seen.iter().all(|other| self.are_apart(other, &start.pose, &middle_m)) {
                seen.push(start.pose);
                let new = self.refined(&start.guess, &start.pose);
                if found.iter().all(|other| self.are_apart(&other.pose, &new.pose, &middle_m)) {
                    found.push(new);
                }
            }
        }
        found
    }

    /// Where the coarsest stage ends from the guesses, the one with the greatest weight of pairs first. A guess that reaches a pose
    /// at which another one hardly moved any more is excluded: it ends at the same place.
    fn starts(&self, guesses: &[Isometry3<f64>]) -> Vec<Start> {
        let coarse = &STAGES[0];
        let same = |a: &Isometry3<f64>, b: &Isometry3<f64>, middle_m: &Vector3<f64>| {
            let (apart_m, turned_rad) = between(a, b, middle_m);
            apart_m < SAME_END * self.target.voxel_m && turned_rad < SAME_END_RAD
        };
        let mut counterparts = Counterparts::none();
        let mut known: Vec<Isometry3<f64>> = Vec::new();
        let mut start_of = |number: usize, guess: &Isometry3<f64>| {
            let before = known.len();
            let mut last = None;
            let pose = self.through(coarse, *guess, &mut counterparts, |pose, equations| {
                let middle_m = equations.middle_m();
                if last.replace(*pose).is_some_and(|last| same(&last, pose, &middle_m)) {
                    known.push(*pose);
                }
                known[..before].iter().any(|other| same(other, pose, &middle_m))
            })?;
            // By finer scales than it was found with: what is nearly right weighs more.
            let fine = Stage { scale: STAGES[1].scale, ..*coarse };
            let weight = self.equations(&fine, &pose, &mut counterparts).weight;
            known.push(pose);
            Some(Start { guess: *guess, pose, weight, is_claimed: number == 0 })
        };
        let mut starts: Vec<Start> =
            guesses.iter().enumerate().filter_map(|(number, guess)| start_of(number, guess)).collect();
        // Stable: of two that are as good, the first.
        starts.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        starts
    }

    fn are_apart(&self, a: &Isometry3<f64>, b: &Isometry3<f64>, middle_m: &Vector3<f64>) -> bool {
        let (apart_m, turned_rad) = between(a, b, middle_m);
        apart_m > APART * self.target.voxel_m || turned_rad > APART_RAD
    }

    /// How much the surfaces support either of two places against the other: nothing for both, where they do not hold what
    /// lies between them.
    fn support(&self, a: &Found, b: &Found) -> [f64; 2] {
        let support = [self.support_of(&a.pose, &b.pose), self.support_of(&b.pose, &a.pose)];
        let is_held = support[0].max(support[1]) >= LEAST_HELD * a.last.weight.max(b.last.weight);
        if is_held { support } else { [0.0; 2] }
    }

    /// How much the surfaces support one pose against another: weights of the finest pairs, each by how squarely its plane
    /// stands between the two places. What lies along the line between them, as the walls of a street, matches at both.
    fn support_of(&self, pose: &Isometry3<f64>, other: &Isometry3<f64>) -> f64 {
        let scale_m = FINEST.scale * self.target.voxel_m;
        let other_from_pose = other * pose.inverse();
        let mut sum = 0.0;
        self.each_pair(&FINEST, pose, &mut Counterparts::none(), |residual, _| {
            let place_m = residual.place_m;
            let shift_m = other_from_pose.rotation * place_m + other_from_pose.translation.vector - place_m;
            let across_m = residual.normal.dot(&shift_m);
            let shift_m2 = shift_m.norm_squared().max(f64::MIN_POSITIVE);
            sum += residual.weight(scale_m) * across_m * across_m / shift_m2;
        });
        sum
    }
}

/// Distance of the middle at two poses, and the angle between them: the chord, which needs no sine.
fn between(a: &Isometry3<f64>, b: &Isometry3<f64>, middle_m: &Vector3<f64>) -> (f64, f64) {
    let between = b * a.inverse();
    let shift_m = between.rotation * middle_m + between.translation.vector - middle_m;
    (shift_m.norm(), 2.0 * between.rotation.quaternion().imag().norm())
}
