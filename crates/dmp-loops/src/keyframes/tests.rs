//! Which keyframe a scan belongs to.

use std::ops::Range;

use dmp_log::{FrameInfo, LogError, LogSummary, ScanReader};

use super::*;
use crate::tests::chain;

/// A log of which only the stamps are known.
#[derive(Debug)]
struct Stamps(Vec<FrameInfo>);

impl ScanLog for Stamps {
    fn summary(&self) -> &LogSummary {
        unreachable!("stamps alone decide which scans belong to which keyframes")
    }

    fn frames(&self) -> &[FrameInfo] {
        &self.0
    }

    fn reader(&self) -> Result<Box<dyn ScanReader + '_>, LogError> {
        unreachable!("no scan is read")
    }

    fn groups(&self) -> Vec<Range<usize>> {
        unreachable!("no scan is read")
    }
}

fn log(stamps_ns: &[Option<i64>]) -> Stamps {
    Stamps(stamps_ns.iter().map(|&stamp_ns| FrameInfo { stamp_ns, returns: 1 }).collect())
}

fn graph(vertices: usize) -> PoseGraph {
    let poses: Vec<_> = (0..vertices).map(|k| Isometry3::translation(k as f64, 0.0, 0.0)).collect();
    chain(&poses, &PoseGraph::unit_information())
}

/// The nearest by looking at all; of two as near, the earlier.
fn nearest(stamps_ns: &[i64], stamp_ns: i64) -> usize {
    let far = |stamp: i64| (i128::from(stamp) - i128::from(stamp_ns)).abs();
    (0..stamps_ns.len()).min_by_key(|&index| far(stamps_ns[index])).unwrap()
}

#[test]
fn a_scan_belongs_to_the_keyframe_nearest_in_time() {
    let lists = [
        vec![10],
        vec![10, 20],
        vec![-7, 0, 1, 2, 9, 10, 40],
        vec![i64::MIN, -1, 0, i64::MAX],
        (0..50).map(|k| k * k - 100).collect(),
    ];
    for stamps_ns in lists {
        let keyframes = Keyframes::at(stamps_ns.clone(), stamps_ns.len()).unwrap();
        assert_eq!(keyframes.len(), stamps_ns.len());
        for stamp_ns in (-150..2600).chain([i64::MIN, i64::MIN + 1, i64::MAX - 1, i64::MAX]) {
            let found = keyframes.nearest(Some(stamp_ns), 0);
            assert_eq!(found, nearest(&stamps_ns, stamp_ns), "{stamp_ns} in {stamps_ns:?}");
        }
    }
    let keyframes = Keyframes::at(vec![10, 20, 40], 3).unwrap();
    let of = |stamp_ns| keyframes.nearest(Some(stamp_ns), 0);
    // Before the first, after the last, and exactly in the middle: the earlier one.
    assert_eq!([of(-5), of(90), of(15), of(16), of(30), of(31)], [0, 2, 0, 1, 1, 2]);
}

#[test]
fn without_times_every_scan_is_a_keyframe() {
    let stamps = [Some(5), Some(9), Some(14)];
    let keyframes = Keyframes::of(&graph(3), None, &log(&stamps), 0).unwrap();
    assert_eq!(keyframes, Keyframes::at(vec![5, 9, 14], 3).unwrap());
    // Stamps are looked up later by the offset, at the ends of time too.
    let keyframes = Keyframes::of(&graph(3), None, &log(&stamps), -100).unwrap();
    assert_eq!(keyframes, Keyframes::at(vec![-95, -91, -86], 3).unwrap());
    let late = [Some(5), Some(i64::MAX - 3)];
    let keyframes = Keyframes::of(&graph(2), None, &log(&late), 100).unwrap();
    assert_eq!(keyframes, Keyframes::at(vec![105, i64::MAX], 2).unwrap());
    // Where stamps say no order, the log's own is taken.
    for stamps in
        [[None; 3], [Some(5), None, Some(14)], [Some(5), Some(5), Some(14)], [Some(9), Some(5), None]]
    {
        let keyframes = Keyframes::of(&graph(3), None, &log(&stamps), 7).unwrap();
        assert_eq!((keyframes.len(), keyframes.nearest(stamps[2], 2)), (3, 2), "{stamps:?}");
        let run = keyframes.run("graph", graph(3).poses()).unwrap();
        assert_eq!((run.trajectory.stamps_ns(), run.trajectory.poses()), (None, graph(3).poses()));
    }
}

#[test]
fn times_are_those_of_the_trajectory_not_of_the_log() {
    let stamps = [Some(5), Some(9), Some(14), Some(20)];
    // Between scans; and scans may be as many as they like.
    let keyframes = Keyframes::of(&graph(2), Some(&[107, 116]), &log(&stamps), 100).unwrap();
    let of_scan = |k: usize| keyframes.nearest(stamps[k].map(|stamp_ns| stamp_ns + 100), k);
    assert_eq!([0, 1, 2, 3].map(of_scan), [0, 0, 1, 1]);
    let run = keyframes.run("graph", graph(2).poses()).unwrap();
    assert_eq!(run.trajectory.stamps_ns(), Some(&[107, 116][..]));
}

#[test]
fn what_does_not_belong_together_fails() {
    let stamps = log(&[Some(5), Some(9), Some(14)]);
    let of = |vertices: usize, times: Option<&[i64]>, log: &Stamps| {
        Keyframes::of(&graph(vertices), times, log, 0).unwrap_err()
    };
    assert!(matches!(of(2, None, &stamps), LoopError::WhichScans { scans: 3, vertices: 2 }));
    assert!(matches!(of(4, None, &log(&[None; 3])), LoopError::WhichScans { scans: 3, vertices: 4 }));
    for unstamped in [log(&[None; 2]), log(&[Some(1), None])] {
        assert!(matches!(of(2, Some(&[1, 2]), &unstamped), LoopError::NoStamps));
    }
    assert!(matches!(of(2, Some(&[1, 2, 3]), &stamps), LoopError::OtherCount { times: 3, vertices: 2 }));
    assert!(matches!(of(2, Some(&[]), &stamps), LoopError::OtherCount { times: 0, vertices: 2 }));
    for (times, pair) in [([1, 2, 2], (2, 2)), ([1, 8, 3], (8, 3))] {
        let LoopError::Backwards { before_ns, stamp_ns } = of(3, Some(&times), &stamps) else { panic!() };
        assert_eq!((before_ns, stamp_ns), pair);
    }
    assert!(matches!(Keyframes::at(Vec::new(), 0), Err(LoopError::OtherCount { times: 0, vertices: 0 })));
    let run = Keyframes::at(vec![1, 2], 2).unwrap().run("graph", graph(3).poses());
    assert!(matches!(run, Err(LoopError::OtherKeyframes { keyframes: 2, poses: 3 })));
}
