//! Cuts a drive into segments.

use std::collections::HashMap;

use dmp_reduce::Scales;

use crate::error::EvaluateError;
use crate::frames::PlannedFrame;
use crate::report::SegmentReport;
use crate::segment_length::SegmentLength;
use crate::setting_name::SettingName;

/// The segments of a drive, the same for all runs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Segments {
    /// Length given or chosen; `None` where every scan is its own segment.
    pub(crate) length: Option<SegmentLength>,
    /// Whether a length was given.
    pub(crate) given: bool,
    /// Ordinals of the frames that begin a segment.
    pub(crate) starts: Vec<usize>,
    /// The path length, metres: the median over the runs per step, accumulated.
    pub(crate) travel_m: f64,
}

/// Number of segments of a short drive.
const SEGMENTS: f64 = 16.0;
/// With fewer segments, or less travel on a drive, every scan is its own segment.
const MIN_SEGMENTS: usize = 8;
const MIN_TRAVEL_M: f64 = 1.0;

/// Cuts the drive and numbers every frame's segment. `steps_m` is the distance from each frame to the next.
pub(super) fn cut_segments(
    steps_m: &[f64],
    asked: Option<SegmentLength>,
    scales: Scales,
    frames: &mut [PlannedFrame],
) -> Segments {
    let travel_m: f64 = steps_m.iter().sum();
    let length = asked.unwrap_or_else(|| match scales.lengths().segment_m {
        Some(longest_m) => SegmentLength::Metres(longest_m.min(travel_m / SEGMENTS)),
        None => SegmentLength::Scans((frames.len() as f64 / SEGMENTS).ceil() as u64),
    });
    let mut starts = match length {
        SegmentLength::Metres(m) if travel_m >= MIN_TRAVEL_M => starts_of(steps_m.iter().copied(), m),
        SegmentLength::Metres(_) => vec![0],
        SegmentLength::Seconds(s) => starts_by_time(frames, s),
        SegmentLength::Scans(scans) => (0..frames.len()).step_by(scans.max(1) as usize).collect(),
    };
    let is_cut = starts.len() >= MIN_SEGMENTS;
    if !is_cut {
        starts = (0..frames.len()).collect();
    }
    number(frames, &starts);
    Segments { length: is_cut.then_some(length), given: asked.is_some(), starts, travel_m }
}

/// The ordinals at which segments of this length begin; `steps` are between frames, in the same unit.
fn starts_of(steps: impl Iterator<Item = f64>, length: f64) -> Vec<usize> {
    let mut starts = vec![0];
    if length > 0.0 {
        let (mut along, mut cell) = (0.0, 0.0);
        for (ordinal, step) in (1..).zip(steps) {
            along += step;
            let here = (along / length).floor();
            if here > cell {
                starts.push(ordinal);
                cell = here;
            }
        }
    }
    starts
}

/// The same by stamps, in whole nanoseconds: a segment begins with the first frame of each non-empty
/// interval. A log without stamps has one segment.
fn starts_by_time(frames: &[PlannedFrame], length_s: f64) -> Vec<usize> {
    let length_ns = ((length_s * 1e9).round() as i64).max(1);
    let first_ns = frames.first().and_then(|frame| frame.stamp_ns);
    let stretch = |frame: &PlannedFrame| Some(frame.stamp_ns?.saturating_sub(first_ns?) / length_ns);
    let begins = |pair: &[PlannedFrame]| stretch(&pair[0]) != stretch(&pair[1]);
    let later = (1..).zip(frames.windows(2)).filter(|(_, pair)| begins(pair)).map(|(ordinal, _)| ordinal);
    std::iter::once(0).chain(later).collect()
}

/// Assigns every frame its segment from another evaluation's report.
///
/// # Errors
/// When they do not begin with the first frame, begin with a scan not in use, or are out of order.
pub(super) fn take_segments(
    given: &SegmentReport,
    frames: &mut [PlannedFrame],
) -> Result<Segments, EvaluateError> {
    let bad =
        |scan: usize, why| EvaluateError::setting(SettingName::Segments, format!("from scan {scan}"), why);
    let ordinals: HashMap<usize, usize> =
        frames.iter().enumerate().map(|(ordinal, frame)| (frame.number, ordinal)).collect();
    let mut starts: Vec<usize> = Vec::with_capacity(given.starts_scan.len());
    for &scan in &given.starts_scan {
        let why = "a segment cannot begin there: the scan is not among those in use, which must be the same as where the \
                   segments are from";
        let ordinal = *ordinals.get(&scan).ok_or_else(|| bad(scan, why))?;
        match starts.last() {
            None if ordinal > 0 => {
                return Err(bad(scan, "the first segment must begin with the first scan in use"));
            }
            Some(&last) if ordinal <= last => return Err(bad(scan, "segments must ascend")),
            _ => starts.push(ordinal),
        }
    }
    if starts.is_empty() {
        return Err(bad(0, "there must be at least one"));
    }
    number(frames, &starts);
    Ok(Segments { length: given.length(), given: false, starts, travel_m: given.travel_m })
}

/// Numbers every frame's segment, given the ordinals at which segments begin.
fn number(frames: &mut [PlannedFrame], starts: &[usize]) {
    let mut segment = -1;
    let mut next = starts.iter().peekable();
    for (ordinal, frame) in frames.iter_mut().enumerate() {
        if next.next_if(|&&start| start == ordinal).is_some() {
            segment += 1;
        }
        frame.segment = segment;
    }
}

/// The middle value; the mean of the two middle ones of an even number; 0 of none.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.as_slice() {
        [] => 0.0,
        v if v.len() % 2 == 1 => v[v.len() / 2],
        v => 0.5 * (v[v.len() / 2 - 1] + v[v.len() / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(count: usize) -> Vec<PlannedFrame> {
        (0..count)
            .map(|frame| PlannedFrame { frame, number: frame, stamp_ns: None, returns: 1, segment: 0 })
            .collect()
    }

    #[test]
    fn a_drive_is_cut_every_twelve_metres() {
        let mut planned = frames(401);
        let segments = cut_segments(&[1.0; 400], None, Scales::Drive, &mut planned);
        assert_eq!((segments.length, segments.starts.len()), (Some(SegmentLength::Metres(12.0)), 34));
        assert_eq!((planned[11].segment, planned[12].segment, planned[400].segment), (0, 1, 33));
    }

    #[test]
    fn a_short_way_gives_sixteen_segments_and_a_stand_none() {
        let mut planned = frames(129);
        let cut = cut_segments(&[0.25; 128], None, Scales::Drive, &mut planned);
        assert_eq!(cut.length, Some(SegmentLength::Metres(2.0)));
        assert_eq!(planned[128].segment, 16);
        let standing = cut_segments(&[0.001; 128], None, Scales::Drive, &mut planned);
        assert_eq!(standing.length, None);
        assert!(planned.iter().enumerate().all(|(k, frame)| frame.segment == k as i32));
    }

    #[test]
    fn scans_further_apart_than_a_segment_are_neighbours_still() {
        let mut planned = frames(21);
        cut_segments(&[30.0; 20], None, Scales::Drive, &mut planned);
        assert!(planned.iter().enumerate().all(|(k, frame)| frame.segment == k as i32));
    }

    #[test]
    fn segments_of_another_evaluation_are_taken_as_they_are() {
        // Every second scan is in use.
        let planned = || -> Vec<PlannedFrame> {
            frames(10).into_iter().map(|frame| PlannedFrame { number: 2 * frame.frame, ..frame }).collect()
        };
        let given = |starts_scan: &[usize]| SegmentReport {
            length_m: Some(3.0),
            length_s: None,
            length_scans: None,
            count: starts_scan.len(),
            travel_m: 20.0,
            starts_ns: Vec::new(),
            starts_scan: starts_scan.to_vec(),
        };
        let mut cut = planned();
        let segments = take_segments(&given(&[0, 6, 8]), &mut cut).unwrap();
        let length = Some(SegmentLength::Metres(3.0));
        assert_eq!((segments.starts, segments.length, segments.travel_m), (vec![0, 3, 4], length, 20.0));
        assert!(cut.iter().map(|frame| frame.segment).eq([0, 0, 0, 1, 2, 2, 2, 2, 2, 2]));
        for (starts, words) in [
            (vec![0, 7], "segments from scan 7: a segment cannot begin there"),
            (vec![0, 6, 6], "segments from scan 6: segments must ascend"),
            (vec![2, 6], "segments from scan 2: the first segment"),
            (vec![], "there must be at least one"),
        ] {
            let error = take_segments(&given(&starts), &mut planned()).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn segments_may_be_asked_for_in_seconds_and_scans() {
        // Ten scans a second, none at 2.0 to 2.9 s.
        let stamps_ns = (0..60).filter(|k| !(20..30).contains(k)).map(|k| k * 100_000_000);
        let mut planned = frames(50);
        planned.iter_mut().zip(stamps_ns).for_each(|(frame, ns)| frame.stamp_ns = Some(ns));
        let steps_m = [0.0; 49];
        let by_time = cut_segments(&steps_m, Some(SegmentLength::Seconds(0.5)), Scales::Room, &mut planned);
        assert_eq!(by_time.starts, [0, 5, 10, 15, 20, 25, 30, 35, 40, 45]);
        let by_time = cut_segments(&steps_m, Some(SegmentLength::Seconds(0.7)), Scales::Room, &mut planned);
        // The cells of 0.7 s that have a scan.
        assert_eq!(by_time.starts, [0, 7, 14, 20, 25, 32, 39, 46]);
        let by_scans = cut_segments(&steps_m, Some(SegmentLength::Scans(6)), Scales::Room, &mut planned);
        assert_eq!(by_scans.starts, [0, 6, 12, 18, 24, 30, 36, 42, 48]);
        let found = cut_segments(&steps_m, None, Scales::Room, &mut planned);
        assert_eq!((found.length, found.starts.len()), (Some(SegmentLength::Scans(4)), 13));
        assert_eq!(cut_segments(&[0.0; 5], None, Scales::Room, &mut frames(6)).length, None);
    }

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![3.0, 1.0]), 2.0);
        assert_eq!(median(vec![]), 0.0);
    }
}
