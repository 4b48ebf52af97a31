//! Residuals and their derivatives in the maps of a drive and of a room, against central differences.
//!
//! The oracle moves the pose, casts again, and where the surfel is still the same computes the residual from its plane, step by
//! step with matrices. Where the surfel is another one, there is no derivative: those returns are counted.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use dmp_cast::{CastSettings, Caster, Held, Hit, HoldBuffers, HoldSettings, Points, PosedScans};
use dmp_map::{Durability, FuseBuffers, Lattice, MapFuser, Origin, Store};
use dmp_sensor::{Distortion, Isometry3, PinholeCamera, Plane, Point3, ResidualKind, Vector3, moved_by};
use dmp_sim::{
    DepthRecording, DepthRecordingOptions, LidarOptions, Recording, RecordingOptions, Room, RoomOptions,
    Route, Sweep,
};

/// Steps of central differences: rotations in rad, translations in m, time in s, scale.
const STEP: f64 = 3e-6;
/// Largest difference from them, as a part of the derivative.
const TOLERANCE: f64 = 1e-6;
/// Derivatives below this are no larger than their rounding, m.
const LEAST: f64 = 0.1;

/// Scans, the pose of each, and the map that they make.
struct Scene {
    points: Vec<[f64; 3]>,
    ends: Vec<usize>,
    poses: Vec<Isometry3<f64>>,
    map: Store,
}

fn scene(scans: Vec<(Vec<[f64; 3]>, Isometry3<f64>)>, voxel_m: f64) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let fuser = MapFuser::new(Lattice::new(voxel_m).unwrap(), usize::MAX, folder.path()).unwrap();
    let (mut points, mut ends, mut poses) = (Vec::new(), Vec::new(), Vec::new());
    for (number, (scan, pose)) in scans.into_iter().enumerate() {
        let placed: Vec<[f64; 3]> = scan.iter().map(|&point| (pose * Point3::from(point)).into()).collect();
        fuser.add(&placed, Some(number as i32), &mut FuseBuffers::default()).unwrap();
        points.extend(scan);
        ends.push(points.len());
        poses.push(pose);
    }
    let path = folder.path().join("map");
    fuser.finish(&path, &Origin::of(""), Durability::Temporary, &|_, _| ()).unwrap();
    Scene { points, ends, poses, map: Store::open(&path).unwrap() }
}

/// A drive through a town, each scan at one instant.
fn drive(scans: usize) -> Scene {
    let lidar = LidarOptions { sweep: Sweep::Instant, ..LidarOptions::with_beams(16) };
    let options =
        RecordingOptions { seed: 3, scans, route: Route::OneWay, speed_m_s: 6.0, traffic: 0, lidar };
    let town = options.town().unwrap();
    let recording = Recording::new(&town, &options).unwrap();
    let poses = recording.pose_per_scan().unwrap().poses().to_vec();
    let points =
        recording.scans().map(|scan| scan.points_in_sensor_m.iter().map(|p| p.map(f64::from)).collect());
    scene(points.zip(poses).collect(), 0.2)
}

/// A walk through a room with a depth camera.
fn room(images: usize) -> Scene {
    let camera = PinholeCamera::new([160, 120], [140.0, 140.0], [79.5, 59.5], Distortion::NONE).unwrap();
    let room = Room::new(RoomOptions::default()).unwrap();
    let options = DepthRecordingOptions { images, rate_hz: 10.0, ..DepthRecordingOptions::new(camera) };
    let units_per_m = options.units_per_m;
    let recording = DepthRecording::new(&room, options).unwrap();
    let truth = recording.truth().unwrap();
    let bearings = recording.options().camera.bearings();
    let scan = |index: usize| {
        let units = recording.image(index).units;
        let seen = units.into_iter().enumerate().filter(|(_, units)| *units > 0);
        seen.map(|(pixel, units)| {
            bearings.point(pixel, (f64::from(units) / units_per_m) as f32).map(f64::from)
        })
        .collect()
    };
    scene((0..images).map(|index| (scan(index), truth.poses()[index])).collect(), 0.03)
}

/// The residual word for word: the pose by homogeneous matrices, the ray, its crossing.
fn residual_m(
    scans: &PosedScans<'_>,
    scan: usize,
    time_s: f64,
    point: [f64; 3],
    kind: ResidualKind,
    plane: &Plane,
) -> f64 {
    let twist = scans.twists_in_body.unwrap()[scan].map(|rate| rate * (time_s + scans.later_s));
    let turned =
        moved_by(&Vector3::new(twist[0], twist[1], twist[2]), &Vector3::new(twist[3], twist[4], twist[5]));
    let matrix = scans.world_from_body[scan].to_homogeneous()
        * turned.to_homogeneous()
        * scans.body_from_sensor.to_homogeneous();
    let place = matrix.transform_point(&(Point3::from(point) * scans.scale)).coords;
    let origin = matrix.transform_point(&Point3::origin()).coords;
    let range_m = (place - origin).norm();
    let way = (place - origin) / range_m;
    let cosine = plane.normal.dot(&way);
    match kind {
        ResidualKind::Range => range_m - plane.normal.dot(&(plane.mean_m - origin)) / cosine,
        ResidualKind::Plane => plane.normal.dot(&(place - plane.mean_m)) * cosine.signum(),
    }
}

/// The poses with a small motion behind each, of which only number `k` is not 0.
fn behind(poses: &[Isometry3<f64>], k: usize, size: f64) -> Vec<Isometry3<f64>> {
    let mut step = [Vector3::zeros(), Vector3::zeros()];
    step[k / 3][k % 3] = size;
    poses.iter().map(|pose| pose * moved_by(&step[0], &step[1])).collect()
}

/// What was found for some returns.
#[derive(Debug, Default)]
struct Found {
    returns: usize,
    /// Returns with a surfel, and those whose surfel stays at every step.
    held: usize,
    stay: usize,
    /// Those that a probe marks, and those that it should have marked.
    marked: usize,
    unmarked: usize,
    /// Largest error of a column as a part of its block, by kind.
    worst: [f64; 2],
}

/// Compares every `every`-th return.
fn compare(scene: &Scene, hit: Hit, every: usize) -> Found {
    let caster = Caster::new(&scene.map, CastSettings::default(), 1 << 30);
    let some: Vec<usize> = (0..scene.points.len()).step_by(every).collect();
    let points: Vec<[f64; 3]> = some.iter().map(|&k| scene.points[k]).collect();
    let ends: Vec<usize> = scene.ends.iter().map(|&end| some.partition_point(|&k| k < end)).collect();
    let times_s: Vec<f64> = (0..points.len()).map(|k| (k % 97) as f64 * 1e-3 - 0.05).collect();
    let twists: Vec<[f64; 6]> =
        (0..ends.len()).map(|k| [0.1, -0.2, 0.3 + k as f64 * 1e-3, 6.0, 0.4, -0.1]).collect();
    let segments: Vec<i32> = (0..ends.len() as i32).collect();
    // The surfaces are where the scans are, but these are posed a little off, on a body of another frame.
    let body_from_sensor = Isometry3::new(Vector3::new(0.4, -0.3, 1.1), Vector3::new(0.2, -0.1, 0.7));
    let off = Isometry3::new(Vector3::new(0.02, -0.01, 0.015), Vector3::new(1e-3, 2e-3, -1e-3));
    let world_from_body: Vec<_> =
        scene.poses.iter().map(|pose| pose * off * body_from_sensor.inverse()).collect();
    let scans = PosedScans {
        points: Points::Double(&points),
        ends: &ends,
        world_from_body: &world_from_body,
        body_from_sensor,
        twists_in_body: Some(&twists),
        times_s: Some(&times_s),
        later_s: 0.004,
        scale: 1.002,
        segments: Some(&segments),
    };
    assert!(scans.is_whole());
    let mut buffers = HoldBuffers::default();
    let mut hold = |scans: &PosedScans<'_>, probe_m: Option<f64>| {
        let mut held = Vec::new();
        let settings = HoldSettings { hit, probe_m };
        caster.hold(scans, 0..points.len(), settings, &mut held, &mut buffers).unwrap();
        held
    };
    let held = hold(&scans, Some(1e-3));
    let kinds = [ResidualKind::Range, ResidualKind::Plane];
    let mut rows: Vec<(usize, [[f64; 14]; 2])> = Vec::new();
    let mut number = 0;
    scans.each(0..points.len(), |scan, posed| {
        let row = |kind| match held[number] {
            Held::Surfel { plane, .. } => scans.row(&posed.against(kind, &plane).unwrap().1),
            _ => [f64::NAN; 14],
        };
        rows.push((scan, kinds.map(row)));
        number += 1;
    });
    let plane_of = |held: &Held| match *held {
        Held::Surfel { plane, .. } => Some(plane),
        _ => None,
    };
    let is_same =
        |a: &Plane, b: &Plane| (a.mean_m - b.mean_m).norm() < 1e-4 && (a.normal - b.normal).norm() < 1e-6;
    let mut stays: Vec<bool> = held.iter().map(|held| plane_of(held).is_some()).collect();
    let mut differences = vec![[[0.0; 14]; 2]; points.len()];
    for column in 0..14 {
        let sides = [-STEP, STEP].map(|by| {
            let bodies =
                if column < 6 { behind(&world_from_body, column, by) } else { world_from_body.clone() };
            let mut moved = PosedScans { world_from_body: &bodies, ..scans };
            match column {
                6..12 => moved.body_from_sensor = behind(&[body_from_sensor], column - 6, by)[0],
                12 => moved.later_s += by,
                13 => moved.scale += by,
                _ => {}
            }
            let again = hold(&moved, None);
            let mut residuals = vec![[f64::NAN; 2]; points.len()];
            for k in 0..points.len() {
                let Some(plane) = plane_of(&held[k]) else { continue };
                stays[k] &= plane_of(&again[k]).is_some_and(|other| is_same(&plane, &other));
                residuals[k] =
                    kinds.map(|kind| residual_m(&moved, rows[k].0, times_s[k], points[k], kind, &plane));
            }
            residuals
        });
        for (k, difference) in differences.iter_mut().enumerate() {
            for kind in 0..2 {
                difference[kind][column] = (sides[1][k][kind] - sides[0][k][kind]) / (2.0 * STEP);
            }
        }
    }
    let mut found = Found { returns: points.len(), ..Found::default() };
    for (k, held) in held.iter().enumerate() {
        found.held += usize::from(plane_of(held).is_some());
        found.stay += usize::from(stays[k]);
        let is_marked = matches!(held, Held::Surfel { changes: true, .. });
        found.marked += usize::from(is_marked);
        found.unmarked += usize::from(plane_of(held).is_some() && !stays[k] && !is_marked);
        if !stays[k] {
            continue;
        }
        for (kind, (row, expected)) in rows[k].1.iter().zip(&differences[k]).enumerate() {
            for block in [0..3, 3..6, 6..9, 9..12, 12..13, 13..14] {
                let size = expected[block.clone()].iter().fold(LEAST, |most, d| most.max(d.abs()));
                let error = block.map(|column| (row[column] - expected[column]).abs()).fold(0.0, f64::max);
                found.worst[kind] = found.worst[kind].max(error / size);
            }
        }
    }
    found
}

fn check(name: &str, scene: &Scene, returns: usize) {
    for hit in [Hit::First, Hit::Nearest, Hit::Independent] {
        let found = compare(scene, hit, (scene.points.len() / returns).max(1));
        println!("{name}, {hit:?}: {found:?}");
        assert!(found.returns >= returns && found.held > found.returns / 3, "{found:?}");
        // A few surfels end where a ray meets them.
        assert!(found.stay > found.held * 98 / 100 && found.marked < found.held / 2, "{found:?}");
        assert!(found.unmarked <= found.held / 1_000, "{found:?}");
        assert!(found.worst.iter().all(|&worst| worst <= TOLERANCE), "{name} {hit:?}: {found:?}");
    }
}

#[test]
fn derivatives_are_central_differences_where_the_surfel_stays() {
    check("drive", &drive(20), 3_000);
    check("room", &room(20), 3_000);
}

#[test]
#[ignore = "nightly: a hundred thousand returns of each"]
fn derivatives_of_many_returns_are_central_differences() {
    check("drive", &drive(60), 100_000);
    check("room", &room(60), 100_000);
}
