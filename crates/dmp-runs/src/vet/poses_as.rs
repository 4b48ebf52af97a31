//! Pose formats other than the default.

use std::fmt;
use std::str::FromStr;

use dmp_sensor::{Isometry3, Quaternion, Trajectory, UnitQuaternion};

/// The pose format of a file that is not `world_from_body` in metres with quaternions x, y, z, w. It has a name as
/// text (`FromStr`, `Display`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PosesAs {
    /// Poses are `body_from_world`.
    Inverted,
    /// Quaternions are w, x, y, z.
    Wxyz,
    /// Positions are in millimetres.
    Millimetres,
    /// Positions are in centimetres.
    Centimetres,
    /// Positions are in kilometres.
    Kilometres,
}

impl PosesAs {
    /// Every format.
    pub const ALL: [Self; 5] =
        [Self::Inverted, Self::Wxyz, Self::Millimetres, Self::Centimetres, Self::Kilometres];

    /// The names of all.
    pub fn names() -> String {
        Self::ALL.map(|poses_as| poses_as.to_string()).join(", ")
    }

    /// Converts poses from this format; `None` if the result is no trajectory.
    pub fn read(self, trajectory: &Trajectory) -> Option<Trajectory> {
        let as_meant = |pose: &Isometry3<f64>| match self {
            Self::Inverted => pose.inverse(),
            Self::Wxyz => {
                let read = pose.rotation.coords;
                let meant = Quaternion::new(read.x, read.y, read.z, read.w);
                Isometry3::from_parts(pose.translation, UnitQuaternion::from_quaternion(meant))
            }
            Self::Millimetres => scaled(pose, 1e-3),
            Self::Centimetres => scaled(pose, 1e-2),
            Self::Kilometres => scaled(pose, 1e3),
        };
        with_poses(trajectory, as_meant)
    }
}

/// A pose of a path that is so much larger.
fn scaled(pose: &Isometry3<f64>, factor: f64) -> Isometry3<f64> {
    Isometry3::from_parts((pose.translation.vector * factor).into(), pose.rotation)
}

/// A trajectory so much larger; `None` if the result is none.
pub(super) fn enlarged(trajectory: &Trajectory, factor: f64) -> Option<Trajectory> {
    with_poses(trajectory, |pose| scaled(pose, factor))
}

fn with_poses(
    trajectory: &Trajectory,
    pose: impl Fn(&Isometry3<f64>) -> Isometry3<f64>,
) -> Option<Trajectory> {
    let poses = trajectory.poses().iter().map(pose);
    match trajectory.stamps_ns() {
        Some(stamps) => {
            Some(Trajectory::stamped(stamps.iter().copied().zip(poses).collect()).ok()?.trajectory)
        }
        None => Trajectory::unstamped(poses.collect()).ok(),
    }
}

impl fmt::Display for PosesAs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inverted => "inverted",
            Self::Wxyz => "wxyz",
            Self::Millimetres => "mm",
            Self::Centimetres => "cm",
            Self::Kilometres => "km",
        })
    }
}

impl FromStr for PosesAs {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|way| way.to_string() == text);
        found.ok_or_else(|| format!("`{text}` is no pose format: choose one of {}", Self::names()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::Vector3;

    #[test]
    fn poses_come_back_as_they_were_meant() {
        let turn = UnitQuaternion::from_euler_angles(0.1, -0.2, 3.0);
        let pose = Isometry3::from_parts(Vector3::new(1.0, 2.0, -3.0).into(), turn);
        let [x, y, z, w] = [turn.i, turn.j, turn.k, turn.w];
        // A reader of x, y, z, w gets this from a file with w, x, y, z.
        let misread = UnitQuaternion::new_unchecked(Quaternion::new(z, w, x, y));
        let written = |way: PosesAs| match way {
            PosesAs::Inverted => pose.inverse(),
            PosesAs::Wxyz => Isometry3::from_parts(pose.translation, misread),
            PosesAs::Millimetres => Isometry3::from_parts((pose.translation.vector * 1e3).into(), turn),
            PosesAs::Centimetres => Isometry3::from_parts((pose.translation.vector * 1e2).into(), turn),
            PosesAs::Kilometres => Isometry3::from_parts((pose.translation.vector * 1e-3).into(), turn),
        };
        for way in PosesAs::ALL {
            let file = Trajectory::stamped(vec![(7, written(way))]).unwrap().trajectory;
            let meant = way.read(&file).unwrap();
            assert_eq!(meant.stamps_ns(), Some(&[7][..]));
            let off = pose.inverse() * meant.poses()[0];
            assert!(off.translation.vector.norm() < 1e-12 && off.rotation.angle() < 1e-7, "{way}: {off}");
            assert_eq!(way.to_string().parse(), Ok(way));
        }
        assert!("xyzw".parse::<PosesAs>().is_err());
    }
}
