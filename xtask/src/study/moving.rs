//! Streets with moving things, whose truth is known for each return: what of them is left out of the map, what of the rest
//! is lost, and what the scores say.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;
use dmp::{Config, DriftPairs, Report, Run, Verdict, evaluate};
use dmp_log::MemoryLog;
use dmp_map::{Durability, FuseBuffers, MapFuser, Store, Surfel};
use dmp_sensor::{Isometry3, Point3, Scan, Track, Trajectory};
use dmp_sim::{Companion, LidarOptions, Noise, Recording, RecordingOptions, Route, SlamErrors};

/// Cars in the streets of the row with traffic.
const TRAFFIC: usize = 40;

/// Streets with moving things: what is left out of the map of the true trajectory, and what the scores say
#[derive(Debug, Args)]
pub(crate) struct MovingArgs {
    /// Towns and drives, by seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    seeds: u64,
    /// Folder for the maps
    #[arg(long, value_name = "FOLDER", default_value = "target/study/moving")]
    work: PathBuf,
}

/// The numbers of a street.
#[derive(Default, Clone, Copy)]
struct Street {
    /// Returns of things that move and of others; of each those whose voxel has no surfel that its returns would make.
    returns: [u64; 2],
    left_out: [u64; 2],
    blocked: f64,
    coverage: f64,
    /// The true trajectory's.
    r_cv_10_m: f64,
    r_cv_2_m: f64,
    /// That of the drifted one, over the true one's.
    drift: f64,
    right: u32,
    wrong: u32,
}

pub(super) fn run(arguments: &MovingArgs) -> anyhow::Result<()> {
    let alone = |companion| (0, vec![companion]);
    let streets: [(&str, (usize, Vec<Companion>)); 11] = [
        ("nothing", (0, Vec::new())),
        ("40 cars in the streets", (TRAFFIC, Vec::new())),
        ("a car 8 m ahead", alone(Companion::Ahead(8.0))),
        ("a car 15 m ahead", alone(Companion::Ahead(15.0))),
        ("a car 25 m ahead", alone(Companion::Ahead(25.0))),
        ("one that stops and goes", alone(Companion::StopAndGo)),
        ("overtaking cars", alone(Companion::Overtaking)),
        ("a row of oncoming cars", alone(Companion::Oncoming)),
        ("a bus beside", alone(Companion::Bus)),
        ("a crowd", alone(Companion::Crowd)),
        (
            "car ahead, oncoming row, crowd",
            (0, vec![Companion::Ahead(15.0), Companion::Oncoming, Companion::Crowd]),
        ),
    ];
    println!(
        "| what moves | of the returns | kept out | others lost | blocked | coverage | R_cv(10), m | R_cv(2), m | drift / truth | pairs right, wrong |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    );
    for (name, (traffic, companions)) in streets {
        let mut sum = Street::default();
        for seed in 1..=arguments.seeds {
            let street =
                street(seed, traffic, &companions, &arguments.work).with_context(|| name.to_owned())?;
            sum.add(&street);
        }
        sum.print(name, arguments.seeds as f64);
    }
    Ok(())
}

impl Street {
    fn add(&mut self, other: &Self) {
        for k in 0..2 {
            self.returns[k] += other.returns[k];
            self.left_out[k] += other.left_out[k];
        }
        self.blocked += other.blocked;
        self.coverage += other.coverage;
        self.r_cv_10_m += other.r_cv_10_m;
        self.r_cv_2_m += other.r_cv_2_m;
        self.drift += other.drift;
        self.right += other.right;
        self.wrong += other.wrong;
    }

    fn print(&self, name: &str, seeds: f64) {
        let [moving, others] = self.returns;
        let share = |of: u64, all: u64| of as f64 / all.max(1) as f64;
        let kept_out =
            if moving == 0 { "–".to_owned() } else { format!("{:.3}", share(self.left_out[0], moving)) };
        println!(
            "| {name} | {:.3} | {kept_out} | {:.4} | {:.3} | {:.3} | {:.2} | {:.3} | {:.2} | {}, {} |",
            share(moving, moving + others),
            share(self.left_out[1], others),
            self.blocked / seeds,
            self.coverage / seeds,
            self.r_cv_10_m / seeds,
            self.r_cv_2_m / seeds,
            self.drift / seeds,
            self.right,
            self.wrong
        );
    }
}

/// Simulates a drive and scores the truth, the truth with noise, and with drift.
fn street(
    seed: u64,
    traffic: usize,
    companions: &[Companion],
    work: &std::path::Path,
) -> anyhow::Result<Street> {
    let lidar = LidarOptions { azimuth_steps: 450, ..LidarOptions::with_beams(16) };
    let options = RecordingOptions { seed, scans: 900, route: Route::Loop, speed_m_s: 6.0, traffic, lidar };
    let town = options.town()?;
    let recording = Recording::new(&town, &options)?.among(companions.to_vec());
    let truth = recording.drive().trajectory(20.0)?;
    let (scans, moving): (Vec<Scan>, Vec<Vec<bool>>) = recording.scans_with_truth().unzip();
    let noise = Noise { sigma_m: 0.03, sigma_rad: 0.1_f64.to_radians(), interval_ns: 100_000_000 };
    let noisy = SlamErrors { seed: 4, noise: Some(noise), ..SlamErrors::default() }.apply(&truth)?;
    let drifted = SlamErrors { seed: 3, drift_ate_m: Some(1.0), ..SlamErrors::default() }.apply(&truth)?;
    let runs = [Run::new("truth", truth.clone()), Run::new("noise", noisy), Run::new("drift", drifted)];
    let log = MemoryLog::new("street", scans.clone())?;
    let _ = std::fs::remove_dir_all(work);
    std::fs::create_dir_all(work)?;
    let config = Config { drift: DriftPairs::None, save_maps: Some(work.to_owned()), ..Config::default() };
    let report = evaluate(&log, &runs, &config, ())?;
    let map = Store::open(&work.join("truth.dmpmap"))?;
    let (returns, left_out) = counts(&map, &report, &truth, &scans, &moving)?;
    let root = |run: usize, k: usize| report.runs[run].r_cv_m2[k].unwrap_or(f64::NAN).sqrt();
    let said = ["noise", "drift"].map(|worse| match report.pair("truth", worse).map(|pair| &pair.verdict) {
        Some(Verdict::Better { run, .. }) => Some(run == "truth"),
        _ => None,
    });
    Ok(Street {
        returns,
        left_out,
        blocked: report.runs[0].blocked_rate.unwrap_or(f64::NAN),
        coverage: report.runs[0].coverage.unwrap_or(f64::NAN),
        r_cv_10_m: root(0, 0),
        r_cv_2_m: root(0, 1),
        drift: root(2, 1) / root(0, 1),
        right: said.iter().filter(|&&said| said == Some(true)).count() as u32,
        wrong: said.iter().filter(|&&said| said == Some(false)).count() as u32,
    })
}

/// Used returns of things that move and of others, and those of them in voxels whose surfel is not in the map.
fn counts(
    map: &Store,
    report: &Report,
    truth: &Trajectory,
    scans: &[Scan],
    moving: &[Vec<bool>],
) -> anyhow::Result<([u64; 2], [u64; 2])> {
    let voxel_m = report.config.voxel_m;
    let voxel_of = |place: [f64; 3]| place.map(|c| (c / voxel_m).floor() as i32);
    let all = MapFuser::new(map.lattice(), usize::MAX, &std::env::temp_dir())?;
    let world_from_own = map.own_from_world().inverse();
    let track = Track::new(truth, Isometry3::identity(), i64::MAX);
    let mut voxels: HashMap<[i32; 3], [u64; 2]> = HashMap::new();
    let mut points = Vec::new();
    for (scan, moving) in scans.iter().zip(moving) {
        points.clear();
        let start_ns = scan.stamp_ns.context("a simulated scan has a stamp")?;
        for ((point, offset_ns), &moves) in
            scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns).zip(moving)
        {
            let point = Point3::from(point.map(f64::from));
            let Some(pose) = track.world_from_sensor_at(start_ns + offset_ns) else { continue };
            if (report.config.min_range_m..=report.config.max_range_m).contains(&point.coords.norm()) {
                let place: [f64; 3] = (world_from_own * pose * point).into();
                points.push(place);
                let voxel = voxel_of(place);
                voxels.entry(voxel).or_default()[usize::from(!moves)] += 1;
            }
        }
        all.add(&points, None, &mut FuseBuffers::default())?;
    }
    let path = std::env::temp_dir().join(format!("dmp-study-{}.dmpmap", std::process::id()));
    all.finish(&path, map.origin(), Durability::Temporary, &|_, _| ())?;
    let surfels_of = |map: &Store| -> anyhow::Result<HashSet<[i32; 3]>> {
        let mut surfels = HashSet::new();
        for entry in map.entries() {
            let Some(tile) = map.load(entry.tile)? else { continue };
            let place = |surfel: &Surfel| {
                let centre = surfel.centre_in_tile_m;
                voxel_of(std::array::from_fn(|k| tile.origin_in_world_m[k] + f64::from(centre[k])))
            };
            surfels.extend(tile.surfels[..tile.own].iter().map(place));
        }
        Ok(surfels)
    };
    let (all, kept) = (surfels_of(&Store::open_once(&path)?)?, surfels_of(map)?);
    let (mut returns, mut left_out) = ([0; 2], [0; 2]);
    for (voxel, of_voxel) in voxels {
        let (is_kept, would_be) = (kept.contains(&voxel), all.contains(&voxel));
        for k in 0..2 {
            returns[k] += of_voxel[k];
            // Others that make no surfel anyway are not lost.
            if !is_kept && (k == 0 || would_be) {
                left_out[k] += of_voxel[k];
            }
        }
    }
    Ok((returns, left_out))
}
