//! Cuts the path of a run into segments.

use dmp_reduce::Scales;
use dmp_report::SegmentLength;

use crate::runs::frame::PlannedFrame;

/// The segments of a run's path.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Segments {
    /// Length given or chosen; `None` where every scan is its own segment.
    pub length: Option<SegmentLength>,
    /// Whether a length was given.
    pub given: bool,
    /// Ordinals of the scans that begin a segment.
    pub starts: Vec<usize>,
    /// The path length, metres.
    pub travel_m: f64,
}

/// Number of segments of a short drive.
const SEGMENTS: f64 = 16.0;
/// With fewer segments, or less travel on a drive, every scan is its own segment.
const MIN_SEGMENTS: usize = 8;
const MIN_TRAVEL_M: f64 = 1.0;

impl Segments {
    /// For each of the scans its segment, from 0; `None` for those that are not `posed`.
    pub(crate) fn of_scans(&self, scans: usize, posed: &[usize]) -> Vec<Option<i32>> {
        let mut segment_of = vec![None; scans];
        let (mut segment, mut next) = (-1, self.starts.iter().peekable());
        for &ordinal in posed {
            if next.next_if(|&&start| start == ordinal).is_some() {
                segment += 1;
            }
            segment_of[ordinal] = Some(segment);
        }
        segment_of
    }
}

/// Cuts the path through the `posed` of some scans; `along_m` is the path length up to each of the scans.
pub(crate) fn cut_segments(
    frames: &[PlannedFrame],
    posed: &[usize],
    along_m: &[f64],
    asked: Option<SegmentLength>,
    scales: Scales,
) -> Segments {
    let travel_m = posed.last().map_or(0.0, |&last| along_m[last]);
    let length = asked.unwrap_or_else(|| match scales.lengths().segment_m {
        Some(longest_m) => SegmentLength::Metres(longest_m.min(travel_m / SEGMENTS)),
        None => SegmentLength::Scans((posed.len() as f64 / SEGMENTS).ceil() as u64),
    });
    let mut starts = match length {
        SegmentLength::Metres(m) if travel_m >= MIN_TRAVEL_M => starts_of(posed, along_m, m),
        SegmentLength::Metres(_) => posed.first().copied().into_iter().collect(),
        SegmentLength::Seconds(s) => starts_by_time(frames, posed, s),
        SegmentLength::Scans(scans) => posed.iter().copied().step_by(scans.max(1) as usize).collect(),
    };
    let is_cut = starts.len() >= MIN_SEGMENTS;
    if !is_cut {
        starts = posed.to_vec();
    }
    Segments { length: is_cut.then_some(length), given: asked.is_some(), starts, travel_m }
}

/// The scans with which segments of this length begin.
fn starts_of(posed: &[usize], along_m: &[f64], length_m: f64) -> Vec<usize> {
    let cell = |&ordinal: &usize| if length_m > 0.0 { (along_m[ordinal] / length_m).floor() } else { 0.0 };
    begins(posed, |pair| cell(&pair[0]) != cell(&pair[1]))
}

/// The same by stamps, in whole nanoseconds: a segment begins with the first scan of each non-empty interval. A log
/// without stamps has one segment.
fn starts_by_time(frames: &[PlannedFrame], posed: &[usize], length_s: f64) -> Vec<usize> {
    let length_ns = ((length_s * 1e9).round() as i64).max(1);
    let stamp_ns = |ordinal: usize| frames[ordinal].stamp_ns;
    let first_ns = posed.first().and_then(|&first| stamp_ns(first));
    let stretch = |ordinal: usize| Some(stamp_ns(ordinal)?.saturating_sub(first_ns?) / length_ns);
    begins(posed, |pair| stretch(pair[0]) != stretch(pair[1]))
}

/// The first, and each with which something begins after the one before.
fn begins(posed: &[usize], is_begun: impl Fn(&[usize]) -> bool) -> Vec<usize> {
    let later = posed.windows(2).filter(|pair| is_begun(pair)).map(|pair| pair[1]);
    posed.first().copied().into_iter().chain(later).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(count: usize) -> Vec<PlannedFrame> {
        (0..count).map(|frame| PlannedFrame { frame, number: frame, stamp_ns: None, returns: 1 }).collect()
    }

    /// Cuts a path with a pose for every scan, so far apart.
    fn cut(
        count: usize,
        step_m: f64,
        asked: Option<SegmentLength>,
        scales: Scales,
    ) -> (Segments, Vec<Option<i32>>) {
        let posed: Vec<usize> = (0..count).collect();
        let along_m: Vec<f64> = posed.iter().map(|&k| step_m * k as f64).collect();
        let segments = cut_segments(&frames(count), &posed, &along_m, asked, scales);
        let of_scans = segments.of_scans(count, &posed);
        (segments, of_scans)
    }

    #[test]
    fn a_drive_is_cut_every_twelve_metres() {
        let (segments, of_scans) = cut(401, 1.0, None, Scales::Drive);
        assert_eq!((segments.length, segments.starts.len()), (Some(SegmentLength::Metres(12.0)), 34));
        assert_eq!([11, 12, 400].map(|k: usize| of_scans[k]), [Some(0), Some(1), Some(33)]);
    }

    #[test]
    fn a_short_way_gives_sixteen_segments_and_a_stand_none() {
        let (segments, of_scans) = cut(129, 0.25, None, Scales::Drive);
        assert_eq!(segments.length, Some(SegmentLength::Metres(2.0)));
        assert_eq!(of_scans[128], Some(16));
        let (standing, of_scans) = cut(129, 0.001, None, Scales::Drive);
        assert_eq!(standing.length, None);
        assert!((0..129).zip(of_scans).all(|(k, segment)| segment == Some(k)));
    }

    #[test]
    fn scans_further_apart_than_a_segment_are_neighbours_still() {
        let (_, of_scans) = cut(21, 30.0, None, Scales::Drive);
        assert!((0..21).zip(of_scans).all(|(k, segment)| segment == Some(k)));
    }

    #[test]
    fn scans_without_a_pose_are_in_no_segment() {
        let posed: Vec<usize> = (0..60).filter(|k| !(20..30).contains(k)).collect();
        let along_m: Vec<f64> = (0..60).map(f64::from).collect();
        let asked = Some(SegmentLength::Metres(5.0));
        let segments = cut_segments(&frames(60), &posed, &along_m, asked, Scales::Drive);
        assert_eq!(segments.starts, [0, 5, 10, 15, 30, 35, 40, 45, 50, 55]);
        let of_scans = segments.of_scans(60, &posed);
        assert_eq!([19, 20, 29, 30].map(|k: usize| of_scans[k]), [Some(3), None, None, Some(4)]);
    }

    #[test]
    fn segments_may_be_asked_for_in_seconds_and_scans() {
        // Ten scans a second, none at 2.0 to 2.9 s.
        let stamps_ns = (0..60).filter(|k| !(20..30).contains(k)).map(|k| k * 100_000_000);
        let mut planned = frames(50);
        planned.iter_mut().zip(stamps_ns).for_each(|(frame, ns)| frame.stamp_ns = Some(ns));
        let posed: Vec<usize> = (0..50).collect();
        let starts = |asked| cut_segments(&planned, &posed, &[0.0; 50], Some(asked), Scales::Room).starts;
        assert_eq!(starts(SegmentLength::Seconds(0.5)), [0, 5, 10, 15, 20, 25, 30, 35, 40, 45]);
        // The cells of 0.7 s that have a scan.
        assert_eq!(starts(SegmentLength::Seconds(0.7)), [0, 7, 14, 20, 25, 32, 39, 46]);
        assert_eq!(starts(SegmentLength::Scans(6)), [0, 6, 12, 18, 24, 30, 36, 42, 48]);
        let (found, _) = cut(50, 0.0, None, Scales::Room);
        assert_eq!((found.length, found.starts.len()), (Some(SegmentLength::Scans(4)), 13));
        assert_eq!(cut(6, 0.0, None, Scales::Room).0.length, None);
    }
}
