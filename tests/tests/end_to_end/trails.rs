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

fn with(free_space: bool) -> Config {
    Config { free_space, ..plain() }
}

#[test]
#[ignore = "nightly: every ray with every surfel, of three runs"]
fn the_excluded_returns_are_those_of_counting_ray_by_ray() {
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
    let rays_of = |run: &Run| {
        let segment_of = direct::segments_of(&report, run, scans.len());
        direct::rays(&scans, &direct::in_world(&report, run), &segment_of)
    };
    let rays: Vec<Vec<direct::Ray>> = runs.iter().map(rays_of).collect();
    // For each run: all surfels, and the voxels of those that rays contradict.
    let mut surfels = Vec::new();
    let mut free: Vec<Vec<[i64; 3]>> = Vec::new();
    for rays in &rays {
        let discs = direct::surfels(rays);
        let contradicted = |disc: &&direct::Disc| {
            let (mut through, mut on) = (0, 0);
            for ray in rays {
                match ray.crossing(disc) {
                    Some(t) if (t - ray.z).abs() <= 0.5 => on += 1,
                    Some(t) if ray.depth(disc, t) > 0.5 && ray.is_independent_of(disc, 1) => through += 1,
                    _ => {}
                }
            }
            through >= 4 && through > on
        };
        free.push(discs.iter().filter(contradicted).map(|disc| disc.voxel).collect());
        surfels.push(discs.len());
    }
    let excluded: Vec<Vec<usize>> = rays
        .iter()
        .zip(&free)
        .map(|(rays, free)| {
            (0..rays.len()).filter(|&k| free.binary_search(&rays[k].voxel()).is_ok()).collect()
        })
        .collect();
    for (run, reported) in report.runs.iter().enumerate() {
        assert_eq!(reported.map.surfels_with_trails, Some(surfels[run] as u64));
        assert_eq!(reported.map.surfels_contradicted, Some(free[run].len() as u64), "{}", reported.name);
        assert_eq!(reported.map.returns_left_out, Some(excluded[run].len() as u64), "{}", reported.name);
        assert!(excluded[run].len() > 100);
    }

    // The maps hold the rest, and every return is scored.
    for ((rays, excluded), reported) in rays.iter().zip(&excluded).zip(&report.runs) {
        let rest: Vec<direct::Ray> =
            (0..rays.len()).filter(|k| excluded.binary_search(k).is_err()).map(|k| rays[k]).collect();
        let discs = direct::surfels(&rest);
        assert_eq!(reported.map.surfels, discs.len() as u64, "{}", reported.name);
        assert_eq!(reported.returns, rays.len() as u64);
        let sums = direct::scores(rays, &discs);
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
        let excluded = on.runs[0].map.returns_left_out.unwrap() as f64 / on.runs[0].returns as f64;
        assert_eq!((off.runs[0].map.returns_left_out, &off.order), (None, &on.order));
        assert_eq!((off.runs[0].returns, &off.inputs.dropped), (on.runs[0].returns, &on.inputs.dropped));
        if traffic == 0 {
            assert!(excluded < 0.01, "{excluded}");
        } else {
            assert!(blocked(&on) < 0.8 * blocked(&off) && excluded < 0.1, "{excluded}");
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
    let excluded = reference["runs"][0]["returns_left_out"].as_u64().unwrap();
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
