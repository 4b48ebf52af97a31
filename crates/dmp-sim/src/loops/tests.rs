//! Pose graphs drift as they say, and loop candidates are what they say.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use dmp_lengths::Scales;
use dmp_sensor::{Isometry3, PoseGraph, Trajectory, Translation3, UnitQuaternion, Vector3};

use super::*;
use crate::{Drive, DriveOptions, Room, RoomOptions, RoomWalk, RoomWalkOptions, Route, Town, TownOptions};

/// 600 m in a town, of which it sees two places out of three again.
fn drive() -> Trajectory {
    let route = Route::TwoLaps;
    let options = DriveOptions { route, speed_m_s: 8.0, duration_s: 80.0, ..DriveOptions::default() };
    let blocks = route.blocks(640.0, TownOptions::default().block_m);
    let town = Town::new(TownOptions { blocks, ..TownOptions::default() }).unwrap();
    Drive::new(&town, options).unwrap().trajectory(20.0).unwrap()
}

/// A straight line of poses 0.25 m and 0.1 s apart.
fn line(count: usize) -> Trajectory {
    let pose = |k: usize| (k as i64 * 100_000_000, Isometry3::translation(0.25 * k as f64, 0.0, 0.0));
    Trajectory::stamped((0..count).map(pose).collect()).unwrap().trajectory
}

fn without_loops() -> LoopGraphOptions {
    LoopGraphOptions { true_loops: 0, false_loops: 0, near_loops: 0, ..LoopGraphOptions::default() }
}

/// Path length until each pose, metres.
fn travel_m(poses: &[Isometry3<f64>]) -> Vec<f64> {
    let mut travel_m = vec![0.0];
    for pair in poses.windows(2) {
        let step_m = (pair[1].translation.vector - pair[0].translation.vector).norm();
        travel_m.push(travel_m[travel_m.len() - 1] + step_m);
    }
    travel_m
}

#[test]
fn keyframes_are_poses_of_the_truth_a_spacing_apart() {
    let truth = drive();
    for spacing_m in [0.5, 1.0, 5.0] {
        let made = LoopGraph::new(&truth, &LoopGraphOptions { spacing_m, ..without_loops() }).unwrap();
        let stamps_ns = made.truth.stamps_ns().unwrap();
        assert_eq!(stamps_ns[0], truth.stamps_ns().unwrap()[0]);
        assert_eq!(made.graph.ids(), (0..stamps_ns.len() as i64).collect::<Vec<_>>());
        let indices: Vec<usize> =
            stamps_ns.iter().map(|ns| truth.stamps_ns().unwrap().binary_search(ns).unwrap()).collect();
        let travelled_m = travel_m(truth.poses());
        for (k, pair) in indices.windows(2).enumerate() {
            assert_eq!(made.truth.poses()[k + 1], truth.poses()[pair[1]]);
            // The first pose that is far enough.
            assert!(travelled_m[pair[1]] - travelled_m[pair[0]] >= spacing_m - 1e-9);
            assert!(travelled_m[pair[1] - 1] - travelled_m[pair[0]] < spacing_m);
        }
    }
    let all = LoopGraph::new(&truth, &LoopGraphOptions { spacing_m: 0.0, ..without_loops() }).unwrap();
    assert_eq!(all.truth, truth);
}

#[test]
fn keyframes_are_at_given_instants() {
    let truth = line(100);
    let instants_ns = Some(vec![150_000_000, 1_250_000_000, 150_000_000, 50_000_000, 9_900_000_000]);
    let options = LoopGraphOptions { instants_ns, spacing_m: 0.0, ..without_loops() };
    let made = LoopGraph::new(&truth, &options).unwrap();
    assert_eq!(made.truth.stamps_ns().unwrap(), [50_000_000, 150_000_000, 1_250_000_000, 9_900_000_000]);
    let places: Vec<f64> = made.truth.poses().iter().map(|pose| pose.translation.x).collect();
    let expected = [0.125, 0.375, 3.125, 24.75];
    assert!(places.iter().zip(expected).all(|(x, expected)| (x - expected).abs() < 1e-12), "{places:?}");
    // Of given instants, too, only those that are far enough apart.
    let fewer = LoopGraph::new(&truth, &LoopGraphOptions { spacing_m: 1.0, ..options.clone() }).unwrap();
    assert_eq!(fewer.truth.stamps_ns().unwrap(), [50_000_000, 1_250_000_000, 9_900_000_000]);
    let late = LoopGraphOptions { instants_ns: Some(vec![0, 10_000_000_000]), ..options.clone() };
    assert_eq!(LoopGraph::new(&truth, &late), Err(SimError::NoPose { stamp_ns: 10_000_000_000 }));
    let none = LoopGraphOptions { instants_ns: Some(vec![]), ..options };
    assert_eq!(LoopGraph::new(&truth, &none), Err(SimError::NoInstants));
}

#[test]
fn the_graph_is_its_odometry_summed_up_and_in_one_part() {
    let truth = drive();
    let LoopGraph { graph, truth, .. } = LoopGraph::new(&truth, &LoopGraphOptions::default()).unwrap();
    assert!(graph.check_connected(&[]).is_ok() && graph.fixed().is_empty());
    assert_eq!(graph.edges().len() + 1, graph.ids().len());
    assert_eq!(graph.poses()[0], truth.poses()[0]);
    for (k, edge) in graph.edges().iter().enumerate() {
        assert_eq!((edge.from, edge.to), (k as i64, k as i64 + 1));
        let off = (graph.poses()[k] * edge.from_from_to).inv_mul(&graph.poses()[k + 1]);
        assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-7);
    }
    // Some metres of drift, not some tens of them, and smooth.
    let errors = graph.poses().iter().zip(truth.poses());
    let errors: Vec<f64> =
        errors.map(|(a, b)| (a.translation.vector - b.translation.vector).norm()).collect();
    let largest_m = errors.iter().copied().fold(0.0, f64::max);
    assert!((1.0..20.0).contains(&largest_m), "{largest_m}");
    assert!(errors.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.2));
}

#[test]
fn steps_err_as_their_information_says_and_by_the_bias() {
    let truth = line(16_000);
    for spacing_m in [1.0, 4.0] {
        let bias = 0.002;
        let options = LoopGraphOptions { spacing_m, yaw_bias_rad_per_m: bias, ..without_loops() };
        let LoopGraph { graph, truth, .. } = LoopGraph::new(&truth, &options).unwrap();
        let mut squares = [0.0; 6];
        let mut yaw = 0.0;
        for (edge, pair) in graph.edges().iter().zip(truth.poses().windows(2)) {
            let off = pair[0].inv_mul(&pair[1]).inv_mul(&edge.from_from_to);
            yaw += off.rotation.scaled_axis().z;
            // As g2o counts: the vector part of the quaternion, without the bias.
            let unbiased = Vector3::z() * (-bias * spacing_m);
            let turn = (UnitQuaternion::from_scaled_axis(unbiased) * off.rotation).imag();
            for (k, x) in off.translation.vector.iter().chain(turn.iter()).enumerate() {
                squares[k] += x * x * edge.information[(k, k)];
            }
        }
        let count = graph.edges().len() as f64;
        for (k, square) in squares.into_iter().enumerate() {
            assert!((square / count - 1.0).abs() < 0.15, "{spacing_m} {k}: {}", square / count);
        }
        assert!((yaw / count / (bias * spacing_m) - 1.0).abs() < 0.05, "{}", yaw / count);
        let sigma_m = 0.02 * spacing_m.sqrt();
        assert!((graph.edges()[7].information[(0, 0)] * sigma_m * sigma_m - 1.0).abs() < 1e-6);
    }
    // Without noise the vertices are true, and the edges are edges still.
    let exact = LoopGraphOptions {
        step_sigma_m: 0.0,
        step_sigma_rad: 0.0,
        yaw_bias_rad_per_m: 0.0,
        ..without_loops()
    };
    let LoopGraph { graph, truth, .. } = LoopGraph::new(&truth, &exact).unwrap();
    let last = graph.ids().len() - 1;
    assert!((graph.poses()[last].translation.vector - truth.poses()[last].translation.vector).norm() < 1e-6);
}

/// Checks the error of a candidate, and that its ends are far enough apart along the path.
fn checked(made: &LoopGraph, candidate: &SimulatedLoop) {
    let SimulatedLoop { edge, kind } = candidate;
    let poses = made.truth.poses();
    let (from, to) = (edge.from as usize, edge.to as usize);
    let travelled_m = travel_m(poses);
    assert!(travelled_m[to] - travelled_m[from] > 99.0, "{from} {to}");
    let truly = poses[from].inv_mul(&poses[to]);
    let apart_m = truly.translation.vector.norm();
    let off_m = (edge.from_from_to.translation.vector - truly.translation.vector).norm();
    let off_rad = (truly.rotation.inverse() * edge.from_from_to.rotation).angle();
    let noise_rad = 1.2_f64.to_radians();
    match kind {
        LoopKind::True => assert!(apart_m <= 8.0 && off_m < 0.3 && off_rad < noise_rad, "{apart_m} {off_m}"),
        LoopKind::Near => {
            assert!(
                apart_m <= 8.0 && (3.0..10.0).contains(&off_m) && off_rad < noise_rad,
                "{apart_m} {off_m}"
            );
        }
        LoopKind::False => {
            let shift = edge.from_from_to.translation.vector;
            assert!(apart_m > 40.0 && shift.xy().norm() <= 2.0 && shift.z.abs() < 0.4, "{apart_m} {shift}");
            let turn = edge.from_from_to.rotation.angle();
            assert!(turn.min(PI - turn) <= 3.2_f64.to_radians(), "{turn}");
        }
    }
}

#[test]
fn candidates_are_what_they_are_said_to_be() {
    let truth = drive();
    let (mut looks_back, mut along, mut aside) = (0, 0.0, 0.0);
    for seed in 0..20 {
        let made = LoopGraph::new(&truth, &LoopGraphOptions { seed, ..LoopGraphOptions::default() }).unwrap();
        let of = |kind| made.candidates.iter().filter(move |candidate| candidate.kind == kind);
        let counts = [LoopKind::True, LoopKind::False, LoopKind::Near].map(|kind| of(kind).count());
        assert_eq!(counts, [10, 10, 6]);
        made.candidates.iter().for_each(|candidate| checked(&made, candidate));
        let pairs: BTreeSet<_> = made.candidates.iter().map(|c| (c.edge.from, c.edge.to)).collect();
        assert_eq!(pairs.len(), 26);
        // 0.1 m and 0.5°, as half of the angle.
        let half_rad = 0.25_f64.to_radians();
        let diagonal = [100.0, 100.0, 100.0, half_rad.powi(-2), half_rad.powi(-2), half_rad.powi(-2)];
        for candidate in &made.candidates {
            assert_eq!(made.graph.check_edge(&candidate.edge), Ok(()));
            let claimed = candidate.edge.information.diagonal();
            assert!(
                claimed
                    .iter()
                    .zip(diagonal)
                    .all(|(claimed, expected)| (claimed / expected - 1.0).abs() < 1e-12)
            );
        }
        looks_back += of(LoopKind::False).filter(|c| c.edge.from_from_to.rotation.angle() > 1.5).count();
        for candidate in of(LoopKind::Near) {
            let (from, to) = (candidate.edge.from as usize, candidate.edge.to as usize);
            let truly = made.truth.poses()[from].inv_mul(&made.truth.poses()[to]);
            let off = candidate.edge.from_from_to.translation.vector - truly.translation.vector;
            along += off.x * off.x;
            aside += off.y * off.y;
        }
        // Spread: in each third of what is seen again, a true loop or a near one.
        let mut later: Vec<i64> =
            of(LoopKind::True).chain(of(LoopKind::Near)).map(|candidate| candidate.edge.to).collect();
        later.sort_unstable();
        assert!(later.windows(2).all(|pair| pair[0] < pair[1] && pair[1] - pair[0] < 60), "{later:?}");
        // The order does not reveal the labels.
        assert!(made.candidates[..13].iter().any(|c| c.kind.is_true()));
        assert!(made.candidates[13..].iter().any(|c| c.kind.is_true()));
    }
    assert!((60..140).contains(&looks_back), "{looks_back} of 200");
    assert!(along > 4.0 * aside, "{along} {aside}");
}

#[test]
fn the_other_lane_is_the_same_place_and_looks_back() {
    // Out, round, and back.
    let radius_m = 3.5;
    let pose = |k: usize| {
        let (travelled_m, turn_m) = (k as f64 * 0.25, PI * radius_m);
        let (x, y, yaw) = if travelled_m < 200.0 {
            (travelled_m, 0.0, 0.0)
        } else if travelled_m < 200.0 + turn_m {
            let angle = (travelled_m - 200.0) / radius_m;
            (200.0 + radius_m * libm::sin(angle), radius_m * (1.0 - libm::cos(angle)), angle)
        } else {
            (400.0 + turn_m - travelled_m, 2.0 * radius_m, PI)
        };
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw);
        (k as i64 * 50_000_000, Isometry3::from_parts(Translation3::new(x, y, 0.0), turn))
    };
    let truth = Trajectory::stamped((0..1600).map(pose).collect()).unwrap().trajectory;
    // The lanes are 7 m apart.
    let made = LoopGraph::new(&truth, &LoopGraphOptions { near_loops: 2, ..LoopGraphOptions::default() });
    for candidate in &made.as_ref().unwrap().candidates {
        checked(made.as_ref().unwrap(), candidate);
    }
    let back = made.unwrap().candidates.into_iter().filter(|c| c.kind.is_true());
    assert!(back.into_iter().all(|c| c.edge.from_from_to.rotation.angle() > 3.0));
}

#[test]
fn a_walk_through_a_room_has_loops_of_its_own_lengths() {
    let noise_rad = 1.2_f64.to_radians();
    for seed in 0..8 {
        let room = Room::new(RoomOptions { seed, ..RoomOptions::default() }).unwrap();
        let walk = RoomWalkOptions { seed, duration_s: 20.0, start_ns: 0, revisit: true };
        let walk = RoomWalk::new(&room, walk).unwrap();
        let pose = |k: i64| (k * 33_333_333, walk.world_from_camera_at(k * 33_333_333));
        let truth = Trajectory::stamped((0..600).map(pose).collect()).unwrap().trajectory;
        let options = LoopGraphOptions { seed, ..LoopGraphOptions::on_scales(Scales::Room) };
        let made = LoopGraph::new(&truth, &options).unwrap();
        let poses = made.truth.poses();
        // Every 0.2 m or 15°, whichever comes first.
        assert!((70..300).contains(&poses.len()), "{}", poses.len());
        let travelled_m = travel_m(poses);
        for (k, pair) in poses.windows(2).enumerate() {
            let turn = pair[0].rotation.angle_to(&pair[1].rotation).to_degrees();
            assert!(turn < 20.0 && travelled_m[k + 1] - travelled_m[k] < 0.26, "{turn}");
        }
        let drift = (made.graph.poses()[poses.len() - 1].translation.vector
            - poses[poses.len() - 1].translation.vector)
            .norm();
        assert!((0.02..2.0).contains(&drift), "{drift} m");
        let of = |kind| made.candidates.iter().filter(move |candidate| candidate.kind == kind).count();
        assert_eq!([LoopKind::True, LoopKind::False, LoopKind::Near].map(of), [10, 10, 6]);
        for SimulatedLoop { edge, kind } in &made.candidates {
            let (from, to) = (edge.from as usize, edge.to as usize);
            assert!(travelled_m[to] - travelled_m[from] > 4.5, "{from} {to}");
            let truly = poses[from].inv_mul(&poses[to]);
            let (apart_m, turned) = (truly.translation.vector.norm(), truly.rotation.angle().to_degrees());
            let off_m = (edge.from_from_to.translation.vector - truly.translation.vector).norm();
            let off_rad = truly.rotation.angle_to(&edge.from_from_to.rotation);
            if *kind == LoopKind::False {
                assert!(apart_m > 2.2 || turned > 90.0, "{apart_m} {turned}");
                let shift = edge.from_from_to.translation.vector;
                // A camera's own plane is that of x and z.
                assert!(shift.xz().norm() <= 0.2 && shift.y.abs() < 0.04, "{shift}");
                assert!(edge.from_from_to.rotation.angle() <= 3.2_f64.to_radians());
            } else {
                assert!(apart_m <= 0.8 && turned <= 30.0 && off_rad < noise_rad, "{apart_m} {turned}");
                let range = if *kind == LoopKind::True { 0.0..0.03 } else { 0.15..0.6 };
                assert!(range.contains(&off_m), "{off_m}");
            }
        }
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let straight = line(2000);
    let of_drive = Scales::Drive.lengths().simulated_loops.loops;
    let error = LoopGraph::new(&straight, &LoopGraphOptions::default()).unwrap_err();
    assert_eq!(error, SimError::TooFewRevisits { asked: 16, found: 0, lengths: of_drive });
    let only_false = LoopGraphOptions { false_loops: 3, ..without_loops() };
    assert_eq!(LoopGraph::new(&straight, &only_false).unwrap().candidates.len(), 3);
    // 75 m are too short for places with 100 m between them, and a circle of 30 m across has none 40 m apart.
    let error = LoopGraph::new(&line(300), &only_false).unwrap_err();
    assert_eq!(error, SimError::TooFewPlaces { asked: 3, found: 0, lengths: of_drive });
    let round = |k: usize| {
        let angle = TAU * k as f64 / 100.0;
        let place = Isometry3::translation(15.0 * libm::cos(angle), 15.0 * libm::sin(angle), 0.0);
        (k as i64 * 100_000_000, place)
    };
    let circle = Trajectory::stamped((0..300).map(round).collect()).unwrap().trajectory;
    let error = LoopGraph::new(&circle, &LoopGraphOptions::default()).unwrap_err();
    assert_eq!(error, SimError::TooFewPlaces { asked: 10, found: 0, lengths: of_drive });
    let many = LoopGraphOptions { true_loops: 100_000, ..LoopGraphOptions::default() };
    assert!(matches!(LoopGraph::new(&circle, &many), Err(SimError::TooFewRevisits { asked: 100_006, .. })));

    let still = Trajectory::unstamped(vec![Isometry3::identity(); 5]).unwrap();
    assert_eq!(LoopGraph::new(&still, &without_loops()), Err(SimError::NoStamps));
    for options in [
        LoopGraphOptions { spacing_m: f64::NAN, ..without_loops() },
        LoopGraphOptions { spacing_m: -1.0, ..without_loops() },
        LoopGraphOptions { step_sigma_m: f64::INFINITY, ..without_loops() },
        LoopGraphOptions { step_sigma_rad: -0.1, ..without_loops() },
        LoopGraphOptions { yaw_bias_rad_per_m: f64::NAN, ..without_loops() },
    ] {
        let error = LoopGraph::new(&straight, &options);
        assert!(matches!(error, Err(SimError::OutOfRange { .. })), "{options:?}");
    }
    // One pose is a graph, of one vertex.
    let made = LoopGraph::new(&line(1), &without_loops()).unwrap();
    assert_eq!((made.graph.ids(), made.candidates.len()), (&[0][..], 0));
    assert!(PoseGraph::check_connected(&made.graph, &[]).is_ok());
}
