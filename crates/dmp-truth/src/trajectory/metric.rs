//! The errors themselves: APE and RPE, by the relation of poses that is looked at.

use super::rotation::angle_rad;
use super::{CompareError, ErrorUnit, PairOptions, Pose, PosePath, pairs};
use nalgebra::Matrix3;

/// What of a difference of poses is the error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Relation {
    /// ‖E − 1‖ (Frobenius) of the 4 × 4 matrix.
    FullTransformation,
    /// The length of E's translation; for APE the distance of the places.
    #[default]
    TranslationPart,
    /// ‖R − 1‖ (Frobenius) of E's rotation.
    RotationPart,
    /// The angle of E's rotation, radians.
    RotationAngleRad,
    /// The angle of E's rotation, degrees.
    RotationAngleDeg,
    /// APE: the distance of the places. RPE: the difference of the pairs' distances.
    PointDistance,
    /// RPE only: that difference in percent of the reference's distance.
    PointDistanceErrorRatio,
}

impl Relation {
    /// As it is printed.
    pub fn name(self) -> &'static str {
        match self {
            Self::FullTransformation => "full transformation",
            Self::TranslationPart => "translation part",
            Self::RotationPart => "rotation part",
            Self::RotationAngleRad => "rotation angle in radians",
            Self::RotationAngleDeg => "rotation angle in degrees",
            Self::PointDistance => "point distance",
            Self::PointDistanceErrorRatio => "point distance error ratio",
        }
    }

    /// What its errors are in.
    pub fn unit(self) -> ErrorUnit {
        match self {
            Self::TranslationPart | Self::PointDistance => ErrorUnit::Meters,
            Self::RotationAngleRad => ErrorUnit::Radians,
            Self::RotationAngleDeg => ErrorUnit::Degrees,
            Self::PointDistanceErrorRatio => ErrorUnit::Percent,
            Self::FullTransformation | Self::RotationPart => ErrorUnit::None,
        }
    }
}

/// One error for each pose or pair.
#[derive(Debug, Clone, PartialEq)]
pub struct Errors {
    /// What they are in.
    pub unit: ErrorUnit,
    /// The errors, in the order of `poses`.
    pub values: Vec<f64>,
    /// The pose each belongs to: for pairs the later one.
    pub poses: Vec<usize>,
}

impl Errors {
    /// The same errors in another unit of the same kind.
    ///
    /// # Errors
    /// When the units are of different kinds.
    pub fn in_unit(mut self, unit: ErrorUnit) -> Result<Self, CompareError> {
        let refused = CompareError::Unit { from: self.unit, to: unit };
        match (self.unit, unit) {
            (from, to) if from == to => {}
            (ErrorUnit::Radians, ErrorUnit::Degrees) => {
                self.values.iter_mut().for_each(|value| *value = value.to_degrees());
            }
            (ErrorUnit::Degrees, ErrorUnit::Radians) => {
                self.values.iter_mut().for_each(|value| *value = value.to_radians());
            }
            (from, to) => {
                let (Some(from), Some(to)) = (from.meters(), to.meters()) else { return Err(refused) };
                self.values.iter_mut().for_each(|value| *value *= from / to);
            }
        }
        self.unit = unit;
        Ok(self)
    }
}

/// Absolute pose errors: the k-th pose of the estimate against the k-th of the reference,
/// `E = estimate⁻¹ reference`.
///
/// # Errors
/// When the paths have different lengths or an angle is asked of what is no rotation.
pub fn absolute(
    reference: &PosePath,
    estimate: &PosePath,
    relation: Relation,
) -> Result<Errors, CompareError> {
    same_length(reference, estimate)?;
    let both = reference.poses().iter().zip(estimate.poses());
    let values = match relation {
        Relation::PointDistanceErrorRatio => return Err(CompareError::RelationOfPairs),
        Relation::TranslationPart | Relation::PointDistance => {
            both.map(|(q, p)| (p.position_m - q.position_m).norm()).collect()
        }
        _ => both.enumerate().map(|(k, (q, p))| size(&p.to(q), relation, k)).collect::<Result<_, _>>()?,
    };
    Ok(Errors { unit: relation.unit(), values, poses: (0..estimate.len()).collect() })
}

/// Relative pose errors over pairs of poses of the estimate: `E = (Qᵢ⁻¹ Qⱼ)⁻¹ (Pᵢ⁻¹ Pⱼ)` with Q the reference and P the estimate (Sturm et
/// al., *A benchmark for the evaluation of RGB-D SLAM systems*, IROS 2012).
///
/// # Errors
/// As [`absolute`], and when there are no pairs.
pub fn relative(
    reference: &PosePath,
    estimate: &PosePath,
    relation: Relation,
    options: &PairOptions,
) -> Result<Errors, CompareError> {
    same_length(reference, estimate)?;
    let (q, p) = (reference.poses(), estimate.poses());
    let pairs = pairs::pairs(p, options)?;
    let distance_m = |poses: &[Pose], i: usize, j: usize| (poses[i].position_m - poses[j].position_m).norm();
    let errors: Vec<(f64, usize)> = match relation {
        Relation::PointDistance | Relation::PointDistanceErrorRatio => pairs
            .iter()
            .filter_map(|&(i, j)| {
                let of_reference_m = distance_m(q, i, j);
                let error_m = (of_reference_m - distance_m(p, i, j)).abs();
                match relation {
                    Relation::PointDistance => Some((error_m, j)),
                    _ => (of_reference_m != 0.0).then(|| (error_m / of_reference_m * 100.0, j)),
                }
            })
            .collect(),
        _ => pairs
            .iter()
            .map(|&(i, j)| Ok((size(&q[i].to(&q[j]).to(&p[i].to(&p[j])), relation, j)?, j)))
            .collect::<Result<_, _>>()?,
    };
    if errors.is_empty() {
        return Err(CompareError::NoRatios);
    }
    let (values, poses) = errors.into_iter().unzip();
    Ok(Errors { unit: relation.unit(), values, poses })
}

fn same_length(reference: &PosePath, estimate: &PosePath) -> Result<(), CompareError> {
    if reference.len() == estimate.len() {
        Ok(())
    } else {
        Err(CompareError::Lengths { reference: reference.len(), estimate: estimate.len() })
    }
}

fn size(error: &Pose, relation: Relation, index: usize) -> Result<f64, CompareError> {
    let off_m = &error.position_m;
    let turned = (error.rotation - Matrix3::identity()).norm_squared();
    let angle = || angle_rad(&error.rotation).ok_or(CompareError::NotARotation { index });
    Ok(match relation {
        Relation::FullTransformation => (turned + off_m.norm_squared()).sqrt(),
        Relation::RotationPart => turned.sqrt(),
        Relation::RotationAngleRad => angle()?,
        Relation::RotationAngleDeg => angle()?.to_degrees(),
        _ => off_m.norm(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    fn path(poses: &[(f64, f64, f64)]) -> PosePath {
        let pose = |&(x, y, yaw): &(f64, f64, f64)| Pose {
            rotation: Rotation3::from_euler_angles(0.0, 0.0, yaw).into_inner(),
            position_m: Vector3::new(x, y, 0.0),
        };
        PosePath::new(poses.iter().map(pose).collect(), None).unwrap()
    }

    fn assert_near(found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{found:?} {expected:?}");
    }

    #[test]
    fn absolute_errors_by_hand() {
        let reference = path(&[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]);
        let estimate = path(&[(0.0, 0.0, 0.1), (4.0, 4.0, 0.0)]);
        let of = |relation| absolute(&reference, &estimate, relation).unwrap().values;
        let matrix_norm = (8.0 * (0.05_f64).sin().powi(2)).sqrt();
        assert_near(&of(Relation::TranslationPart), &[0.0, 5.0]);
        assert_near(&of(Relation::PointDistance), &[0.0, 5.0]);
        assert_near(&of(Relation::RotationAngleRad), &[0.1, 0.0]);
        assert_near(&of(Relation::RotationAngleDeg), &[0.1_f64.to_degrees(), 0.0]);
        assert_near(&of(Relation::RotationPart), &[matrix_norm, 0.0]);
        assert_near(&of(Relation::FullTransformation), &[matrix_norm, 5.0]);
        assert!(absolute(&reference, &estimate, Relation::PointDistanceErrorRatio).is_err());
        assert!(absolute(&reference, &path(&[(0.0, 0.0, 0.0)]), Relation::TranslationPart).is_err());
    }

    #[test]
    fn relative_errors_by_hand() {
        // The reference goes 1 m ahead each time. The estimate does too, but has turned left before: its
        // second step goes up, which in its own frame is ahead again. Only the first step is wrong, by
        // half a turn's quarter at its end and a second metre.
        let reference = path(&[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)]);
        let left = std::f64::consts::FRAC_PI_2;
        let estimate = path(&[(0.0, 0.0, 0.0), (2.0, 0.0, left), (2.0, 1.0, left)]);
        let options = PairOptions::default();
        let of = |relation| relative(&reference, &estimate, relation, &options).unwrap().values;
        assert_near(&of(Relation::TranslationPart), &[1.0, 0.0]);
        assert_near(&of(Relation::RotationAngleRad), &[left, 0.0]);
        assert_near(&of(Relation::PointDistance), &[1.0, 0.0]);
        assert_near(&of(Relation::PointDistanceErrorRatio), &[100.0, 0.0]);
        // One pair over both steps: the reference is 2 m ahead, the estimate (2, 1).
        let two = PairOptions { delta: 2.0, ..options };
        let of = |relation| relative(&reference, &estimate, relation, &two).unwrap().values;
        assert_near(&of(Relation::TranslationPart), &[1.0]);
        assert_near(&of(Relation::PointDistance), &[5.0_f64.sqrt() - 2.0]);
    }

    #[test]
    fn ratios_leave_standstills_out() {
        let reference = path(&[(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (2.0, 0.0, 0.0)]);
        let estimate = path(&[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)]);
        let options = PairOptions::default();
        let ratio = Relation::PointDistanceErrorRatio;
        let found = relative(&reference, &estimate, ratio, &options).unwrap();
        assert_eq!((found.values, found.poses), (vec![50.0], vec![2]));
        let still = path(&[(0.0, 0.0, 0.0); 3]);
        assert_eq!(relative(&still, &estimate, ratio, &options), Err(CompareError::NoRatios));
    }

    #[test]
    fn units_of_a_kind_change_into_each_other() {
        let errors = Errors { unit: ErrorUnit::Meters, values: vec![1.5], poses: vec![0] };
        assert_eq!(errors.clone().in_unit(ErrorUnit::Centimeters).unwrap().values, [150.0]);
        assert!(errors.in_unit(ErrorUnit::Degrees).is_err());
        let errors = Errors { unit: ErrorUnit::None, values: vec![1.5], poses: vec![0] };
        assert!(errors.in_unit(ErrorUnit::Meters).is_err());
    }
}
