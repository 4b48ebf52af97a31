//! What moves is left out of the maps: against counts made ray by ray and surfel by surfel, with traffic and without.

use std::collections::BTreeSet;

use dmp::{Config, Ego, FrameOrder, MapSource, Report, Run, fuse_maps};
use dmp_sensor::{Isometry3, Point3, Scan, Track, Trajectory, Translation3};
use dmp_sim::{LidarOptions, RecordingOptions, Route, SlamErrors};

use crate::common::{comparable, drift, noise, open, plain, recorded, runs_of, score, write_mcap};
use crate::direct::{self, VOXEL_M};

fn street(scans: usize, traffic: usize) -> (Vec<Scan>, Trajectory) {
    let lidar = LidarOptions { azimuth_steps: 120, rate_hz: 5.0, ..LidarOptions::with_beams(16) };
    recorded(&RecordingOptions { seed: 2, scans, route: Route::Loop, speed_m_s: 7.0, traffic, lidar })
}

/// The shares of the first run's surfels that are left out, and of its returns that are blocked.
fn shares(report: &Report) -> [f64; 2] {
    let run = &report.runs[0];
    [run.map.surfels_contradicted.unwrap() as f64 / run.map.surfels as f64, run.blocked_rate.unwrap()]
}

#[test]
#[ignore = "nightly: every ray with every surfel, of three runs"]
fn what_is_left_out_is_that_of_counting_ray_by_ray() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let lidar = LidarOptions { azimuth_steps: 60, rate_hz: 2.0, ..LidarOptions::with_beams(16) };
    let options =
        RecordingOptions { seed: 4, scans: 110, route: Route::Loop, speed_m_s: 6.0, traffic: 40, lidar };
    let (scans, truth) = recorded(&options);
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.3)), ("drift", drift(2.0))]);
    let config = Config { voxel_m: Some(VOXEL_M), ego: Ego::None, ..plain() };
    let report = score(&path, &runs, &config);
    // The maps have every surfel but those that the rays contradict, and no return that ends on these is scored.
    for (run, reported) in runs.iter().zip(&report.runs) {
        let (segment_of, in_world) =
            (direct::segments_of(&report, run, scans.len()), direct::in_world(&report, run));
        let mut rays = direct::rays(&scans, &in_world, &segment_of);
        let discs = direct::surfels(&rays);
        let all = discs.len();
        let (rest, left_out) = direct::without_what_moved((&report, run, &scans), discs);
        assert!(all - rest.len() > 10, "{}: {} of {all}", reported.name, rest.len());
        assert_eq!(reported.map.surfels, all as u64, "{}", reported.name);
        assert_eq!(reported.map.surfels_contradicted, Some((all - rest.len()) as u64), "{}", reported.name);
        assert_eq!(reported.returns + reported.returns_left_out, rays.len() as u64);
        rays.retain(|ray| !left_out.contains(&ray.voxel()));
        assert_eq!(reported.returns, rays.len() as u64);
        let sums = direct::scores(&rays, &rest, &BTreeSet::new());
        let relative = (reported.dmp_sum_m2 / sums["DMP"] - 1.0).abs();
        assert!(relative < 1e-6, "{}: {} directly {}", reported.name, reported.dmp_sum_m2, sums["DMP"]);
        assert_eq!(reported.blocked_rate, Some(sums["blocked"] / rays.len() as f64));
    }
}

#[test]
fn traffic_hardly_blocks_and_a_street_without_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let [quiet, busy] = [0, 40].map(|traffic| {
        let (scans, truth) = street(100, traffic);
        write_mcap(&path, &scans);
        shares(&score(&path, &runs_of(&truth, &[("noise", noise(0.05, 0.2))]), &plain()))
    });
    assert!(quiet[0] < 0.03, "{quiet:?}");
    assert!(busy[0] > 0.03 && busy[0] < 0.2 && busy[1] < quiet[1] + 0.1, "{quiet:?} {busy:?}");
}

#[test]
fn drift_and_false_loops_are_charged_in_traffic_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let (scans, truth) = street(160, 40);
    write_mcap(&path, &scans);
    let false_loop = SlamErrors { seed: 1, false_loop_m: Some(10.0), ..SlamErrors::default() };
    let report =
        score(&path, &runs_of(&truth, &[("drift", drift(3.0)), ("false loop", false_loop)]), &plain());
    for wrong in ["drift", "false loop"] {
        let verdict = report.verdict_between("truth", wrong).unwrap();
        assert_eq!(verdict.ahead(), Some("truth"), "{wrong}: {:?}", report.pair("truth", wrong));
    }
    let blocked = [0, 1, 2].map(|run| report.runs[run].blocked_rate.unwrap());
    assert!(blocked[1] > blocked[0] + 0.05 && blocked[2] > blocked[0] + 0.05, "{blocked:?}");
}

/// A box beside the street on the first visit only: both visits are right, and disagree. That stays in the score.
#[test]
fn what_parks_on_one_visit_and_not_on_the_other_is_charged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let (scans, truth) = street(220, 0);
    let track = Track::new(&truth, Isometry3::identity(), i64::MAX);
    let place = |scan: &Scan| track.world_from_sensor_at(scan.stamp_ns.unwrap()).unwrap();
    // Where the drive comes to a second time, and when that is.
    let near = |a: usize, b: usize| {
        (place(&scans[a]).translation.vector - place(&scans[b]).translation.vector).norm() < 3.0
    };
    let (first, second) = (0..100)
        .find_map(|a| (a + 80..scans.len()).find(|&b| near(a, b)).map(|b| (a, b)))
        .expect("the drive revisits");
    let parked = place(&scans[first]) * Translation3::new(0.0, 4.0, -0.8);
    let half_m = [2.2, 1.0, 0.9];
    let with_car = scans.iter().enumerate().map(|(number, scan)| {
        let mut scan = scan.clone();
        let Scan { stamp_ns, points_in_sensor_m, time_offsets_ns } = &mut scan;
        for (point, offset_ns) in points_in_sensor_m
            .iter_mut()
            .zip(time_offsets_ns)
            .filter(|_| number < usize::midpoint(first, second))
        {
            let sensor = track.world_from_sensor_at(stamp_ns.unwrap() + *offset_ns);
            if let Some(share) = sensor.and_then(|sensor| enters(&parked, half_m, &sensor, *point)) {
                *point = point.map(|c| c * share as f32);
            }
        }
        scan
    });
    let of = |scans: &[Scan]| {
        write_mcap(&path, scans);
        let report = score(&path, &runs_of(&truth, &[]), &plain());
        [shares(&report)[1], report.runs[0].r_cv_m2.at(2.0).unwrap()]
    };
    let ([blocked, r2_m2], [blocked_without, r2_without_m2]) =
        (of(&with_car.collect::<Vec<_>>()), of(&scans));
    assert!(
        blocked > blocked_without + 0.001 && r2_m2 > r2_without_m2,
        "{blocked} {blocked_without} {r2_m2} {r2_without_m2}"
    );
}

/// Which share of a ray lies in front of a box, if it goes into it.
fn enters(
    middle: &Isometry3<f64>,
    half_m: [f64; 3],
    sensor: &Isometry3<f64>,
    point: [f32; 3],
) -> Option<f64> {
    let in_box = middle.inverse() * sensor;
    let [from, to] = [Point3::origin(), Point3::from(point.map(f64::from))].map(|p| in_box * p);
    let (mut low, mut high) = (0.0f64, 1.0f64);
    for k in 0..3 {
        let [a, b] = [-half_m[k], half_m[k]].map(|side| (side - from[k]) / (to[k] - from[k]));
        (low, high) = (low.max(a.min(b)), high.min(a.max(b)));
    }
    (low > 0.0 && low < high).then_some(low)
}

#[test]
fn threads_memory_and_order_change_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let (scans, truth) = street(60, 30);
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2)), ("drift", drift(1.0))]);
    let of = |threads: usize, memory_bytes: usize, order: FrameOrder| {
        comparable(&score(&path, &runs, &Config { threads, memory_bytes, order, ..plain() }))
    };
    let reference = of(1, usize::MAX / 2, FrameOrder::Log);
    let excluded = reference["runs"][0]["surfels_contradicted"].as_u64().unwrap();
    assert!(excluded > 100, "{excluded}");
    for (threads, memory_bytes, order) in [(1, 40, FrameOrder::Shuffled(7)), (4, 48, FrameOrder::Log)] {
        assert!(of(threads, memory_bytes << 20, order) == reference, "{threads} threads, {memory_bytes} MiB");
    }
}

#[test]
fn saved_maps_lack_what_moved_and_given_ones_stay_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let (scans, truth) = street(60, 30);
    write_mcap(&path, &scans);
    let config = Config { save_maps: Some(folder.path().to_owned()), ..plain() };
    let runs = runs_of(&truth, &[]);
    let report = score(&path, &runs, &config);
    let saved = dmp_map::Store::open(&folder.path().join("truth.dmpmap")).unwrap();
    let map = &report.runs[0].map;
    assert!(saved.surfels() < map.surfels);
    assert_eq!(saved.surfels(), map.surfels - map.surfels_contradicted.unwrap());
    let only_fused = fuse_maps(open(&path).as_ref(), &runs, &plain(), ()).unwrap();
    assert!(only_fused.iter().map(|(_, map)| map.surfels()).eq([saved.surfels()]));

    let given = MapSource::Given(folder.path().join("truth.dmpmap"));
    let both = [runs[0].clone(), Run { map: given, ..Run::new("given", truth) }];
    let report = score(&path, &both, &plain());
    assert_eq!(report.runs[0].map, *map);
    let given = &report.runs[1].map;
    assert_eq!((given.surfels, given.surfels_contradicted), (saved.surfels(), None));
}
