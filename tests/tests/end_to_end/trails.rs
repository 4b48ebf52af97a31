//! Trails of moving objects, kept out of the maps by the rays that pass through them: against counts made
//! ray by ray and surfel by surfel, with traffic and without, and what becomes of wrong runs.

use dmp::{Config, Ego, EvaluateError, FrameOrder, MapSource, Report, Run, evaluate, fuse_maps};
use dmp_sensor::{Scan, Trajectory};
use dmp_sim::{LidarOptions, RecordingOptions, Route};

use crate::common::{comparable, drift, noise, open, plain, recorded, runs_of, score, write_mcap};
use crate::direct::{self, VOXEL_M};

fn street(scans: usize, traffic: usize) -> (Vec<Scan>, Trajectory) {
    let lidar = LidarOptions { azimuth_steps: 120, rate_hz: 5.0, ..LidarOptions::with_beams(16) };
    recorded(&RecordingOptions { seed: 2, scans, route: Route::Loop, speed_m_s: 7.0, traffic, lidar })
}

/// The share of the first run's surfels that are excluded.
fn share_out(report: &Report) -> f64 {
    let map = &report.runs[0].map;
    map.surfels_contradicted.unwrap() as f64 / map.surfels_with_trails.unwrap() as f64
}

fn with(free_space: bool) -> Config {
    Config { free_space, ..plain() }
}

#[test]
#[ignore = "nightly: every ray with every surfel, of three runs"]
fn the_excluded_surfels_are_those_of_counting_ray_by_ray() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let lidar = LidarOptions { azimuth_steps: 60, rate_hz: 2.0, ..LidarOptions::with_beams(16) };
    let options =
        RecordingOptions { seed: 4, scans: 110, route: Route::Loop, speed_m_s: 6.0, traffic: 40, lidar };
    let (scans, truth) = recorded(&options);
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.3)), ("drift", drift(2.0))]);
    let config = Config { voxel_m: Some(VOXEL_M), ego: Ego::None, ..with(true) };
    let report = score(&path, &runs, &config);
    // A hundred scans are followed.
    let followed: Vec<usize> = (0..100).map(|k| k * scans.len() / 100).collect();
    // The maps have every surfel but those that the rays contradict, and every return is scored.
    for (run, reported) in runs.iter().zip(&report.runs) {
        let (segment_of, in_world) =
            (direct::segments_of(&report, run, scans.len()), direct::in_world(&report, run));
        let rays = direct::rays(&scans, &in_world, &segment_of);
        let of_followed = |k: &usize| direct::rays(&scans[*k..=*k], &in_world, &segment_of[*k..=*k]);
        let rays_followed: Vec<direct::Ray> = followed.iter().flat_map(of_followed).collect();
        let discs = direct::surfels(&rays);
        let is_contradicted = |disc: &direct::Disc| {
            let (mut through, mut on) = (0, 0);
            for ray in &rays_followed {
                match ray.crossing(disc) {
                    Some(t) if (t - ray.z).abs() <= 0.5 => on += 1,
                    Some(t) if ray.depth(disc, t) > 0.5 => through += 1,
                    _ => {}
                }
            }
            through >= 4 && through > on
        };
        let all = discs.len();
        let rest: Vec<direct::Disc> = discs.into_iter().filter(|disc| !is_contradicted(disc)).collect();
        assert!(all - rest.len() > 30, "{}: {} of {all}", reported.name, rest.len());
        assert_eq!(reported.map.surfels_with_trails, Some(all as u64), "{}", reported.name);
        assert_eq!(reported.map.surfels_contradicted, Some((all - rest.len()) as u64), "{}", reported.name);
        assert_eq!(reported.map.surfels, rest.len() as u64, "{}", reported.name);
        assert_eq!(reported.returns, rays.len() as u64);
        let sums = direct::scores(&rays, &rest);
        let relative = (reported.dmp_sum_m2 / sums["DMP"] - 1.0).abs();
        assert!(relative < 1e-6, "{}: {} directly {}", reported.name, reported.dmp_sum_m2, sums["DMP"]);
        assert_eq!(reported.blocked_rate, Some(sums["blocked"] / rays.len() as f64));
    }
}

#[test]
fn traffic_no_longer_blocks_and_a_street_without_stays_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    for traffic in [0, 40] {
        let (scans, truth) = street(100, traffic);
        write_mcap(&path, &scans);
        let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2))]);
        let [off, on] = [false, true].map(|free_space| score(&path, &runs, &with(free_space)));
        let blocked = |report: &Report| report.runs[0].blocked_rate.unwrap();
        assert_eq!((off.runs[0].map.surfels_contradicted, &off.order), (None, &on.order));
        let excluded = share_out(&on);
        assert_eq!((off.runs[0].returns, &off.inputs.dropped), (on.runs[0].returns, &on.inputs.dropped));
        if traffic == 0 {
            assert!(excluded < 0.03, "{excluded}");
        } else {
            assert!(
                blocked(&on) < 0.7 * blocked(&off) && excluded < 0.2,
                "{excluded} {} {}",
                blocked(&on),
                blocked(&off)
            );
        }
    }
}

#[test]
fn threads_memory_and_order_change_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let (scans, truth) = street(60, 30);
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2)), ("drift", drift(1.0))]);
    let of = |threads: usize, memory_bytes: usize, order: FrameOrder| {
        comparable(&score(&path, &runs, &Config { threads, memory_bytes, order, ..with(true) }))
    };
    let reference = of(1, usize::MAX / 2, FrameOrder::Log);
    let excluded = reference["runs"][0]["surfels_contradicted"].as_u64().unwrap();
    assert!(excluded > 100, "{excluded}");
    for (threads, memory_bytes, order) in [(1, 40, FrameOrder::Shuffled(7)), (4, 48, FrameOrder::Log)] {
        assert!(of(threads, memory_bytes << 20, order) == reference, "{threads} threads, {memory_bytes} MiB");
    }
}

#[test]
fn saved_maps_are_those_without_trails_and_given_ones_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let (scans, truth) = street(60, 30);
    write_mcap(&path, &scans);
    let config = Config { save_maps: Some(folder.path().to_owned()), ..with(true) };
    let runs = runs_of(&truth, &[]);
    let report = score(&path, &runs, &config);
    let saved = dmp_map::Store::open(&folder.path().join("truth.dmpmap")).unwrap();
    assert_eq!(saved.surfels(), report.runs[0].map.surfels);
    assert!(report.runs[0].map.surfels_with_trails.unwrap() > saved.surfels());
    let only_fused = fuse_maps(open(&path).as_ref(), &runs, &with(true), ()).unwrap();
    assert!(only_fused.iter().map(|(_, map)| map.surfels()).eq([saved.surfels()]));

    let map = MapSource::Given(folder.path().join("truth.dmpmap"));
    let given = Run { map, ..Run::new("given", truth) };
    assert!(
        fuse_maps(open(&path).as_ref(), std::slice::from_ref(&given), &with(true), ())
            .unwrap_err()
            .is_usage()
    );
    let error = evaluate(open(&path).as_ref(), &[runs[0].clone(), given], &with(true), ()).unwrap_err();
    assert!(matches!(&error, EvaluateError::Setting { value, .. } if value.contains("`given`")), "{error}");
}
