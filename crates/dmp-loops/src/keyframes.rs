//! Which scans belong to which vertices of a graph.

#[cfg(test)]
mod tests;

use dmp::Run;
use dmp_log::ScanLog;
use dmp_sensor::{Isometry3, PoseGraph, Trajectory};

use crate::LoopError;

/// When the vertices of a graph were: each is the pose of the body at an instant, a keyframe.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Keyframes(Instants);

#[derive(Debug, Clone, PartialEq, Eq)]
enum Instants {
    /// Strictly increasing, nanoseconds.
    At(Vec<i64>),
    /// So many scans of a log without stamps, in their order.
    Scans(usize),
}

impl Keyframes {
    /// The keyframes of a graph with `stamps_ns`, which increase, in the order of the ids; without them every scan of the log
    /// is a keyframe, in the order of the log. Stamps of the log are looked up `time_offset_ns` later.
    ///
    /// # Errors
    /// When there are other counts of stamps, or of scans, than vertices, or stamps for a log without any.
    pub fn of(
        graph: &PoseGraph,
        stamps_ns: Option<&[i64]>,
        log: &dyn ScanLog,
        time_offset_ns: i64,
    ) -> Result<Self, LoopError> {
        let vertices = graph.ids().len();
        let of_scans = log.frames().iter().map(|frame| Some(frame.stamp_ns?.saturating_add(time_offset_ns)));
        let of_scans: Option<Vec<i64>> = of_scans.collect();
        let scans = log.frames().len();
        match (stamps_ns, of_scans) {
            (Some(_), None) => Err(LoopError::NoStamps),
            (Some(times), Some(_)) => Self::at(times.to_vec(), vertices),
            (None, _) if scans != vertices => Err(LoopError::WhichScans { scans, vertices }),
            (None, Some(stamps)) if stamps.windows(2).all(|pair| pair[0] < pair[1]) => {
                Ok(Self(Instants::At(stamps)))
            }
            (None, _) => Ok(Self(Instants::Scans(scans))),
        }
    }

    /// The keyframes of the vertices at these stamps, without a log.
    ///
    /// # Errors
    /// When there are other counts, or a stamp is not larger than the one before it.
    pub fn at(stamps_ns: Vec<i64>, vertices: usize) -> Result<Self, LoopError> {
        if stamps_ns.len() != vertices || vertices == 0 {
            return Err(LoopError::OtherCount { times: stamps_ns.len(), vertices });
        }
        match stamps_ns.windows(2).find(|pair| pair[0] >= pair[1]) {
            Some(pair) => Err(LoopError::Backwards { before_ns: pair[0], stamp_ns: pair[1] }),
            None => Ok(Self(Instants::At(stamps_ns))),
        }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        match &self.0 {
            Instants::At(stamps) => stamps.len(),
            Instants::Scans(scans) => *scans,
        }
    }

    /// The trajectory that goes through the keyframes at `world_from_body`.
    ///
    /// # Errors
    /// When there are more or fewer poses than keyframes, or none.
    pub fn run(&self, name: &str, world_from_body: &[Isometry3<f64>]) -> Result<Run, LoopError> {
        let (keyframes, poses) = (self.len(), world_from_body.len());
        if keyframes != poses {
            return Err(LoopError::OtherKeyframes { keyframes, poses });
        }
        let trajectory = match &self.0 {
            Instants::At(stamps) => {
                let poses = stamps.iter().copied().zip(world_from_body.iter().copied()).collect();
                Trajectory::stamped(poses)?.trajectory
            }
            Instants::Scans(_) => Trajectory::unstamped(world_from_body.to_vec())?,
        };
        Ok(Run::new(name, trajectory))
    }

    /// The keyframe nearest to a scan, by its stamp, or by its number where there are no stamps.
    pub(crate) fn nearest(&self, stamp_ns: Option<i64>, number: usize) -> usize {
        let (Instants::At(stamps), Some(stamp_ns)) = (&self.0, stamp_ns) else { return number };
        let after = stamps.partition_point(|&stamp| stamp <= stamp_ns).min(stamps.len() - 1);
        let before = after.saturating_sub(1);
        let far = |index: usize| stamps[index].abs_diff(stamp_ns);
        if far(before) <= far(after) { before } else { after }
    }
}
