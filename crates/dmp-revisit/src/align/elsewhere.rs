//! Evidence against a claim where nothing fits.

use dmp_sensor::{Isometry3, Vector3};
use nalgebra::Point3;

use crate::align::pyramid::Pyramid;
use crate::align::refusal::LEAST_OVERLAP;
use crate::align::side::{Found, Side};
use crate::align::starts::APART;

/// Of the surfels of a visit that sees all round, each eighth of a circle has this share.
const LEAST_IN_EIGHTH: f64 = 0.01;

impl Side<'_> {
    /// How far from the claim surfaces match `best`, metres, across the direction that they hold least: along it noise lets them
    /// slide, as along a tunnel. `None` where that says nothing against the claim: they match best there, or fit there from this
    /// side, or what has no counterpart there may have been out of view.
    pub(crate) fn elsewhere_m(
        &self,
        best: &Found,
        claimed: &Isometry3<f64>,
        least_held: &Vector3<f64>,
    ) -> Option<f64> {
        let (voxel_m, middle_m) = (self.target.voxel_m, Point3::from(best.middle_m()));
        let shift_m = best.pose * (claimed.inverse() * middle_m) - middle_m;
        let apart_m = (shift_m - least_held * least_held.dot(&shift_m)).norm();
        let sees_enough = self.target.sees_all_round() && self.source.sees_all_round();
        if !sees_enough || apart_m <= APART * voxel_m {
            return None;
        }
        let here = self.refined(claimed, claimed);
        let fits_here = here.overlap(self.source) >= LEAST_OVERLAP && here.is_alike(here.off_m, voxel_m);
        (!fits_here).then_some(apart_m)
    }
}

impl Pyramid {
    /// Whether there are surfaces all round the place, about some axis and within 45° of square to it: mostly not of a camera, nor
    /// of a LiDAR with a narrow view.
    fn sees_all_round(&self) -> bool {
        let surfels = &self.levels[0].surfels;
        let least = (LEAST_IN_EIGHTH * surfels.len() as f64).max(1.0);
        (0..3).any(|axis| {
            let mut eighths = [0.0; 8];
            for surfel in surfels {
                let [x, y, z] = [1, 2, 3].map(|k| surfel.mean_m[(axis + k) % 3]);
                if z * z <= x * x + y * y {
                    let sides = [x < 0.0, y < 0.0, x.abs() < y.abs()];
                    eighths[sides.into_iter().fold(0, |number, side| 2 * number + usize::from(side))] += 1.0;
                }
            }
            eighths.iter().all(|&count| count >= least)
        })
    }
}
