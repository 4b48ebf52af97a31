//! Trails of moving objects, kept out of the maps by the rays that pass through them: against counts made
//! ray by ray and surfel by surfel, with traffic and without, and what becomes of wrong runs.

use std::collections::BTreeMap;
use std::path::Path;

use dmp::{Config, Ego, EvaluateError, FrameOrder, MapSource, Report, Run, Verdict, evaluate, fuse_maps};
use dmp_sim::{LidarOptions, RecordingOptions, Route, SlamErrors};

use crate::common::{collapse, comparable, drift, noise, open, recorded, runs_of, score, write_mcap};
use crate::direct::{self, VOXEL_M};

fn street(seed: u64, scans: usize, rate_hz: f64, traffic: usize) -> RecordingOptions {
    let lidar = LidarOptions { azimuth_steps: 180, rate_hz, ..LidarOptions::with_beams(16) };
    RecordingOptions { seed, scans, route: Route::Loop, speed_m_s: 7.0, traffic, lidar }
}

fn with(free_space: bool) -> Config {
    Config { free_space, ..Config::default() }
}

#[test]
fn what_is_left_out_is_what_counting_ray_by_ray_says() {
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
    let segment_of = direct::segments_of(&report, scans.len());

    let rays: Vec<Vec<direct::Ray>> =
        runs.iter().map(|run| direct::rays(&scans, &direct::in_world(&report, run), &segment_of)).collect();
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
    let share = |run: usize| free[run].len() as f64 / surfels[run] as f64;
    let least = (0..runs.len()).map(share).fold(f64::INFINITY, f64::min);
    let voters: Vec<usize> = (0..runs.len()).filter(|&run| share(run) <= 2.0 * least).collect();
    let is_left_out =
        |k: &usize| voters.iter().all(|&run| free[run].binary_search(&rays[run][*k].voxel()).is_ok());
    let left_out: Vec<usize> = (0..rays[0].len()).filter(is_left_out).collect();

    let free_space = report.free_space.as_ref().unwrap();
    println!(
        "{surfels:?} surfels, {:?} contradicted, {} returns",
        free.iter().map(Vec::len).collect::<Vec<_>>(),
        left_out.len()
    );
    for (run, reported) in report.runs.iter().enumerate() {
        assert_eq!(reported.map.surfels_with_trails, Some(surfels[run] as u64));
        assert_eq!(reported.map.surfels_contradicted, Some(free[run].len() as u64), "{}", reported.name);
    }
    assert_eq!(free_space.votes, voters.iter().map(|&run| runs[run].name.clone()).collect::<Vec<_>>());
    assert_eq!(free_space.returns_left_out, left_out.len() as u64);
    assert!(left_out.len() > 100 && !voters.is_empty());
    let is_told = report.warnings.iter().any(|warning| warning.to_string().contains("says what a trail is"));
    assert_eq!(is_told, voters.len() == 1, "{voters:?}");

    // The maps hold the rest, and every return is scored.
    for (rays, reported) in rays.iter().zip(&report.runs) {
        let rest: Vec<direct::Ray> =
            (0..rays.len()).filter(|k| left_out.binary_search(k).is_err()).map(|k| rays[k]).collect();
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
        let (scans, truth) = recorded(&street(1, 100, 5.0, traffic));
        write_mcap(&path, &scans);
        let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2))]);
        let [off, on] = [false, true].map(|free_space| score(&path, &runs, &with(free_space)));
        let blocked = |report: &Report| report.runs[0].blocked_rate.unwrap();
        let left_out = on.free_space.as_ref().unwrap().returns_left_out as f64 / on.runs[0].returns as f64;
        println!(
            "{traffic} cars: blocked {:.3}, then {:.3}; {left_out:.4} left out",
            blocked(&off),
            blocked(&on)
        );
        assert_eq!((&off.free_space, &off.order), (&None, &on.order));
        assert_eq!(off.runs[0].returns, on.runs[0].returns);
        assert_eq!(off.inputs.dropped, on.inputs.dropped);
        if traffic == 0 {
            assert!(left_out < 0.01, "{left_out}");
        } else {
            assert!(blocked(&on) < 0.8 * blocked(&off) && left_out < 0.1, "{left_out}");
        }
    }
}

#[test]
fn threads_memory_and_order_leave_it_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let (scans, truth) = recorded(&street(2, 60, 5.0, 30));
    write_mcap(&path, &scans);
    let runs = runs_of(&truth, &[("noise", noise(0.05, 0.2)), ("drift", drift(1.0))]);
    let of = |threads: usize, memory_bytes: usize, order: FrameOrder| {
        let config = Config { threads, memory_bytes, order, ..with(true) };
        (comparable(&score(&path, &runs, &config)), threads)
    };
    let (reference, _) = of(1, usize::MAX / 2, FrameOrder::Log);
    assert!(
        reference["free_space"]["returns_left_out"].as_u64().unwrap() > 100,
        "{}",
        reference["free_space"]
    );
    for (threads, memory_bytes) in [(1, 40 << 20), (2, 64 << 20), (4, 48 << 20)] {
        for order in [FrameOrder::Log, FrameOrder::Shuffled(7)] {
            assert!(
                of(threads, memory_bytes, order).0 == reference,
                "{threads} threads, {memory_bytes} bytes"
            );
        }
    }
}

#[test]
fn given_maps_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let (scans, truth) = recorded(&street(2, 10, 5.0, 0));
    write_mcap(&path, &scans);
    let given = MapSource::Given(folder.path().join("survey.las"));
    let runs = [Run::new("fused", truth.clone()), Run { map: given, ..Run::new("given", truth) }];
    let error = evaluate(open(&path).as_ref(), &runs, &with(true), ()).unwrap_err();
    assert!(matches!(&error, EvaluateError::Setting { value, .. } if value.contains("`given`")), "{error}");
    assert!(error.is_usage());
}

#[test]
fn saved_maps_are_those_without_trails() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let (scans, truth) = recorded(&street(2, 60, 5.0, 30));
    write_mcap(&path, &scans);
    let config = Config { save_maps: Some(folder.path().to_owned()), ..with(true) };
    let runs = runs_of(&truth, &[]);
    let report = score(&path, &runs, &config);
    let saved = dmp_map::Store::open(&folder.path().join("truth.dmpmap")).unwrap();
    assert_eq!(saved.surfels(), report.runs[0].map.surfels);
    assert!(report.runs[0].map.surfels_with_trails.unwrap() > saved.surfels());
    assert!(report.warnings.iter().any(|warning| warning.to_string().contains("only `truth` says")));

    let only_fused = fuse_maps(open(&path).as_ref(), &runs, &with(true), ()).unwrap();
    assert!(only_fused.iter().map(|(_, map)| map.surfels()).eq([saved.surfels()]));
    let given = Run { map: MapSource::Given(folder.path().join("truth.dmpmap")), ..runs[0].clone() };
    let error = fuse_maps(open(&path).as_ref(), &[given], &with(true), ()).unwrap_err();
    assert!(error.is_usage(), "{error}");
}

/// Off and on.
#[derive(Default)]
struct Told {
    blocked: BTreeMap<usize, [f64; 2]>,
    r_cv_2_m2: BTreeMap<usize, [f64; 2]>,
    verdicts: [[Vec<String>; 4]; 2],
    left_out: f64,
}

fn tell(path: &Path, runs: &[Run], all: &[&str], told: &mut Told) {
    for (k, free_space) in [false, true].into_iter().enumerate() {
        let report = score(path, runs, &with(free_space));
        let place = |name: &str| all.iter().position(|other| *other == name).unwrap();
        for run in &report.runs {
            told.blocked.entry(place(&run.name)).or_default()[k] += run.blocked_rate.unwrap();
        }
        for pair in &report.pairs {
            let pair_name = format!("{}/{}", pair.a, pair.b);
            let better = |run: &String| usize::from(place(run) > place(&pair.a).min(place(&pair.b)));
            let kind = match &pair.verdict {
                Verdict::Undecided | Verdict::Same => 3,
                Verdict::Mixed { .. } => 2,
                Verdict::Better { run, .. } => better(run),
            };
            told.verdicts[k][kind].push(pair_name);
            let at_2 = pair.scales.iter().find(|scale| scale.scale_m == 2.0).unwrap();
            for (run, mean_m2) in [(&pair.a, at_2.mean_a_m2), (&pair.b, at_2.mean_b_m2)] {
                if pair.a == all[0] || pair.b == all[0] {
                    told.r_cv_2_m2.entry(place(run)).or_default()[k] += mean_m2.unwrap_or(0.0);
                }
            }
        }
        if let Some(free_space) = &report.free_space {
            told.left_out += free_space.returns_left_out as f64 / report.inputs.returns_used as f64;
        }
    }
}

#[test]
#[ignore = "takes minutes; its table is in docs/metric.md"]
fn wrong_runs_stay_wrong() {
    let seeds = 1..=3u64;
    let count = 3.0;
    let loose = SlamErrors { false_loop_m: Some(6.0), ..SlamErrors::default() };
    let ladder = [
        ("noise", noise(0.05, 0.2)),
        ("drift 0.3", drift(0.3)),
        ("drift 1", drift(1.0)),
        ("drift 3", drift(3.0)),
        ("false loop", loose),
        ("collapsed", collapse(0.3)),
    ];
    let all: Vec<&str> = std::iter::once("truth").chain(ladder.iter().map(|run| run.0)).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("street.mcap");
    let sets: [(&str, &[&str]); 4] = [
        ("all runs", &all),
        ("truth, drift 1, drift 3", &["truth", "drift 1", "drift 3"]),
        ("drift 1, drift 3", &["drift 1", "drift 3"]),
        ("drift 3 alone", &["drift 3"]),
    ];
    for traffic in [0, 40] {
        let mut of_sets: Vec<Told> = sets.iter().map(|_| Told::default()).collect();
        for seed in seeds.clone() {
            let (scans, truth) = recorded(&street(seed, 200, 4.0, traffic));
            write_mcap(&path, &scans);
            let of_seed = ladder.clone().map(|(name, errors)| (name, SlamErrors { seed, ..errors }));
            let runs = runs_of(&truth, &of_seed);
            for ((_, names), told) in sets.iter().zip(&mut of_sets) {
                let chosen: Vec<Run> =
                    runs.iter().filter(|run| names.contains(&run.name.as_str())).cloned().collect();
                tell(&path, &chosen, &all, told);
            }
        }
        for ((name, _), told) in sets.iter().zip(&of_sets) {
            println!(
                "{traffic} cars, {name}: {:.2} % of the returns in no map",
                100.0 * told.left_out / count
            );
            for (run, [off, on]) in &told.blocked {
                let near = told.r_cv_2_m2.get(run).map_or(String::new(), |[off, on]| {
                    let pairs = if *run == 0 { told.blocked.len() as f64 - 1.0 } else { 1.0 } * count;
                    format!(", R_cv(2) {:.3} then {:.3} m²", off / pairs, on / pairs)
                });
                println!("  {:10} blocked {:.3} then {:.3}{near}", all[*run], off / count, on / count);
            }
            for (when, kinds) in ["off", "on"].iter().zip(&told.verdicts) {
                let [right, other, mixed, undecided] = kinds.each_ref().map(Vec::len);
                if kinds.iter().any(|kind| !kind.is_empty()) {
                    println!(
                        "  {when:3} verdicts: {right} down the list, {other} up, {mixed} mixed, {undecided} undecided"
                    );
                }
            }
            for verdicts in &told.verdicts {
                assert!(!verdicts[1].iter().any(|pair| pair.contains("truth")), "truth was beaten");
            }
        }
    }
}
