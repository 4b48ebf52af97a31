//! Which directions the surfaces hold.

use dmp_map::smallest_eigenvector;
use dmp_sensor::{Matrix6, Vector3};
use nalgebra::Vector6;

use crate::align::normal_equations::NormalEquations;

/// Least share of the weights that holds the translation in each direction: a corridor of bare walls has less along it.
pub(crate) const LEAST_HELD: f64 = 0.01;
/// Steps are taken along what is held by this share: coarse surfels hold little of a street whose pillars they blur, yet lead to
/// where fine ones hold it.
const LEAST_LEADING: f64 = 0.0001;
/// Least share that holds a rotation, by what it moves at the lever. Along a tunnel it is 0.00001, along a corridor of 4 m
/// without a ceiling 0.007 to 0.01, in streets 0.1.
pub(crate) const LEAST_TURN_HELD: f64 = 0.0025;
/// Voxels.
const LEVER: f64 = 20.0;

/// How well the surfaces hold the translation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hold {
    /// Least share of the weights that holds it in a direction, and the next one.
    pub(crate) shares: [f64; 2],
    /// Their directions.
    directions: [Vector3<f64>; 2],
}

impl Hold {
    pub(crate) fn of(equations: &NormalEquations) -> Self {
        let sums = equations.of_translation();
        let (least, [smallest, next, _]) = smallest_eigenvector(sums);
        let (greatest, _) = smallest_eigenvector(sums.map(|sum| -sum));
        let [least, greatest]: [Vector3<f64>; 2] = [least.into(), greatest.into()];
        let shares = [smallest, next].map(|sum| sum.max(0.0) / equations.weight.max(f64::MIN_POSITIVE));
        Self { shares, directions: [least, greatest.cross(&least)] }
    }

    pub(crate) fn least(&self) -> Vector3<f64> {
        self.directions[0]
    }

    /// Directions that less than a share of the weights holds.
    pub(crate) fn below(&self, share: f64) -> &[Vector3<f64>] {
        let count = self.shares.iter().filter(|&&held| held < share).count();
        &self.directions[..count]
    }
}

/// The inverse of `JᵀWJ` among the motions that leave the middle of the surfaces where it is along some directions, as
/// Zhang, Kaess and Singh ("On degeneracy of optimization-based state estimation problems", 2016) solve for the others
/// only. `None` where nothing is held.
pub(crate) fn inverse(equations: &NormalEquations, unheld: &[Vector3<f64>]) -> Option<Matrix6<f64>> {
    let mut inverse = equations.damped().cholesky()?.inverse();
    let middle_m = equations.middle_m();
    for direction in unheld {
        let turn = middle_m.cross(direction);
        let kept = Vector6::new(turn.x, turn.y, turn.z, direction.x, direction.y, direction.z);
        let moved = inverse * kept;
        inverse -= moved * moved.transpose() / kept.dot(&moved);
    }
    Some(inverse)
}

/// The step that the surfaces call for, where they hold it.
pub(crate) fn step(equations: &NormalEquations) -> Option<Vector6<f64>> {
    Some(inverse(equations, Hold::of(equations).below(LEAST_LEADING))? * -equations.gradient())
}

/// Least share of the weights that holds a rotation, whatever the translation, and its axis.
pub(crate) fn turn_held(
    equations: &NormalEquations,
    unheld: &[Vector3<f64>],
    voxel_m: f64,
) -> (f64, Vector3<f64>) {
    let Some(m) = inverse(equations, unheld) else { return (0.0, Vector3::x()) };
    let (axis, [greatest, ..]) =
        smallest_eigenvector([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|place| -m[place]));
    let lever_m = LEVER * voxel_m;
    let share = 1.0 / (-greatest).max(f64::MIN_POSITIVE);
    (share / (lever_m * lever_m * equations.weight.max(f64::MIN_POSITIVE)), axis.into())
}
