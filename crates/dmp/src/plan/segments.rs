use crate::frames::PlannedFrame;

/// How the drive is cut into segments, the same for all runs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Segments {
    /// Length asked for or found, metres; `None` where every scan is a segment of its own.
    pub(crate) length_m: Option<f64>,
    /// Whether a length was asked for.
    pub(crate) given: bool,
    /// Ordinals of the frames that begin a segment.
    pub(crate) starts: Vec<usize>,
    /// The median over the runs of the way from scan to scan, added up, metres.
    pub(crate) travel_m: f64,
}

/// Longest segment of the drive, metres, and how many a short drive is cut into.
const SEGMENT_M: f64 = 12.0;
const SEGMENTS: f64 = 16.0;
/// With fewer segments, or less travel, every scan is a segment of its own.
const MIN_SEGMENTS: usize = 8;
const MIN_TRAVEL_M: f64 = 1.0;

/// Cuts the drive by the way from frame to frame and gives every frame its segment.
pub(super) fn cut_segments(steps_m: &[f64], segment_m: Option<f64>, frames: &mut [PlannedFrame]) -> Segments {
    let travel_m: f64 = steps_m.iter().sum();
    let length_m = segment_m.unwrap_or(SEGMENT_M.min(travel_m / SEGMENTS));
    let mut starts = vec![0];
    if travel_m >= MIN_TRAVEL_M && length_m > 0.0 {
        let (mut along_m, mut cell) = (0.0, 0.0);
        for (ordinal, step_m) in (1..).zip(steps_m) {
            along_m += step_m;
            let here = (along_m / length_m).floor();
            if here > cell {
                starts.push(ordinal);
                cell = here;
            }
        }
    }
    let by_travel = starts.len() >= MIN_SEGMENTS;
    if !by_travel {
        starts = (0..frames.len()).collect();
    }
    let mut segment = -1;
    let mut next = starts.iter().peekable();
    for (ordinal, frame) in frames.iter_mut().enumerate() {
        if next.next_if(|&&start| start == ordinal).is_some() {
            segment += 1;
        }
        frame.segment = segment;
    }
    Segments { length_m: by_travel.then_some(length_m), given: segment_m.is_some(), starts, travel_m }
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
        let segments = cut_segments(&[1.0; 400], None, &mut planned);
        assert_eq!((segments.length_m, segments.starts.len()), (Some(12.0), 34));
        assert_eq!((planned[11].segment, planned[12].segment, planned[400].segment), (0, 1, 33));
    }

    #[test]
    fn a_short_way_gives_sixteen_segments_and_a_stand_none() {
        let mut planned = frames(129);
        assert_eq!(cut_segments(&[0.25; 128], None, &mut planned).length_m, Some(2.0));
        assert_eq!(planned[128].segment, 16);
        let standing = cut_segments(&[0.001; 128], None, &mut planned);
        assert_eq!(standing.length_m, None);
        assert!(planned.iter().enumerate().all(|(k, frame)| frame.segment == k as i32));
    }

    #[test]
    fn scans_further_apart_than_a_segment_are_neighbours_still() {
        let mut planned = frames(21);
        cut_segments(&[30.0; 20], None, &mut planned);
        assert!(planned.iter().enumerate().all(|(k, frame)| frame.segment == k as i32));
    }

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![3.0, 1.0]), 2.0);
        assert_eq!(median(vec![]), 0.0);
    }
}
