//! Which scans belong to which vertices of a graph.

use dmp::Run;
use dmp_log::ScanLog;
use dmp_sensor::{Isometry3, PoseGraph, Trajectory};

use crate::LoopError;

/// When the vertices of a graph were: each is the pose of the body at an instant, a keyframe.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Keyframes {
    /// At these stamps, nanoseconds, in the order of the vertices' ids.
    At(Vec<i64>),
    /// At the scans of a log without stamps, in their order.
    Scans(usize),
}

impl Keyframes {
    /// The keyframes of a graph with `stamps_ns`, in the order of the ids; without them every scan of the log is a
    /// keyframe, in the order of the log.
    ///
    /// # Errors
    /// When there are other counts of stamps, or of scans, than vertices.
    pub fn of(graph: &PoseGraph, stamps_ns: Option<&[i64]>, log: &dyn ScanLog) -> Result<Self, LoopError> {
        let vertices = graph.ids().len();
        let scans: Vec<Option<i64>> = log.frames().iter().map(|frame| frame.stamp_ns).collect();
        match stamps_ns {
            Some(times) if times.len() != vertices => {
                Err(LoopError::OtherCount { times: times.len(), vertices })
            }
            Some(times) if scans.iter().all(Option::is_some) => Ok(Self::At(times.to_vec())),
            _ if scans.len() != vertices => Err(LoopError::WhichScans { scans: scans.len(), vertices }),
            _ => {
                let stamps: Option<Vec<i64>> = scans.iter().copied().collect();
                let rising = stamps.filter(|stamps| stamps.windows(2).all(|pair| pair[0] < pair[1]));
                Ok(rising.map_or(Self::Scans(scans.len()), Self::At))
            }
        }
    }

    /// The trajectory that goes through the keyframes at `world_from_body`.
    ///
    /// # Errors
    /// When two of them have one stamp.
    pub fn run(&self, name: &str, world_from_body: &[Isometry3<f64>]) -> Result<Run, LoopError> {
        let trajectory = match self {
            Self::At(stamps) => {
                let poses = stamps.iter().copied().zip(world_from_body.iter().copied()).collect();
                Trajectory::stamped(poses)?.trajectory
            }
            Self::Scans(_) => Trajectory::unstamped(world_from_body.to_vec())?,
        };
        Ok(Run::new(name, trajectory))
    }

    /// The keyframe nearest to a scan, by its stamp, or by its number where there are no stamps.
    pub(crate) fn nearest(&self, stamp_ns: Option<i64>, number: usize) -> usize {
        let (Self::At(stamps), Some(stamp_ns)) = (self, stamp_ns) else { return number };
        let after = stamps.partition_point(|&stamp| stamp <= stamp_ns).min(stamps.len() - 1);
        let before = after.saturating_sub(1);
        let far = |index: usize| stamps[index].abs_diff(stamp_ns);
        if far(before) <= far(after) { before } else { after }
    }
}
