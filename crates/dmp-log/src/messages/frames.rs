//! Frames that hang on one another: what `/tf_static` says, and the tree of `/tf`.

use dmp_sensor::Isometry3;

use super::ros::{PoseCoding, PoseType};
use crate::file::{pose_of, shorten};
use crate::{ParseError, PlaceInFile};
use std::collections::BTreeMap;

/// The topic with frames that do not move.
pub(crate) const STATIC_TOPIC: &str = "/tf_static";
/// More steps from a frame to its root than any robot has: a loop.
const MAX_DEPTH: usize = 1000;

/// Where sensors and bodies sit on one another, as a log's `/tf_static` says: a tree or several.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StaticFrames {
    /// Child, to its parent and `parent_from_child`.
    parents: BTreeMap<String, (String, Isometry3<f64>)>,
}

/// The same frame with and without the slash that ROS 1 put in front.
pub(crate) fn frame_name(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}

impl StaticFrames {
    /// No frames.
    pub const NONE: &'static Self = &Self { parents: BTreeMap::new() };

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }

    /// Every frame that hangs on another, by name: parent, child, `parent_from_child`.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str, &Isometry3<f64>)> {
        self.parents.iter().map(|(child, (parent, pose))| (parent.as_str(), child.as_str(), pose))
    }

    /// Takes in a message of `/tf_static`. What was said before stays where the message is broken.
    pub(crate) fn add_message(&mut self, coding: PoseCoding, message: &[u8]) -> Result<(), String> {
        if coding.pose_type != PoseType::Transforms {
            return Err(format!("{STATIC_TOPIC} holds {}, not TFMessage", coding.pose_type.name()));
        }
        for transform in coding.parse(message)? {
            let pose = pose_of(PlaceInFile::WholeFile, transform.position_m, transform.quaternion);
            let parent_from_child = pose.map_err(|ParseError { problem, .. }| problem)?;
            let child = transform.child.unwrap_or_default();
            self.add(transform.frame, child, parent_from_child)?;
        }
        Ok(())
    }

    /// Takes in a frame; an error where it has another place already.
    pub(crate) fn add(
        &mut self,
        parent: &str,
        child: &str,
        parent_from_child: Isometry3<f64>,
    ) -> Result<(), String> {
        let [parent, child] = [parent, child].map(frame_name);
        if let Some((other, pose)) = self.parents.get(child) {
            let apart_m = (pose.translation.vector - parent_from_child.translation.vector).norm();
            if other != parent || apart_m > 1e-3 || pose.rotation.angle_to(&parent_from_child.rotation) > 1e-3
            {
                let [child, other, parent] = [child, other, parent].map(shorten);
                return Err(format!("the frame `{child}` has two places, in `{other}` and in `{parent}`"));
            }
            return Ok(());
        }
        self.parents.insert(child.to_owned(), (parent.to_owned(), parent_from_child));
        Ok(())
    }

    /// The parent of a frame and `parent_from_frame`; `None` for a root.
    pub(crate) fn parent(&self, frame: &str) -> Option<(&str, &Isometry3<f64>)> {
        self.parents.get(frame).map(|(parent, pose)| (parent.as_str(), pose))
    }

    /// `a_from_b`; `None` where the two do not hang together.
    pub fn a_from_b(&self, a: &str, b: &str) -> Option<Isometry3<f64>> {
        if frame_name(a) == frame_name(b) {
            // To the bit, not but for rounding.
            return Some(Isometry3::identity());
        }
        let [(root_a, root_from_a), (root_b, root_from_b)] =
            [a, b].map(|frame| self.root_of(frame_name(frame)));
        (root_a == root_b).then(|| root_from_a.inverse() * root_from_b)
    }

    /// The frames that hang together with this one, itself not among them, by name.
    pub fn beside(&self, frame: &str) -> Vec<&str> {
        let frame = frame_name(frame);
        let (root, _) = self.root_of(frame);
        let parents = self.parents.values().map(|(parent, _)| parent.as_str());
        let mut names: Vec<&str> = self.parents.keys().map(String::as_str).chain(parents).collect();
        names.retain(|name| *name != frame && self.root_of(name).0 == root);
        names.sort_unstable();
        names.dedup();
        names
    }

    /// The root above a frame and `root_from_frame`; the frame itself where nothing is above it.
    fn root_of<'a>(&'a self, frame: &'a str) -> (&'a str, Isometry3<f64>) {
        let (mut root, mut root_from_frame) = (frame, Isometry3::identity());
        for _ in 0..MAX_DEPTH {
            let Some((parent, parent_from_child)) = self.parent(root) else { break };
            root_from_frame = parent_from_child * root_from_frame;
            root = parent;
        }
        (root, root_from_frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::{Point3, Vector3};

    fn pose(x: f64, yaw: f64) -> Isometry3<f64> {
        Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::new(0.0, 0.0, yaw))
    }

    fn robot() -> StaticFrames {
        let mut frames = StaticFrames::default();
        frames.add("base_link", "mast", pose(1.0, 0.5)).unwrap();
        frames.add("/mast", "/lidar", pose(0.2, 0.0)).unwrap();
        frames.add("base_link", "imu", pose(-0.3, -0.2)).unwrap();
        frames.add("trailer", "rear_lidar", pose(9.0, 0.0)).unwrap();
        frames
    }

    #[test]
    fn frames_are_found_up_and_down_the_tree() {
        let frames = robot();
        assert_eq!(frames.a_from_b("base_link", "lidar"), Some(pose(1.0, 0.5) * pose(0.2, 0.0)));
        assert_eq!(frames.a_from_b("lidar", "/lidar"), Some(Isometry3::identity()));
        // imu_from_lidar by the way of a point.
        let point = Point3::new(4.0, 5.0, 6.0);
        let in_imu = frames.a_from_b("imu", "lidar").unwrap() * point;
        let expected = pose(-0.3, -0.2).inverse() * (pose(1.0, 0.5) * (pose(0.2, 0.0) * point));
        assert!((in_imu - expected).norm() < 1e-12);
        assert_eq!(frames.a_from_b("base_link", "rear_lidar"), None);
        assert_eq!(frames.a_from_b("nowhere", "lidar"), None);
        assert_eq!(frames.beside("lidar"), ["base_link", "imu", "mast"]);
        assert_eq!(frames.beside("rear_lidar"), ["trailer"]);
        assert!(frames.beside("nowhere").is_empty() && !frames.is_empty());
    }

    #[test]
    fn a_frame_has_one_place() {
        let mut frames = robot();
        assert!(frames.add("mast", "lidar", pose(0.2, 0.0)).is_ok());
        for (parent, pose) in [("mast", pose(0.3, 0.0)), ("mast", pose(0.2, 0.1)), ("imu", pose(0.2, 0.0))] {
            assert!(frames.add(parent, "lidar", pose).is_err_and(|e| e.contains("`lidar` has two places")));
        }
    }

    #[test]
    fn a_loop_ends() {
        let mut frames = StaticFrames::default();
        frames.add("a", "b", pose(1.0, 0.0)).unwrap();
        frames.add("b", "a", pose(1.0, 0.0)).unwrap();
        assert_eq!((frames.a_from_b("a", "b"), frames.a_from_b("a", "c")), (None, None));
    }
}
