//! Rooms, their images, their surfaces and walks through them.

use std::collections::HashMap;

use dmp_sensor::{Distortion, PinholeCamera, Trajectory, Vector3};
use rayon::ThreadPoolBuilder;

use super::noise::{measured, sigma_m};
use super::plan::Plan;
use super::view::Seen;
use super::*;
use crate::ate_rmse_m;
use crate::error::SimError;
use crate::parts::shape::Shape;
use crate::random::Random;

/// The default camera with images of another width.
fn camera(width: u32) -> PinholeCamera {
    let scale = f64::from(width) / 640.0;
    let size = [width, width * 3 / 4];
    let centre = size.map(|px| (f64::from(px) - 1.0) / 2.0);
    PinholeCamera::new(size, [525.0 * scale; 2], centre, Distortion::NONE).unwrap()
}

fn room(seed: u64) -> Room {
    Room::new(RoomOptions { seed, ..RoomOptions::default() }).unwrap()
}

fn recording(room: &Room, width: u32, change: impl FnOnce(&mut DepthRecordingOptions)) -> DepthRecording<'_> {
    let mut options =
        DepthRecordingOptions { seed: room.options.seed, ..DepthRecordingOptions::new(camera(width)) };
    change(&mut options);
    DepthRecording::new(room, options).unwrap()
}

#[test]
fn images_show_what_single_rays_meet() {
    for seed in 0..6 {
        let room = room(seed);
        assert!((90..320).contains(&room.solids()), "{}", room.solids());
        let recording = recording(&room, 80, |_| ());
        let truth = recording.truth().unwrap();
        for pose in truth.poses().iter().step_by(97) {
            for (pixel, seen) in recording.seen(pose).into_iter().enumerate() {
                let [x, y] = camera(80).bearings().slopes(pixel);
                let bearing = Vector3::new(x, y, 1.0);
                // From within, every ray meets a surface.
                let hit = room.cast(pose.translation.vector, pose.rotation * bearing.normalize()).unwrap();
                let depth_m = hit.range_m / bearing.norm();
                assert!((seen.depth_m / depth_m - 1.0).abs() < 1e-9, "{seed} {pixel}: {seen:?} {hit:?}");
                let cos = -hit.normal.dot(&(pose.rotation * bearing.normalize()));
                assert!((seen.cos_incidence - cos).abs() < 1e-9 && cos > 0.0, "{seen:?} {cos}");
            }
        }
    }
}

#[test]
fn noise_has_the_deviation_of_the_model() {
    for (depth_m, cos) in [(1.0, 1.0), (2.0, 1.0), (4.0, 1.0), (1.5, 0.4)] {
        let seen = vec![Seen { depth_m, cos_incidence: cos, lost: 0.1 }; 320 * 240];
        let depths_m = measured(&seen, &camera(320), 3, 7);
        let valid: Vec<f64> = depths_m.into_iter().filter(|z| *z > 0.0).collect();
        let share = valid.len() as f64 / seen.len() as f64;
        assert!((0.75..0.93).contains(&share), "{share}");
        let mean = valid.iter().sum::<f64>() / valid.len() as f64;
        let variance = valid.iter().map(|z| (z - mean) * (z - mean)).sum::<f64>() / valid.len() as f64;
        let expected = sigma_m(depth_m, cos);
        assert!(
            (variance.sqrt() / expected - 1.0).abs() < 0.15,
            "{depth_m} m: {} for {expected}",
            variance.sqrt()
        );
        assert!((mean - depth_m).abs() < 0.1 * expected, "{mean}");
    }
    assert!((sigma_m(2.0, 1.0) - (0.0012 + 0.0019 * 2.56)).abs() < 1e-12);
    assert!(sigma_m(2.0, 0.2) > 1.5 * sigma_m(2.0, 1.0));
}

#[test]
fn nothing_is_measured_too_near_too_far_at_a_slant_and_in_the_projectors_shadow() {
    let valid = |of: &dyn Fn(usize) -> Seen| -> Vec<bool> {
        let seen: Vec<Seen> = (0..640 * 4).map(|pixel| of(pixel % 640)).collect();
        measured(&seen, &camera(640), 1, 1).chunks(640).next().unwrap().iter().map(|z| *z > 0.0).collect()
    };
    let at = |depth_m: f64, cos_incidence: f64| Seen { depth_m, cos_incidence, lost: 0.0 };
    for none in [at(0.44, 1.0), at(7.01, 1.0), at(2.0, 0.17), Seen::NOTHING] {
        assert!(valid(&|_| none).into_iter().all(|valid| !valid), "{none:?}");
    }
    // A post at 1 m before a wall at 3 m: its shadow is as wide as the disparities differ, 39.4 − 13.1 pixels, and
    // lies to its right. Beside edges pixels look to the other side, too.
    let valid = valid(&|column| at(if (200..300).contains(&column) { 1.0 } else { 3.0 }, 1.0));
    let share = |columns: std::ops::Range<usize>| {
        let count = columns.len() as f64;
        columns.filter(|column| valid[*column]).count() as f64 / count
    };
    assert!(share(20..195) > 0.99 && share(205..295) > 0.99 && share(330..640) > 0.99);
    assert!(share(303..324) < 0.05, "{}", share(303..324));
}

#[test]
fn the_same_seed_gives_the_same_bits_for_any_threads() {
    let room = room(2);
    let recording = recording(&room, 80, |options| options.images = 40);
    let all = |threads| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| recording.map_images(|image| image).collect::<Vec<_>>())
    };
    let images = all(1);
    assert_eq!(images, all(3));
    assert_eq!(images.len(), 40);
    assert!(images.windows(2).all(|pair| pair[0].stamp_ns < pair[1].stamp_ns));
    assert_eq!(images[17], recording.image(17));
    assert_ne!(images[17].units, images[18].units);
}

/// Distance of a place from a solid, metres.
fn distance_m(shape: &Shape, place: Vector3<f64>) -> f64 {
    match *shape {
        Shape::Box { centre, half, cos_yaw, sin_yaw } => {
            let v = place - centre;
            let into = Vector3::new(cos_yaw * v.x + sin_yaw * v.y, cos_yaw * v.y - sin_yaw * v.x, v.z);
            Vector3::from_fn(|k, _| (into[k].abs() - half[k]).max(0.0)).norm()
        }
        Shape::Cylinder { foot, radius_m, height_m } => {
            let v = place - foot;
            let beside = (libm::hypot(v.x, v.y) - radius_m).max(0.0);
            libm::hypot(beside, (-v.z).max(v.z - height_m).max(0.0))
        }
        Shape::Ellipsoid { centre, half } => (place - centre).norm() - half.max(),
    }
}

fn travel_m(run: &Trajectory) -> f64 {
    run.poses().windows(2).map(|pair| (pair[1].translation.vector - pair[0].translation.vector).norm()).sum()
}

#[test]
fn walks_keep_their_distance_and_come_back() {
    for seed in 0..16 {
        let room = room(seed);
        for revisit in [true, false] {
            let recording = recording(&room, 80, |options| options.revisit = revisit);
            let truth = recording.truth().unwrap();
            let poses = truth.poses();
            for place in poses.iter().map(|pose| pose.translation.vector) {
                let least = room
                    .solids
                    .iter()
                    .map(|solid| distance_m(&solid.shape, place))
                    .fold(f64::INFINITY, f64::min);
                assert!(least > 0.4, "{seed}: {least} m");
            }
            let faster = poses.windows(2).map(|pair| pair[0].rotation.angle_to(&pair[1].rotation) * 30.0);
            let fastest = faster.fold(0.0, f64::max).to_degrees();
            assert!(fastest < 150.0, "{fastest} degrees per second");
            let (ends, travel_m) = (poses[0].inv_mul(&poses[599]), travel_m(&truth));
            let (apart_m, turned) = (ends.translation.vector.norm(), ends.rotation.angle().to_degrees());
            if revisit {
                assert!((13.0..26.0).contains(&travel_m), "{travel_m}");
                assert!(apart_m < 0.1 && turned < 5.0, "{apart_m} {turned}");
            } else {
                assert!(travel_m > 4.0 && apart_m > 1.0, "{travel_m} {apart_m}");
            }
        }
    }
}

/// Share of the pixels whose surface is seen in one stretch of the walk only: cells of 0.1 m, and stretches with
/// more than 4 s between them.
fn seen_once(recording: &DepthRecording) -> f64 {
    let bearings = recording.options().camera.bearings();
    let mut visits: HashMap<[i64; 3], (usize, usize, usize)> = HashMap::new();
    let mut all = 0;
    for index in (0..recording.len()).step_by(10) {
        let pose = recording.walk().world_from_camera_at(recording.stamp_ns(index));
        for (pixel, seen) in recording.seen(&pose).into_iter().enumerate() {
            let [x, y] = bearings.slopes(pixel);
            let point = pose * dmp_sensor::Point3::from(Vector3::new(x, y, 1.0) * seen.depth_m);
            let cell = [0, 1, 2].map(|k| libm::floor(point[k] / 0.1) as i64);
            let (last, stretches, pixels) = visits.entry(cell).or_insert((index, 1, 0));
            *stretches += usize::from(index - *last > 120);
            *last = index;
            *pixels += 1;
            all += 1;
        }
    }
    let once: usize = visits.values().filter(|(_, stretches, _)| *stretches == 1).map(|visit| visit.2).sum();
    once as f64 / f64::from(all)
}

#[test]
fn a_walk_sees_things_again_or_once() {
    for seed in 0..6 {
        let room = room(seed);
        let again = seen_once(&recording(&room, 80, |_| ()));
        let once = seen_once(&recording(&room, 80, |options| options.revisit = false));
        assert!(again < 0.2 && once > 0.7, "{seed}: {again} {once}");
    }
}

#[test]
fn estimates_are_worse_and_worse() {
    for seed in 0..8 {
        let room = room(seed);
        for revisit in [true, false] {
            let recording = recording(&room, 80, |options| options.revisit = revisit);
            let truth = recording.truth().unwrap();
            let estimates = room_estimates(&truth, seed).unwrap();
            let names = estimates.each_ref().map(|estimate| estimate.name);
            assert_eq!(names, ["good", "another", "odometry", "off", "false_loop"]);
            let ate_m = estimates.each_ref().map(|estimate| ate_rmse_m(&estimate.trajectory, &truth));
            assert!(ate_m.windows(2).all(|pair| pair[1] >= 1.5 * pair[0]), "{seed}: {ate_m:?}");
            for (ate_m, range) in
                ate_m.into_iter().zip([0.008..0.015, 0.02..0.03, 0.06..0.1, 0.25..0.35, 0.6..1.0])
            {
                assert!(range.contains(&ate_m), "{seed}: {ate_m}");
            }
            assert!(estimates.iter().all(|estimate| estimate.trajectory.stamps_ns() == truth.stamps_ns()));
            assert_eq!(room_estimates(&truth, seed).unwrap(), estimates);
            // Directions drift as well as places, smoothly apart from the jitter.
            let odometry = estimates[2].trajectory.poses();
            let turns = truth.poses().iter().zip(odometry).map(|(a, b)| a.rotation.angle_to(&b.rotation));
            let turned = turns.fold(0.0, f64::max).to_degrees();
            assert!((0.3..8.0).contains(&turned), "{turned}");
        }
    }
}

/// Where a ray meets a triangle (Möller & Trumbore).
fn meets(triangle: &[[f64; 3]; 3], origin: Vector3<f64>, direction: Vector3<f64>) -> Option<f64> {
    let [a, b, c] = triangle.map(Vector3::from);
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(&ac);
    let determinant = ab.dot(&p);
    // Only from outside.
    if determinant < 1e-14 {
        return None;
    }
    let t = origin - a;
    let (u, q) = (t.dot(&p) / determinant, t.cross(&ab));
    let v = direction.dot(&q) / determinant;
    let range_m = ac.dot(&q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && range_m > 0.0).then_some(range_m)
}

#[test]
fn triangles_are_the_surface_that_rays_meet() {
    for seed in 0..3 {
        let room = room(seed);
        let triangles = room.triangles();
        assert!(triangles.len() < 60_000, "{}", triangles.len());
        let walk =
            RoomWalk::new(&room, RoomWalkOptions { seed, duration_s: 20.0, start_ns: 0, revisit: true });
        let walk = walk.unwrap();
        let mut random = Random::new(9, &[seed]);
        let mut differing = 0;
        for n in 0..300 {
            let origin = walk.world_from_camera_at(n * 66_000_000).translation.vector;
            let direction = Vector3::from_fn(|_, _| random.normal()).normalize();
            let hit = room.cast(origin, direction).unwrap();
            let ranges = triangles.iter().filter_map(|triangle| meets(triangle, origin, direction));
            let range_m = ranges.fold(f64::INFINITY, f64::min);
            // Triangles lie 0.5 mm within what is round.
            let allowed_m = 5.1e-4 / -hit.normal.dot(&direction) + 1e-9;
            differing += usize::from((range_m - hit.range_m).abs() > allowed_m);
        }
        // Past the edge of something round, or between two triangles.
        assert!(differing <= 2, "{seed}: {differing}");
    }
}

#[test]
fn seeds_make_rooms_and_sizes_are_checked() {
    let looks = |seed| {
        let room = room(seed);
        (room.solids.len(), room.cast(Vector3::new(3.0, 2.2, 1.4), Vector3::x()).map(|hit| hit.range_m))
    };
    assert_eq!(looks(1), looks(1));
    assert_ne!(looks(1), looks(2));
    // Every kind of plan, among a few seeds.
    let kinds: Vec<_> =
        (0..12).map(|seed| Plan::new(&RoomOptions { seed, ..RoomOptions::default() }).block).collect();
    assert!(kinds.iter().any(|block| matches!(block, plan::Block::Corner(_))));
    assert!(kinds.iter().any(|block| matches!(block, plan::Block::Divider(_))));
    assert!(kinds.contains(&plan::Block::None));
    for size_m in [[4.9, 5.0, 2.5], [6.0, 4.4, 2.5], [6.0, 5.0, 9.0], [f64::NAN, 5.0, 2.5]] {
        assert!(matches!(Room::new(RoomOptions { seed: 1, size_m }), Err(SimError::OutOfRange { .. })));
    }
    let room = room(1);
    for change in [
        (|options| options.images = 1) as fn(&mut DepthRecordingOptions),
        |options| options.rate_hz = 0.0,
        |options| options.units_per_m = f64::NAN,
    ] {
        let mut options = DepthRecordingOptions::new(camera(80));
        change(&mut options);
        assert!(matches!(DepthRecording::new(&room, options), Err(SimError::OutOfRange { .. })));
    }
}
