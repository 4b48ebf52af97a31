//! The path of a run: the scans that it has poses for, the path length, and the segments. No other run changes it.

use std::ops::RangeInclusive;

use dmp_sensor::Vector3;

use super::no_overlap::why_no_overlap;
use super::segments::{Segments, cut_segments};
use crate::asked::{EvaluateError, Run, Settings};
use crate::runs::frame::PlannedFrame;
use crate::runs::heads::Heads;
use crate::runs::run_poses::RunPoses;

/// Least share of scans with a pose; below it, log and run probably do not belong together.
const MIN_POSED_SHARE: f64 = 0.05;
/// Lengths of the ruler that measures a path, metres of a drive. Jitter of a few decimetres does not lengthen a path that
/// is measured with the longest; it is used where a path is this many rulers long, and a shorter one where it is not.
const RULERS_M: [f64; 4] = [6.0, 3.0, 1.5, 0.75];
const RULERS: f64 = 16.0;

/// A run's path through the scans of a log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunPath {
    /// For each scan in use, the segment that it is in; `None` where the run has no pose for it.
    segment_of: Vec<Option<i32>>,
    /// The segments, by ordinals of scans.
    pub segments: Segments,
    /// For each scan in use the path length up to it, metres.
    pub along_m: Vec<f64>,
    /// Number of scans without a pose.
    pub scans_without_pose: usize,
    /// Those with poses on both sides, but too far apart.
    pub scans_between_poses: usize,
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
        let segment_of = segments.of_scans(frames.len(), &posed);
        let (scans_without_pose, scans_between_poses) = (without, between);
        Ok(Self { segment_of, segments, along_m, scans_without_pose, scans_between_poses })
    }

    /// The segment of a scan in use; `None` where the run has no pose for it.
    #[inline]
    pub fn segment(&self, ordinal: usize) -> Option<i32> {
        *self.segment_of.get(ordinal)?
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

    /// The path through some of the scans, which have the ordinals 0, 1, 2, … then. Segments keep their numbers.
    #[must_use]
    pub fn through(&self, ordinals: impl Iterator<Item = Option<usize>>) -> Self {
        let segment_of = ordinals.map(|ordinal| self.segment(ordinal?)).collect();
        Self { segment_of, ..self.clone() }
    }

    /// The same without the scans that the run has no pose for.
    #[must_use]
    pub fn posed_only(&self) -> Self {
        let is_kept = |ordinal: &usize| self.has(*ordinal);
        let kept: Vec<usize> = (0..self.segment_of.len()).filter(is_kept).collect();
        let new_of = |ordinal: &usize| kept.partition_point(|kept| kept < ordinal);
        Self {
            segment_of: kept.iter().map(|&ordinal| self.segment_of[ordinal]).collect(),
            along_m: kept.iter().map(|&ordinal| self.along_m[ordinal]).collect(),
            segments: Segments {
                starts: self.segments.starts.iter().map(new_of).collect(),
                ..self.segments.clone()
            },
            ..*self
        }
    }
}

/// The path length up to each place, metres; scans without a place have that of the one before.
fn along_m(places: &[Option<Vector3<f64>>], metre_m: f64) -> Vec<f64> {
    let mut along_m = Vec::new();
    for ruler_m in RULERS_M {
        along_m = ruled_m(places, ruler_m * metre_m);
        if along_m.last().is_some_and(|&travel_m| travel_m >= RULERS * ruler_m * metre_m) {
            break;
        }
    }
    along_m
}

/// The same measured with one ruler: it is laid down where the path leaves its reach.
fn ruled_m(places: &[Option<Vector3<f64>>], ruler_m: f64) -> Vec<f64> {
    let mut end: Option<(Vector3<f64>, f64)> = None;
    let mut along_m = 0.0;
    let measure = |place: &Option<Vector3<f64>>| {
        let Some(place) = place else { return along_m };
        let &mut (from, begun_m) = end.get_or_insert((*place, 0.0));
        let apart_m = (place - from).norm();
        along_m = f64::max(along_m, begun_m + apart_m);
        if apart_m >= ruler_m {
            end = Some((*place, along_m));
        }
        along_m
    };
    places.iter().map(measure).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn way(count: usize, step_m: f64, noise_m: f64) -> Vec<Option<Vector3<f64>>> {
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // The sum of four uniform numbers has a variance of a third.
            let uniform = |k: u32| f64::from((state >> (16 * k)) as u16) / 32_768.0 - 1.0;
            noise_m * (0..4).map(uniform).sum::<f64>() / (4.0_f64 / 3.0).sqrt()
        };
        let place = |k: usize| Some(Vector3::new(step_m * k as f64 + noise(), noise(), noise()));
        (0..count).map(place).collect()
    }

    #[test]
    fn jitter_does_not_lengthen_a_path() {
        let travel_m = |noise_m| *along_m(&way(2000, 0.8, noise_m), 1.0).last().unwrap();
        let (smooth_m, noisy_m) = (travel_m(0.0), travel_m(0.3));
        assert!((smooth_m - 1599.2).abs() < 1e-9, "{smooth_m}");
        assert!((noisy_m / smooth_m - 1.0).abs() < 0.02, "{noisy_m}");
        // Standing is no travel.
        assert!(*along_m(&way(2000, 0.0, 0.1), 1.0).last().unwrap() < 10.0);
    }

    #[test]
    fn a_pass_has_the_segments_near_along_the_path() {
        let starts = vec![0, 2, 4, 5];
        let path = RunPath {
            segment_of: vec![Some(0), Some(0), Some(1), None, Some(2), Some(3)],
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

    #[test]
    fn a_path_never_gets_shorter_and_gaps_are_passed_over() {
        let mut places = way(500, 0.5, 0.1);
        (100..200).for_each(|k| places[k] = None);
        let along_m = along_m(&places, 1.0);
        assert!(along_m.is_sorted() && along_m[100..200].iter().all(|&m| m == along_m[99]));
        assert!(*along_m.last().unwrap() > 245.0);
    }
}
