//! Chains of keyframes, and which constraints agree, on known paths.

use std::f64::consts::TAU;
use std::ops::Range;

use dmp::{PosedLog, Run};
use dmp_log::ScanLog as _;
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph, Trajectory, UnitQuaternion, Vector3};

use super::acceptance::rows;
use super::chain::{Chain, StepError};
use super::consistent::{DIRECTIONS, consistent, misfit};
use crate::OptimiseOptions;
use crate::tests::DRIVE;

/// Poses before the first scan of the log and after the last one.
const OUTSIDE: usize = 8;
/// From scan to scan, metres: three and a third to a keyframe.
const STEP_M: f64 = 0.3;
/// Scans of a lap.
const LAP: usize = 100;

/// Where scan `k` is, round and round in a circle.
fn true_pose(k: i64) -> Isometry3<f64> {
    let (angle_rad, radius_m) = (k as f64 * TAU / LAP as f64, STEP_M * LAP as f64 / TAU);
    let place = Vector3::new(radius_m * angle_rad.sin(), radius_m * (1.0 - angle_rad.cos()), 0.0);
    Isometry3::from_parts(place.into(), UnitQuaternion::from_euler_angles(0.0, 0.0, angle_rad))
}

/// The same numbers everywhere, from −1 to 1.
fn number(k: usize) -> f64 {
    let part = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((part ^ (part >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// A run with poses for all scans of the log and some more, whose steps have this error over a metre.
fn run(error: StepError) -> Run {
    let stamps_ns: Vec<i64> = DRIVE.log.frames().iter().map(|frame| frame.stamp_ns.unwrap()).collect();
    let period_ns = stamps_ns[1] - stamps_ns[0];
    let poses = -(OUTSIDE as i64)..(stamps_ns.len() + OUTSIDE) as i64;
    // Evenly spread numbers from −1 to 1 scatter by the root of a third.
    let root = (3.0 * STEP_M).sqrt();
    let mut at = true_pose(poses.start);
    let lines = poses.map(|k| {
        let [x, y, z, roll, pitch, yaw] = std::array::from_fn(|axis| number((k + 100) as usize * 6 + axis));
        let (place_m, turn_rad) = (root * error.place_m, root * error.turn_rad);
        let step = true_pose(k - 1).inv_mul(&true_pose(k));
        let off = Isometry3::new(Vector3::new(x, y, z) * place_m, Vector3::new(roll, pitch, yaw) * turn_rad);
        at = at * step * off;
        (stamps_ns[0] + k * period_ns, at)
    });
    Run::new("run", Trajectory::stamped(lines.collect()).unwrap().trajectory)
}

fn chain_of(run: &Run) -> Chain {
    let posed = PosedLog::new(&DRIVE.log, run, &DRIVE.config, ()).unwrap();
    Chain::new(&posed).unwrap()
}

const NO_ERROR: StepError = StepError { place_m: 0.0, turn_rad: 0.0 };
const ERROR: StepError = StepError { place_m: 0.03, turn_rad: 0.0015 };

fn edge(from: i64, to: i64) -> PoseEdge {
    let from_from_to = true_pose(from).inv_mul(&true_pose(to));
    PoseEdge { from, to, from_from_to, information: PoseGraph::information_of(0.01, 0.001) }
}

/// What is true between scans a lap apart, as edges between keyframes.
fn true_edges(chain: &Chain, scans: Range<i64>) -> Vec<PoseEdge> {
    scans.step_by(10).filter_map(|k| chain.between_keyframes(&edge(k, k + LAP as i64))).collect()
}

fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation)
}

#[test]
fn keyframes_are_a_metre_apart_and_their_steps_are_those_of_the_run() {
    let run = run(ERROR);
    let chain = chain_of(&run);
    let graph = chain.graph(StepError::default()).unwrap();
    let scans = DRIVE.log.frames().len();
    assert_eq!(chain.of_scan().len(), scans);
    let keyframes = graph.ids().len();
    let wanted = scans as f64 * STEP_M;
    assert!((keyframes as f64 - wanted).abs() <= 0.1 * wanted, "{keyframes} of {wanted} m");
    let pose = |id: i64| run.trajectory.poses()[OUTSIDE + id as usize];
    for (k, edge) in graph.edges().iter().enumerate() {
        assert_eq!([edge.from, edge.to], [graph.ids()[k], graph.ids()[k + 1]]);
        let step = pose(edge.from).inv_mul(&pose(edge.to));
        assert!(apart(&step, &edge.from_from_to) < 1e-9, "{edge:?}");
        // Errors grow with the root of the path length.
        let way_m = chain.along_m(edge.to) - chain.along_m(edge.from);
        let expected = PoseGraph::information_of(0.01 * way_m.sqrt(), 0.0005 * way_m.sqrt());
        assert!((edge.information - expected).amax() <= 1e-9 * expected.amax(), "{edge:?}");
    }
    assert!(chain.along_m(scans as i64 + 5).is_nan());
}

#[test]
fn poses_between_keyframes_and_beyond_them_are_taken_along() {
    let run = run(ERROR);
    let chain = chain_of(&run);
    let poses = chain.poses();
    let taken = |moved: &[Isometry3<f64>]| chain.taken_along(&run.trajectory, moved).unwrap();
    let given = run.trajectory.poses();
    // Where no keyframe moves, nothing does; where all move as one, all poses do.
    let as_one = Isometry3::new(Vector3::new(3.0, -2.0, 0.5), Vector3::new(0.02, -0.01, 0.3));
    for motion in [Isometry3::identity(), as_one] {
        let moved: Vec<_> = poses.iter().map(|pose| motion * pose).collect();
        let taken = taken(&moved);
        assert_eq!(taken.stamps_ns(), run.trajectory.stamps_ns());
        let off = taken.poses().iter().zip(given).map(|(taken, pose)| apart(taken, &(motion * pose)));
        assert!(off.fold(0.0, f64::max) < 1e-9);
    }
    // Where one moves, poses between its neighbours do, less and less away from it.
    let one = poses.len() / 2;
    let lift = Isometry3::translation(0.0, 0.0, 0.1);
    let moved: Vec<_> =
        (0..).zip(&poses).map(|(k, pose)| if k == one { lift * pose } else { *pose }).collect();
    let graph = chain.graph(StepError::default()).unwrap();
    let [before, at, after] = [one - 1, one, one + 1].map(|k| OUTSIDE + graph.ids()[k] as usize);
    for (k, (taken, pose)) in taken(&moved).poses().iter().zip(given).enumerate() {
        let lifted_m = taken.translation.z - pose.translation.z;
        let share = |from: usize| (k as f64 - from as f64) / (at as f64 - from as f64);
        let expected_m = match k {
            _ if k <= before || k >= after => 0.0,
            _ if k <= at => 0.1 * share(before),
            _ => 0.1 * share(after),
        };
        assert!((lifted_m - expected_m).abs() < 1e-9, "pose {k}: {lifted_m} m, not {expected_m} m");
    }
}

#[test]
fn what_is_true_of_scans_is_true_of_their_keyframes() {
    let chain = chain_of(&run(NO_ERROR));
    let edges = true_edges(&chain, 0..100);
    assert!(edges.len() == 10, "{}", edges.len());
    for edge in &edges {
        let expected = true_pose(edge.from).inv_mul(&true_pose(edge.to));
        assert!(apart(&edge.from_from_to, &expected) < 1e-9, "{edge:?}");
    }
    // Of one keyframe, and of one and the next, nothing is learned; nor of a scan that is not there.
    assert_eq!(
        [(10, 11), (10, 14), (10, 999)].map(|(a, b)| chain.between_keyframes(&edge(a, b))),
        [const { None }; 3]
    );
    assert!(misfit(&chain, &edges, &OptimiseOptions::default()).unwrap() < 1e-6);
}

#[test]
fn constraints_that_contradict_the_others_are_left_out() {
    let options = OptimiseOptions::default();
    let chain = chain_of(&run(ERROR));
    let mut edges = true_edges(&chain, 0..140);
    assert!(misfit(&chain, &edges, &options).unwrap() > DIRECTIONS * edges.len() as f64);
    // All that are true agree, and the steps err by about as much as they were made to.
    let found = consistent(&chain, &edges, StepError::default(), &options).unwrap();
    assert_eq!(found.kept, (0..edges.len()).collect::<Vec<_>>());
    let ratio = found.error.place_m / ERROR.place_m;
    assert!((0.4..2.5).contains(&ratio), "{ratio}");
    // Two in fourteen are off by metres.
    for (k, off_m) in [(3, 4.0), (9, -2.5)] {
        edges[k].from_from_to.translation.vector.x += off_m;
    }
    let found = consistent(&chain, &edges, StepError::default(), &options).unwrap();
    let expected: Vec<usize> = (0..edges.len()).filter(|k| ![3, 9].contains(k)).collect();
    assert_eq!(found.kept, expected);
    let of_none = consistent(&chain, &[], StepError::default(), &options).unwrap();
    assert_eq!((of_none.kept.len(), of_none.error), (0, StepError::default()));
}

#[test]
fn rows_are_passages_of_one_place_and_another() {
    let chain = chain_of(&run(NO_ERROR));
    let edges = true_edges(&chain, 0..140);
    let ends = |row: &Vec<PoseEdge>| (row.first().unwrap().from, row.last().unwrap().from, row.len());
    // Scans 10 apart are 3 m apart: with segments of 1.2 m they go on, with segments of 0.5 m they do not.
    assert_eq!(rows(&chain, edges.clone(), 1.2).iter().map(Vec::len).collect::<Vec<_>>(), [edges.len()]);
    assert_eq!(rows(&chain, edges.clone(), 0.5).len(), edges.len());
    // A gap begins another row.
    let apart: Vec<PoseEdge> = edges[..4].iter().chain(&edges[9..]).cloned().collect();
    let [first, second] = &rows(&chain, apart, 1.2)[..] else { panic!("two rows") };
    assert_eq!((ends(first).2, ends(second).2), (4, edges.len() - 9));
    assert!(ends(first).1 < ends(second).0);
}
