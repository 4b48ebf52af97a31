//! The path of a run: the scans that it has poses for, the path length, and the segments. No other run changes it.

use std::ops::RangeInclusive;

use dmp_map::Independence;
use dmp_revisit::visits::{Visits, at_part};
use dmp_sensor::{Isometry3, Vector3, along_m};

use super::no_overlap::why_no_overlap;
use super::segments::{Segments, cut_segments};
use crate::asked::{EvaluateError, Run, Settings};
use crate::runs::frame::PlannedFrame;
use crate::runs::heads::Heads;
use crate::runs::run_poses::RunPoses;

/// Least share of scans with a pose; below it, log and run probably do not belong together.
const MIN_POSED_SHARE: f64 = 0.05;
/// Number of visits of a path that is not cut into segments.
const STRETCHES: usize = 16;

/// A run's path through the scans of a log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunPath {
    /// For each scan in use, where on the path it is; `None` where the run has no pose for it.
    at: Vec<Option<OnPath>>,
    /// The segments, by ordinals of scans.
    pub segments: Segments,
    /// For each scan in use the path length up to it, metres.
    pub along_m: Vec<f64>,
    /// Number of scans without a pose.
    pub scans_without_pose: usize,
    /// Those with poses on both sides, but too far apart.
    pub scans_between_poses: usize,
}

/// Where on the path a scan is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct OnPath {
    segment: i32,
    is_revisit: bool,
}

impl RunPath {
    /// The path of a run through the scans in use.
    ///
    /// # Errors
    /// When the run has poses for hardly any scan.
    pub fn new(
        heads: Heads<'_>,
        frames: &[PlannedFrame],
        (run, poses): (&Run, &RunPoses),
        settings: &Settings,
    ) -> Result<Self, EvaluateError> {
        let (mut without, mut between) = (0, 0);
        let place = |frame: &PlannedFrame| {
            let Some(pose) = poses.of_frame(frame) else {
                without += 1;
                return None;
            };
            if !poses.carries(frame) {
                between += 1;
                return None;
            }
            Some(pose.translation.vector)
        };
        let places: Vec<Option<Vector3<f64>>> = frames.iter().map(place).collect();
        let (asked, name) = (frames.len(), || run.name.clone());
        let found = asked - without;
        if found == 0 || (found as f64) < MIN_POSED_SHARE * asked as f64 {
            let why = why_no_overlap(heads, run, settings);
            return Err(EvaluateError::NoOverlap { run: name(), found, scans: asked, why });
        }
        if found == between {
            let (gap_s, off_m) = poses.left_open().unwrap_or_default();
            return Err(EvaluateError::TooSparse { run: name(), gap_s, off_m });
        }
        let along_m = along_m(&places, settings.metre_m());
        let posed: Vec<usize> = (0..frames.len()).filter(|&ordinal| places[ordinal].is_some()).collect();
        let segments = cut_segments(frames, &posed, &along_m, settings.segment, settings.scales);
        let on_path = |segment| OnPath { segment, is_revisit: false };
        let at = segments.of_scans(frames.len(), &posed).into_iter().map(|at| at.map(on_path)).collect();
        let (scans_without_pose, scans_between_poses) = (without, between);
        let mut path = Self { at, segments, along_m, scans_without_pose, scans_between_poses };
        let places = path.places_of_visits(|ordinal| poses.of_frame(&frames[ordinal]));
        let have_another = places.have_another(settings.drift_near_m(), heads.summary().camera.is_some());
        for (scans, has_another) in path.visits().iter().zip(have_another) {
            for &scan in scans {
                path.at[scan] = path.at[scan].map(|at| OnPath { is_revisit: has_another, ..at });
            }
        }
        Ok(path)
    }

    /// The scans with a pose, cut into consecutive visits: the segments, or stretches of a path without any.
    pub fn visits(&self) -> Vec<Vec<usize>> {
        let posed: Vec<usize> = (0..self.at.len()).filter(|&ordinal| self.has(ordinal)).collect();
        if self.segments.length.is_some() {
            posed.chunk_by(|&a, &b| self.segment(a) == self.segment(b)).map(<[usize]>::to_vec).collect()
        } else {
            let count = STRETCHES.min(posed.len());
            let begin = |k: usize| k * posed.len() / count;
            (0..count).map(|k| posed[begin(k)..begin(k + 1)].to_vec()).collect()
        }
    }

    /// Where the visits are: at their middle scans.
    pub fn places_of_visits(&self, pose: impl Fn(usize) -> Option<Isometry3<f64>>) -> Visits {
        let middle = |scans: &Vec<usize>| scans[at_part(scans, &self.along_m, 0.5)];
        let middles: Vec<usize> = self.visits().iter().map(middle).collect();
        Visits {
            poses: middles.iter().map(|&scan| pose(scan).unwrap_or_default()).collect(),
            along_m: middles.iter().map(|&scan| self.along_m[scan]).collect(),
        }
    }

    /// Whether the run comes by the place of a scan on another visit, earlier or later.
    #[inline]
    pub fn is_revisit(&self, ordinal: usize) -> bool {
        self.at.get(ordinal).is_some_and(|at| at.is_some_and(|at| at.is_revisit))
    }

    /// The segment of a scan in use; `None` where the run has no pose for it.
    #[inline]
    pub fn segment(&self, ordinal: usize) -> Option<i32> {
        Some((*self.at.get(ordinal)?)?.segment)
    }

    /// Whether the run has a pose for a scan in use.
    pub fn has(&self, ordinal: usize) -> bool {
        self.segment(ordinal).is_some()
    }

    /// The segments that begin within `pass_m` metres of travel of a scan's own; none where the run has no pose for it.
    pub fn pass(&self, ordinal: usize, pass_m: f64) -> Option<RangeInclusive<i32>> {
        let segment = self.segment(ordinal)?;
        let starts = &self.segments.starts;
        let begins_m = |start: usize| self.along_m.get(start).copied().unwrap_or_default();
        let here_m = begins_m(*starts.get(segment as usize)?);
        let first = starts.partition_point(|&start| begins_m(start) < here_m - pass_m);
        let end = starts.partition_point(|&start| begins_m(start) <= here_m + pass_m);
        Some(first as i32..=end as i32 - 1)
    }

    /// How many segments on another visit begins: as many as `pass_m` metres of travel have, and some at least.
    pub fn revisit_reach(&self, pass_m: f64) -> i32 {
        let Segments { starts, travel_m, .. } = &self.segments;
        let of_pass = (pass_m * starts.len() as f64 / travel_m).min(starts.len() as f64) as i32;
        of_pass.max(Independence::SAME_VISIT)
    }

    /// The path through some of the scans, which have the ordinals 0, 1, 2, … then. Segments keep their numbers.
    #[must_use]
    pub fn through(&self, ordinals: impl Iterator<Item = Option<usize>>) -> Self {
        let at = ordinals.map(|ordinal| *self.at.get(ordinal?)?).collect();
        Self { at, ..self.clone() }
    }

    /// The same without the scans that the run has no pose for.
    #[must_use]
    pub fn posed_only(&self) -> Self {
        let is_kept = |ordinal: &usize| self.has(*ordinal);
        let kept: Vec<usize> = (0..self.at.len()).filter(is_kept).collect();
        let new_of = |ordinal: &usize| kept.partition_point(|kept| kept < ordinal);
        Self {
            at: kept.iter().map(|&ordinal| self.at[ordinal]).collect(),
            along_m: kept.iter().map(|&ordinal| self.along_m[ordinal]).collect(),
            segments: Segments {
                starts: self.segments.starts.iter().map(new_of).collect(),
                ..self.segments.clone()
            },
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_visit_begins_after_a_pass() {
        let reach = |segments: usize, travel_m: f64| {
            let segments = Segments { starts: (0..segments).collect(), travel_m, ..Segments::default() };
            RunPath { segments, ..RunPath::default() }.revisit_reach(66.0)
        };
        // 12 m and more each; 1.5 m each; more than there are; none travelled.
        assert_eq!(
            [(100, 1200.0), (20, 3000.0), (80, 120.0), (16, 20.0), (9, 0.0)].map(|(n, m)| reach(n, m)),
            [5, 5, 44, 16, 9]
        );
    }

    fn on_path(segment: i32) -> OnPath {
        OnPath { segment, is_revisit: false }
    }

    #[test]
    fn a_pass_has_the_segments_near_along_the_path() {
        let starts = vec![0, 2, 4, 5];
        let path = RunPath {
            at: [Some(0), Some(0), Some(1), None, Some(2), Some(3)].map(|at| at.map(on_path)).to_vec(),
            segments: Segments { starts, ..Segments::default() },
            along_m: vec![0.0, 6.0, 12.0, 20.0, 24.0, 90.0],
            ..RunPath::default()
        };
        assert_eq!(path.pass(1, 12.0), Some(0..=1));
        assert_eq!(path.pass(2, 12.0), Some(0..=2));
        assert_eq!((path.pass(3, 12.0), path.pass(5, 12.0)), (None, Some(3..=3)));
        // Some of the scans, with the segments of all.
        let part = path.through([Some(4), Some(5)].into_iter());
        assert_eq!((part.pass(0, 24.0), part.pass(1, 70.0)), (Some(0..=2), Some(2..=3)));
    }
}
