//! From two pyramids and guesses to a motion, how well it is known, or why it is not.

use dmp_sensor::{Isometry3, Matrix6, Vector3};
use nalgebra::{Point3, Vector6};

use crate::align::difference::Difference;
use crate::align::held::{Hold, LEAST_HELD, LEAST_TURN_HELD, turn_held};
use crate::align::pyramid::Pyramid;
use crate::align::refusal::{LEAST_OVERLAP, Refusal};
use crate::align::side::{Found, Side};

/// How far both directions may be apart, voxels and radians.
const MOST_APART: f64 = 0.1;
const MOST_TURNED_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
/// Half of the counterparts lie no further off than this many times what surfels are thick, and these count as so thick at least,
/// voxels: on another place that looks alike they lie at 1.9 and more.
const MOST_OFF: f64 = 1.5;
const LEAST_THICK: f64 = 0.012;
/// Fewer counterparts than this are no surface.
const LEAST_PAIRS: usize = 50;

/// No direction is known better than this, voxels: surfels are means over voxels that two visits fill unevenly.
const FLOOR: f64 = 0.002;
/// Allowed for in each direction beside that, voxels, and what half of the counterparts lie off.
const ALLOWANCE: f64 = 0.02;
/// Standard deviation along what no surface holds, voxels: nothing is known.
const UNHELD: f64 = 100.0;

/// Where one visit's surfaces lie by the other's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// The motion that brings the surfaces of the source onto those of the target, in the place's frame: the identity where a
    /// run put both visits right.
    pub target_from_source: Isometry3<f64>,
    /// Of a rotation vector (radians) and a translation (metres) put before it: over pieces of the surface, with half the
    /// difference of both directions, a floor of 0.002 voxels and an [allowance](Self::allowance_m).
    pub covariance: Matrix6<f64>,
    /// Shares of the surfels of the source that the target has counterparts of, and of the target that the source has.
    pub overlap: [f64; 2],
    /// What the covariance allows in each direction of the translation beside what the surfaces scatter, metres: surfels of
    /// visits that are bent lie off together.
    pub allowance_m: f64,
    /// Least share of the weights that holds the translation in a direction: 1/3 where all do evenly.
    pub held: f64,
    /// That direction, in the target's frame.
    pub least_held: Vector3<f64>,
    /// The same where surfaces do not hold it, as along a bare corridor: there the motion is that of the best guess, at the
    /// middle of the surfaces, and the standard deviation 100 voxels. The rest is as good as anywhere.
    pub unheld: Option<Vector3<f64>>,
}

/// Brings the surfaces of `source` onto those of `target`, both in the frame of the place, from the best of some guesses of
/// that motion, the identity where there are none.
///
/// From up to about ten voxels off (5 m at half a metre). Of several guesses the one is used from which the surfaces match
/// best. A second place that matches as well is detected only where a guess leads there. The first guess is the claimed one: a rival
/// near it needs less support. `O(surfels)` time for each guess.
///
/// # Errors
/// When the surfaces give no alignment: see [`Refusal`].
pub fn align(target: &Pyramid, source: &Pyramid, guesses: &[Isometry3<f64>]) -> Result<Alignment, Refusal> {
    if target.voxel_m != source.voxel_m {
        return Err(Refusal::Voxels(target.voxel_m, source.voxel_m));
    }
    let identity = [Isometry3::identity()];
    let guesses = if guesses.is_empty() { &identity } else { guesses };
    let forward = Side { target, source };
    let there = forward.best_of(guesses)?;
    let backward = Side { target: source, source: target };
    let to_source = there.pose.inverse();
    let back = backward.refined(&to_source, &to_source);
    let overlap = [there.overlap(source), back.overlap(target)];
    let share = overlap[0].min(overlap[1]);
    if share < LEAST_OVERLAP || there.pairs.min(back.pairs) < LEAST_PAIRS {
        return Err(Refusal::LittleOverlap { share });
    }
    let Holding { held, least_held, unheld } = Holding::of(&there, &back, target.voxel_m)?;
    let along: &[Vector3<f64>] = unheld.as_slice();
    let middle_m = there.middle_m();
    let Difference { target_from_source, shift, turn } =
        Difference::of(&there.pose, &back.pose.inverse(), &middle_m);
    let shift = along.iter().fold(shift, |shift, along| shift - along * along.dot(&shift));
    let (apart_m, turned_rad) = (2.0 * shift.norm(), 2.0 * turn.norm());
    if apart_m > MOST_APART * target.voxel_m || turned_rad > MOST_TURNED_RAD {
        let elsewhere_m = forward.elsewhere_m(&there, &guesses[0], &least_held);
        return Err(Refusal::NotTheSameBackward { apart_m, turned_rad, elsewhere_m });
    }
    let off_m = there.off_m.max(back.off_m);
    if !there.is_alike(off_m, target.voxel_m) {
        let elsewhere_m = forward.elsewhere_m(&there, &guesses[0], &least_held);
        return Err(Refusal::NotAlike { off_m, thick_m: there.thick_m, elsewhere_m });
    }
    // The shift of the middle, as a translation after the turn.
    let shift = shift - turn.cross(&middle_m);
    let half = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
    let [floor_m, least_m, unheld_m] = [FLOOR, ALLOWANCE, UNHELD].map(|voxels| voxels * target.voxel_m);
    let allowance_m = (least_m * least_m + off_m * off_m).sqrt();
    let floor_m2 = floor_m * floor_m + allowance_m * allowance_m;
    let floor = Matrix6::from_fn(|k, l| if k == l && k >= 3 { floor_m2 } else { 0.0 });
    let mut covariance = there.covariance(along) + half * half.transpose() + floor;
    for along in along {
        let along_m = Vector6::new(0.0, 0.0, 0.0, along.x, along.y, along.z) * unheld_m;
        covariance += along_m * along_m.transpose();
    }
    let target_from_source = unheld
        .map_or(target_from_source, |along| kept_along(&along, &there.guess, target_from_source, &middle_m));
    Ok(Alignment { target_from_source, covariance, overlap, allowance_m, held, least_held, unheld })
}

impl Found {
    /// Whether counterparts that lie this far off coincide.
    pub(crate) fn is_alike(&self, off_m: f64, voxel_m: f64) -> bool {
        off_m <= MOST_OFF * self.thick_m.max(LEAST_THICK * voxel_m)
    }
}

/// What the surfaces hold least.
struct Holding {
    /// Share of the weights, from whichever side it is less.
    held: f64,
    /// Direction of the translation, in the target's frame.
    least_held: Vector3<f64>,
    /// The same where the share is too little.
    unheld: Option<Vector3<f64>>,
}

impl Holding {
    /// # Errors
    /// [`Refusal::NotHeld`], where a second direction or a rotation is not held either.
    fn of(there: &Found, back: &Found, voxel_m: f64) -> Result<Self, Refusal> {
        let [from_source, from_target] = [there, back].map(|found| Hold::of(&found.last));
        let to_target = there.pose.rotation;
        let (held, least_held) = if from_target.shares[0] < from_source.shares[0] {
            (from_target.shares[0], to_target * from_target.least())
        } else {
            (from_source.shares[0], from_source.least())
        };
        if from_source.shares[1].min(from_target.shares[1]) < LEAST_HELD {
            return Err(Refusal::NotHeld { held, along: least_held.into() });
        }
        let unheld = (held < LEAST_HELD).then_some(least_held);
        let in_source = unheld.map(|along| to_target.inverse() * along);
        let (turn, axis) = turn_held(&there.last, unheld.as_slice(), voxel_m);
        let (turn_back, axis_back) = turn_held(&back.last, in_source.as_slice(), voxel_m);
        let (turn, axis) = if turn_back < turn { (turn_back, to_target * axis_back) } else { (turn, axis) };
        if turn < LEAST_TURN_HELD {
            return Err(Refusal::NotHeld { held: turn, along: axis.into() });
        }
        Ok(Self { held, least_held, unheld })
    }
}

/// The pose moved along a direction until the middle of the surfaces lies there as far as by the guess.
fn kept_along(
    along: &Vector3<f64>,
    guess: &Isometry3<f64>,
    mut pose: Isometry3<f64>,
    middle_m: &Vector3<f64>,
) -> Isometry3<f64> {
    let in_source = pose.inverse() * Point3::from(*middle_m);
    pose.translation.vector += along * along.dot(&(guess * in_source - Point3::from(*middle_m)));
    pose
}
