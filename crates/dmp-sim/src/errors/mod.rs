//! Wrong trajectories made from a good one, with the errors that SLAM systems make.

mod align;
mod closure;
mod drift;
mod false_loop;
mod noise;
mod poses;
mod shape;

use dmp_sensor::Trajectory;

use crate::error::{SimError, require};
pub use align::ate_rmse_m;
pub use closure::close_loop;
pub use noise::Noise;
use poses::{Travel, with_poses};

/// Errors to put into a trajectory. Those that are set are applied in the order of the fields, each to the
/// result of the one before; the same numbers give the same trajectory, to the bit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SlamErrors {
    /// Seed of drift, false loop and noise.
    pub seed: u64,
    /// All places are drawn away from the first one by this factor; directions stay.
    pub scale: Option<f64>,
    /// The run is bent upwards by this height in metres (the z axis of the trajectory's world): a parabola
    /// over the travel, 0 at both ends and highest in the middle. The poses tilt with it.
    pub bend_m: Option<f64>,
    /// Drift that grows smoothly with the travel: errors of heading, tilt and step length wander, and their
    /// sums bend the whole run. Scaled so that the RMSE of the places after the best rigid alignment (no
    /// scale) is this many metres, to 0.1 %.
    pub drift_ate_m: Option<f64>,
    /// A wrong loop closure: two places of the run about this many metres apart (to 10 %) are mapped onto
    /// each other. The stretch between them is sheared smoothly, what comes after is displaced as a whole.
    pub false_loop_m: Option<f64>,
    /// Share of the travel that is collapsed onto one place: in the middle of the run the estimate stands
    /// still while the sensor drives on, as in a street without features; what comes after is displaced as
    /// a whole. Scans of distinct places lie on top of each other: the map becomes smaller and denser.
    pub collapse_share: Option<f64>,
    /// White noise.
    pub noise: Option<Noise>,
}

impl SlamErrors {
    /// The trajectory with the errors in it; stamps, or their absence, stay as they are.
    ///
    /// # Errors
    /// When a number is outside its range, or cannot be reached in this run: a drift beyond its size, a
    /// false loop between places farther apart than any, anything but noise in a run that stands still.
    pub fn apply(&self, run: &Trajectory) -> Result<Trajectory, SimError> {
        let mut poses = run.poses().to_vec();
        if let Some(factor) = self.scale {
            require(factor > 0.0 && factor.is_finite(), "the scale", "a positive factor", factor)?;
            shape::scale(&mut poses, factor);
        }
        if let Some(height_m) = self.bend_m {
            require(height_m.is_finite(), "the bend in m", "a finite height", height_m)?;
            let travel_m = Travel::of(&poses, "a bend")?;
            shape::bend(&mut poses, &travel_m, height_m);
        }
        if let Some(ate_m) = self.drift_ate_m {
            require(ate_m > 0.0 && ate_m.is_finite(), "the drift's ATE in m", "positive", ate_m)?;
            let travel_m = Travel::of(&poses, "drift")?;
            drift::drift(&mut poses, &travel_m, ate_m, self.seed)?;
        }
        if let Some(jump_m) = self.false_loop_m {
            require(jump_m > 0.0 && jump_m.is_finite(), "the false loop's jump in m", "positive", jump_m)?;
            let travel_m = Travel::of(&poses, "a false loop")?;
            false_loop::close(&mut poses, &travel_m, jump_m, self.seed)?;
        }
        if let Some(share) = self.collapse_share {
            require(share > 0.0 && share < 1.0, "the collapsed share", "above 0 and below 1", share)?;
            let travel_m = Travel::of(&poses, "a collapse")?;
            shape::collapse(&mut poses, &travel_m, share);
        }
        if let Some(noise) = self.noise {
            noise.check()?;
            noise.add(&mut poses, run.stamps_ns(), self.seed);
        }
        Ok(with_poses(run, poses))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use dmp_sensor::{Isometry3, Translation3, UnitQuaternion, Vector3};

    /// A lap and a half on a circle with a radius of 30 m, `count` poses, 0.1 s apart.
    pub(crate) fn circle(count: usize) -> Trajectory {
        let pose = |k: usize| {
            let angle = 3.0 * std::f64::consts::PI * k as f64 / (count - 1) as f64;
            let place = Translation3::new(30.0 * libm::cos(angle), 30.0 * libm::sin(angle), 2.0);
            let yaw = angle + std::f64::consts::FRAC_PI_2;
            (
                k as i64 * 100_000_000,
                Isometry3::from_parts(place, UnitQuaternion::from_euler_angles(0.0, 0.0, yaw)),
            )
        };
        Trajectory::stamped((0..count).map(pose).collect()).unwrap().trajectory
    }

    fn place(run: &Trajectory, k: usize) -> Vector3<f64> {
        run.poses()[k].translation.vector
    }

    /// Largest change from one step to the next, metres: small for smooth runs.
    fn roughness(run: &Trajectory) -> f64 {
        let jerk = |k: usize| (place(run, k + 2) - 2.0 * place(run, k + 1) + place(run, k)).norm();
        (0..run.len() - 2).map(jerk).fold(0.0, f64::max)
    }

    #[test]
    fn scale_grows_from_the_first_place() {
        let run = circle(50);
        let wrong = SlamErrors { scale: Some(1.1), ..SlamErrors::default() }.apply(&run).unwrap();
        for k in 0..run.len() {
            let expected = place(&run, 0) + (place(&run, k) - place(&run, 0)) * 1.1;
            assert!((place(&wrong, k) - expected).norm() < 1e-12);
        }
    }

    #[test]
    fn a_bend_is_highest_in_the_middle_and_tilts_along() {
        let run = circle(301);
        let wrong = SlamErrors { bend_m: Some(2.0), ..SlamErrors::default() }.apply(&run).unwrap();
        assert!((place(&wrong, 150).z - 4.0).abs() < 1e-9);
        assert!((place(&wrong, 0).z - 2.0).abs() < 1e-9 && (place(&wrong, 300).z - 2.0).abs() < 1e-9);
        for k in 5..295 {
            let ahead = wrong.poses()[k].rotation * Vector3::x();
            let step = (place(&wrong, k + 1) - place(&wrong, k - 1)).normalize();
            assert!((ahead - step).norm() < 2e-3, "{k}: {ahead:?} {step:?}");
        }
    }

    #[test]
    fn drift_has_the_error_asked_for_and_is_smooth() {
        let run = circle(1000);
        for (seed, ate_m) in [(1, 0.05), (2, 1.0), (3, 5.0)] {
            let errors = SlamErrors { seed, drift_ate_m: Some(ate_m), ..SlamErrors::default() };
            let wrong = errors.apply(&run).unwrap();
            let got_m = ate_rmse_m(&wrong, &run);
            assert!((got_m / ate_m - 1.0).abs() < 0.01, "{got_m} for {ate_m}");
            assert!(roughness(&wrong) < roughness(&run) * 2.0 + 1e-3, "{}", roughness(&wrong));
            assert_eq!(errors.apply(&run).unwrap(), wrong);
        }
        let too_much = SlamErrors { drift_ate_m: Some(1e4), ..SlamErrors::default() }.apply(&run);
        assert!(matches!(too_much, Err(SimError::DriftNotReached { .. })), "{too_much:?}");
    }

    #[test]
    fn a_false_loop_joins_two_places_smoothly() {
        let run = circle(1000);
        let wrong = SlamErrors { false_loop_m: Some(20.0), ..SlamErrors::default() }.apply(&run).unwrap();
        assert!((place(&wrong, 999) - place(&run, 999)).norm() - 20.0 < 1e-9);
        assert_eq!(place(&wrong, 0), place(&run, 0));
        assert!(roughness(&wrong) < 0.05, "{}", roughness(&wrong));
        let joined = (0..900).any(|i| {
            (i + 50..1000).any(|j| {
                (place(&wrong, i) - place(&wrong, j)).norm() < 2.5
                    && ((place(&run, i) - place(&run, j)).norm() - 20.0).abs() < 2.0
            })
        });
        assert!(joined);
        let too_far = SlamErrors { false_loop_m: Some(100.0), ..SlamErrors::default() }.apply(&run);
        assert!(matches!(too_far, Err(SimError::NoSuchPlaces { .. })), "{too_far:?}");
    }

    #[test]
    fn a_collapse_loses_its_share_of_the_travel() {
        let run = circle(1000);
        let wrong = SlamErrors { collapse_share: Some(0.25), ..SlamErrors::default() }.apply(&run).unwrap();
        let total = |run: &Trajectory| Travel::of(run.poses(), "").unwrap().total_m();
        assert!((total(&wrong) / total(&run) - 0.75).abs() < 1e-3);
        assert!((place(&wrong, 450) - place(&wrong, 550)).norm() < 1e-9);
        assert!(roughness(&wrong) < 0.1);
        assert_eq!(wrong.poses()[700].rotation, run.poses()[700].rotation);
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let run = circle(50);
        let still = Trajectory::unstamped(vec![Isometry3::identity(); 5]).unwrap();
        let nan = Some(f64::NAN);
        for errors in [
            SlamErrors { scale: nan, ..SlamErrors::default() },
            SlamErrors { bend_m: nan, ..SlamErrors::default() },
            SlamErrors { drift_ate_m: nan, ..SlamErrors::default() },
            SlamErrors { false_loop_m: nan, ..SlamErrors::default() },
            SlamErrors { collapse_share: Some(1.0), ..SlamErrors::default() },
        ] {
            assert!(matches!(errors.apply(&run), Err(SimError::OutOfRange { .. })), "{errors:?}");
        }
        let drift = SlamErrors { drift_ate_m: Some(1.0), ..SlamErrors::default() };
        assert_eq!(drift.apply(&still), Err(SimError::NoTravel { what: "drift" }));
        let noise = Some(Noise { sigma_m: 0.1, sigma_rad: 0.0, interval_ns: 1 });
        assert!(SlamErrors { noise, ..SlamErrors::default() }.apply(&still).is_ok());
        assert_eq!(close_loop(&still, &still), Err(SimError::NoTravel { what: "a loop closure" }));
    }
}
