//! Settings that fix the clock, extrinsic or pose format of a run.

use dmp_report::PoseAt;
use dmp_sensor::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::poses_as::PosesAs;
use crate::asked::{Run, SettingName};

/// A setting that fixes a run, with its value.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Mend {
    /// [`Run::pose_at`].
    PoseAt(PoseAt),
    /// [`Run::time_offset_ns`].
    TimeOffset(i64),
    /// [`Run::body_from_sensor`].
    Extrinsic(Isometry3<f64>),
    /// The pose format of the file.
    PosesAs(PosesAs),
}

impl Mend {
    /// Applies it to a run.
    pub(super) fn apply(&self, run: &mut Run) {
        match *self {
            Self::PoseAt(pose_at) => run.pose_at = Some(pose_at),
            Self::TimeOffset(offset_ns) => run.time_offset_ns = Some(offset_ns),
            Self::Extrinsic(body_from_sensor) => run.body_from_sensor = Some(body_from_sensor),
            Self::PosesAs(poses_as) => {
                if let Some(trajectory) = poses_as.read(&run.trajectory) {
                    run.trajectory = trajectory;
                }
            }
        }
    }

    /// A run to which it is applied; `None` where its poses, read so, are none.
    pub(super) fn applied_to(&self, run: &Run) -> Option<Run> {
        if let Self::PosesAs(poses_as) = self {
            return Some(Run { trajectory: poses_as.read(&run.trajectory)?, ..run.clone() });
        }
        let mut run = run.clone();
        self.apply(&mut run);
        Some(run)
    }

    /// As an option for the run of this name: `--pose-at a=end`.
    pub fn message_with(&self, run: &str, name: &dyn Fn(SettingName) -> String) -> String {
        let (setting, value) = match self {
            Self::PoseAt(pose_at) => (SettingName::PoseAt, pose_at.to_string()),
            Self::TimeOffset(offset_ns) => (SettingName::TimeOffset, seconds(*offset_ns)),
            Self::Extrinsic(body_from_sensor) => (SettingName::Extrinsic, seven_in_words(body_from_sensor)),
            Self::PosesAs(poses_as) => (SettingName::PosesAs, poses_as.to_string()),
        };
        setting.for_run(run, &value, name)
    }
}

/// With as many decimals as needed: tenths of a millisecond.
fn seconds(ns: i64) -> String {
    let text = format!("{:.4}", ns as f64 / 1e9);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// An offset, rounded as reported.
pub(super) fn rounded_ns(ns: i64) -> i64 {
    const TENTH_MS_NS: i64 = 100_000;
    (ns as f64 / TENTH_MS_NS as f64).round() as i64 * TENTH_MS_NS
}

/// x, y, z to a hundredth of a millimetre, and a quaternion to ten millionths: the precision of [`rounded`].
fn seven_in_words(pose: &Isometry3<f64>) -> String {
    let [x, y, z] = pose.translation.vector.into();
    let [i, j, k, w]: [f64; 4] = pose.rotation.coords.into();
    let number = |value: f64, decimals: usize| {
        let text = format!("{value:.decimals$}");
        let short = text.trim_end_matches('0').trim_end_matches('.');
        if short == "-0" { "0".to_owned() } else { short.to_owned() }
    };
    let places = [x, y, z].map(|c| number(c, 5));
    let turn = [i, j, k, w].map(|c| number(c, 7));
    format!("{},{}", places.join(","), turn.join(","))
}

/// A pose rounded as its report prints it, so that the option gives the same bits.
pub(super) fn rounded(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let text = seven_in_words(pose);
    let mut numbers = text.split(',').map(|number| number.parse::<f64>().unwrap_or(0.0));
    let mut next = || numbers.next().unwrap_or(0.0);
    let place = Translation3::new(next(), next(), next());
    let [i, j, k, w] = [next(), next(), next(), next()];
    Isometry3::from_parts(place, UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::Vector3;

    #[test]
    fn what_is_reported_is_what_is_applied() {
        let turn = UnitQuaternion::from_euler_angles(0.01, -0.02, 1.0);
        let pose = Isometry3::from_parts(Vector3::new(0.123_456_7, -2.0, 0.0).into(), turn);
        let once = rounded(&pose);
        assert_eq!(seven_in_words(&once), seven_in_words(&pose));
        assert!((once.translation.vector - pose.translation.vector).norm() < 1e-5);
        assert!(once.rotation.angle_to(&pose.rotation) < 1e-6);
        assert!(seven_in_words(&Isometry3::identity()) == "0,0,0,0,0,0,1");
        let words = |mend: Mend| mend.message_with("a", &SettingName::quoted);
        assert_eq!(words(Mend::PoseAt(PoseAt::End)), "`pose-at` a=end");
        assert_eq!(words(Mend::TimeOffset(rounded_ns(-49_984_321))), "`time-offset` a=-0.05");
        assert_eq!(words(Mend::PosesAs(PosesAs::Wxyz)), "`poses-as` a=wxyz");
        assert_eq!(words(Mend::TimeOffset(1_500_000_000)), "`time-offset` a=1.5");
    }
}
