//! Brings two trajectories together: cut, associated, aligned.

use super::{CompareError, Matching, Pose, PosePath, Similarity, associate, umeyama};

/// What is done to two trajectories before they are compared, in the order of the fields.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Preparation {
    /// Only the reference's poses from here, seconds.
    pub start_s: Option<f64>,
    /// Only the reference's poses up to here, seconds.
    pub end_s: Option<f64>,
    /// How stamps are matched.
    pub matching: Matching,
    /// How the estimate is moved onto the reference.
    pub alignment: Alignment,
}

/// How the estimate is moved onto the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Alignment {
    /// By Umeyama's rotation and translation.
    pub pose: bool,
    /// By Umeyama's scale.
    pub scale: bool,
    /// First pose onto first pose. Not together with `pose`.
    pub origin: bool,
}

/// Two trajectories pose by pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// The reference.
    pub reference: PosePath,
    /// The estimate, aligned.
    pub estimate: PosePath,
    /// What the estimate was moved by: where both were asked for, the move of the origin.
    pub moved_by: Option<Similarity>,
}

impl Preparation {
    /// Does it.
    ///
    /// # Errors
    /// As its steps.
    pub fn apply(&self, mut reference: PosePath, estimate: &PosePath) -> Result<Prepared, CompareError> {
        if self.start_s.is_some() || self.end_s.is_some() {
            reference.cut(self.start_s, self.end_s)?;
        }
        let (reference, mut estimate) = associate(&reference, estimate, &self.matching)?;
        let moved_by = self.alignment.apply(&reference, &mut estimate)?;
        Ok(Prepared { reference, estimate, moved_by })
    }
}

impl Alignment {
    fn apply(
        self,
        reference: &PosePath,
        estimate: &mut PosePath,
    ) -> Result<Option<Similarity>, CompareError> {
        let mut moved_by = None;
        if self.pose || self.scale {
            let found = umeyama(reference, estimate, self.scale)?;
            if self.scale {
                estimate.scale(found.scale);
            }
            if self.pose {
                estimate.transform(&found.pose);
            }
            moved_by = Some(found);
        }
        if self.origin
            && let (Some(to), Some(from)) = (reference.poses().first(), estimate.poses().first())
        {
            let pose: Pose = to.times(&from.inverse());
            estimate.transform(&pose);
            moved_by = Some(Similarity { pose, scale: 1.0 });
        }
        Ok(moved_by)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    fn path(left: &Pose, scale: f64) -> PosePath {
        let pose = |k: usize| {
            let k = k as f64;
            Pose {
                rotation: Rotation3::from_euler_angles(0.0, 0.1 * k, 0.2 * k).into_inner(),
                position_m: Vector3::new(k, 0.1 * k * k, (0.5 * k).sin()) * scale,
            }
        };
        let mut path = PosePath::new((0..20).map(pose).collect(), None).unwrap();
        path.transform(left);
        path
    }

    fn worst_m(prepared: &Prepared) -> f64 {
        let both = prepared.reference.poses().iter().zip(prepared.estimate.poses());
        both.map(|(a, b)| (a.position_m - b.position_m).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn each_alignment_takes_away_what_it_can() {
        let rotation = Rotation3::from_euler_angles(0.4, 0.2, -2.0).into_inner();
        let moved = Pose { rotation, position_m: Vector3::new(3.0, 4.0, 5.0) };
        let here = Pose::identity();
        let with = |pose, scale, origin, left: &Pose, size: f64| {
            let alignment = Alignment { pose, scale, origin };
            let preparation = Preparation { alignment, ..Preparation::default() };
            worst_m(&preparation.apply(path(&here, 1.0), &path(left, size)).unwrap())
        };
        assert!(with(false, false, false, &moved, 1.0) > 1.0);
        assert!(with(true, false, false, &moved, 1.0) < 1e-12);
        assert!(with(true, false, false, &moved, 0.5) > 1.0);
        assert!(with(true, true, false, &moved, 0.5) < 1e-12);
        assert!(with(false, true, false, &here, 0.5) < 1e-12);
        assert!(with(false, false, true, &moved, 1.0) < 1e-12);
    }

    #[test]
    fn only_the_reference_is_cut() {
        let stamped = |count: usize| {
            let poses = path(&Pose::identity(), 1.0).poses()[..count].to_vec();
            PosePath::new(poses, Some((0..count).map(|k| k as f64).collect())).unwrap()
        };
        let preparation = Preparation { start_s: Some(2.0), end_s: Some(5.0), ..Preparation::default() };
        let prepared = preparation.apply(stamped(20), &stamped(20)).unwrap();
        assert_eq!(prepared.estimate.stamps_s(), Some(&[2.0, 3.0, 4.0, 5.0][..]));
        let nothing = Preparation { start_s: Some(50.0), end_s: Some(60.0), ..Preparation::default() };
        assert!(matches!(nothing.apply(stamped(20), &stamped(20)), Err(CompareError::NoMatches { .. })));
    }
}
