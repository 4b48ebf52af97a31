//! `cargo xtask study rooms`: depth cameras in simulated rooms, the paper's own experiment, and what the defaults of
//! rooms were chosen by.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp::{Config, Report, Run, Sample, Scales, SegmentLength, evaluate};
use dmp_log::{DepthFolderWriter, LogOptions, ScanLog, encode_depth_png, open_log};
use dmp_sensor::{Distortion, PinholeCamera, Trajectory};
use dmp_sim::{DepthRecording, DepthRecordingOptions, Room, RoomOptions, ate_rmse_m, room_estimates};
use dmp_study::{Study, StudyOptions, study};
use dmp_truth::rank::kendall_tau_b;

/// Depth cameras in furnished rooms: does DMP order estimates as the truth does, and under which settings?
#[derive(Debug, clap::Args)]
pub(super) struct RoomsArgs {
    /// Seeds of the rooms
    #[arg(long, value_delimiter = ',', default_value = "1,2,3,4,5,6")]
    rooms: Vec<u64>,
    /// Score ten estimates of each room under several settings, instead of five under the default
    #[arg(long)]
    settings: bool,
    /// A walk that sees most of the room only once
    #[arg(long, conflicts_with = "settings")]
    once: bool,
    /// Images of a recording
    #[arg(long, default_value_t = 150)]
    images: usize,
    /// Width of an image, pixels; three quarters of that are its height
    #[arg(long, default_value_t = 320)]
    width: u32,
    /// Where the recordings are kept
    #[arg(long, default_value = "target/study/rooms", value_name = "FOLDER")]
    out: PathBuf,
}

/// Seconds that a walk takes.
const WALK_S: f64 = 20.0;
/// Pairs of estimates count whose ATE differ by this factor.
const APART: f64 = 1.5;
/// Scans that are scored under each setting; the maps are of all.
const SCORED: u64 = 20;
/// Sets of five estimates for the settings.
const SETS: u64 = 2;

pub(super) fn run(arguments: &RoomsArgs) -> anyhow::Result<()> {
    if arguments.settings {
        return settings(arguments);
    }
    for &seed in &arguments.rooms {
        let place = RoomLog::open(seed, arguments)?;
        let mut runs = vec![Run::new("truth", place.truth.clone())];
        runs.extend(place.estimates(seed)?);
        let triangles = place.room.triangles();
        let surface = |reference: &mut dmp_truth::surface::Reference| {
            reference.add_triangles(&triangles).map_err(Into::into)
        };
        let options = StudyOptions { peers: None, surface_cap_m: 1.0, ..StudyOptions::default() };
        let found =
            study(place.log.as_ref(), &runs, &place.truth, Some(&surface), &Config::default(), &options, ())?;
        print(seed, &found);
    }
    Ok(())
}

/// A recording of a room as the study makes it, and its truth.
pub(super) fn room_log(seed: u64, out: &Path) -> anyhow::Result<(Box<dyn ScanLog>, Trajectory)> {
    let place = open_room(seed, out)?;
    Ok((place.log, place.truth))
}

/// The same with its truth and its estimates.
pub(super) fn room_runs(seed: u64, out: &Path) -> anyhow::Result<(Box<dyn ScanLog>, Vec<Run>)> {
    let place = open_room(seed, out)?;
    let mut runs = vec![Run::new("truth", place.truth.clone())];
    runs.extend(place.estimates(seed)?);
    Ok((place.log, runs))
}

fn open_room(seed: u64, out: &Path) -> anyhow::Result<RoomLog> {
    let arguments = RoomsArgs {
        rooms: vec![seed],
        settings: false,
        once: false,
        images: 150,
        width: 320,
        out: out.to_path_buf(),
    };
    RoomLog::open(seed, &arguments)
}

/// A recording on disk, with its truth.
struct RoomLog {
    room: Room,
    log: Box<dyn ScanLog>,
    truth: Trajectory,
}

impl RoomLog {
    /// Makes the recording, or takes the one that was made before.
    fn open(seed: u64, arguments: &RoomsArgs) -> anyhow::Result<Self> {
        let (width, images) = (arguments.width, arguments.images);
        let size_px = [width, width * 3 / 4];
        let centre_px = size_px.map(|px| (f64::from(px) - 1.0) / 2.0);
        let focal_px = [525.0 * f64::from(width) / 640.0; 2];
        let camera = PinholeCamera::new(size_px, focal_px, centre_px, Distortion::NONE)?;
        let room = Room::new(RoomOptions { seed, ..RoomOptions::default() })?;
        let options = DepthRecordingOptions {
            seed,
            images,
            rate_hz: images as f64 / WALK_S,
            revisit: !arguments.once,
            ..DepthRecordingOptions::new(camera)
        };
        let recording = DepthRecording::new(&room, options)?;
        let once = if arguments.once { "-once" } else { "" };
        let folder = arguments.out.join(format!("room-{seed}-{width}-{images}{once}"));
        if !folder.exists() {
            write(&recording, &camera, &folder).with_context(|| folder.display().to_string())?;
        }
        let truth = recording.truth()?;
        Ok(Self { log: open_log(&folder, &LogOptions::default())?, truth, room })
    }

    fn estimates(&self, seed: u64) -> anyhow::Result<Vec<Run>> {
        let estimates = room_estimates(&self.truth, seed)?;
        Ok(estimates.into_iter().map(|estimate| Run::new(estimate.name, estimate.trajectory)).collect())
    }
}

fn write(recording: &DepthRecording<'_>, camera: &PinholeCamera, folder: &Path) -> anyhow::Result<()> {
    if let Some(parent) = folder.parent() {
        std::fs::create_dir_all(parent)?;
    }
    let mut images = DepthFolderWriter::create(folder, camera, recording.options().units_per_m)?;
    let size_px = camera.size_px();
    for (stamp_ns, png) in
        recording.map_images(|image| (image.stamp_ns, encode_depth_png(size_px, &image.units)))
    {
        images.write_encoded(stamp_ns, &png?)?;
    }
    Ok(images.finish()?)
}

/// The columns that are shown of a room.
const SHOWN: [(&str, &str); 9] = [
    ("ate_rmse_m", "ATE m"),
    ("smd_mean_m", "SMD m"),
    ("dmp_sum_m2", "DMP m²"),
    ("dmp_mean_m2", "mean m²"),
    ("r_cv_1_m2", "R_cv 1"),
    ("r_cv_0.2_m2", "R_cv .2"),
    ("r_cv_0.05_m2", "R_cv .05"),
    ("r_near_0.2_m2", "R_near .2"),
    ("coverage", "coverage"),
];

fn print(seed: u64, found: &Study) {
    println!("room {seed}");
    let heads: Vec<String> = SHOWN.iter().map(|(_, head)| format!("{head:>10}")).collect();
    println!("  {:<12}{}", "run", heads.join(""));
    for (run, name) in found.table.runs.iter().enumerate() {
        let cells: Vec<String> = SHOWN.iter().map(|(key, _)| cell(found, key, run)).collect();
        println!("  {name:<12}{}", cells.join(""));
    }
    let values = |key: &str| found.table.column(key).map(|column| column.values.clone()).unwrap_or_default();
    for (key, head) in [("ate_rmse_m", "ATE"), ("smd_mean_m", "SMD")] {
        let truth = values(key);
        let agreement = SHOWN[2..8].iter().map(|(key, head)| {
            let tau = kendall_tau_b(&values(key), &truth);
            format!("{head} {}", tau.map_or("–".to_owned(), |tau| format!("{tau:.2}")))
        });
        println!("  Kendall tau-b with {head}: {}", agreement.collect::<Vec<_>>().join(", "));
    }
    let judged = Judged::of(&found.score, &ates(found));
    println!(
        "  order: {}; pairs right {}, wrong {}, open {}\n",
        found.score.order.join(" < "),
        judged.right,
        judged.wrong,
        judged.open
    );
}

fn cell(found: &Study, key: &str, run: usize) -> String {
    match found.table.column(key).and_then(|column| column.values[run]) {
        Some(value) if value >= 100.0 => format!("{value:>10.0}"),
        Some(value) => format!("{value:>10.5}"),
        None => format!("{:>10}", "–"),
    }
}

fn ates(found: &Study) -> Vec<(String, f64)> {
    let column = found.table.column("ate_rmse_m");
    let ate = |run: usize| column.and_then(|column| column.values[run]).unwrap_or(f64::NAN);
    found.table.runs.iter().enumerate().map(|(run, name)| (name.clone(), ate(run))).collect()
}

/// How pairs whose order is known came out.
#[derive(Debug, Clone, Copy, Default)]
struct Judged {
    right: usize,
    wrong: usize,
    open: usize,
}

impl Judged {
    fn of(report: &Report, ates_m: &[(String, f64)]) -> Self {
        let mut judged = Self::default();
        let ate = |name: &str| ates_m.iter().find(|(run, _)| run == name).map_or(f64::NAN, |(_, ate)| *ate);
        for pair in &report.pairs {
            let (a, b) = (ate(&pair.a), ate(&pair.b));
            let better = match (APART * a < b, APART * b < a) {
                (true, _) => &pair.a,
                (_, true) => &pair.b,
                _ => continue,
            };
            match pair.verdict.better() {
                Some(found) if found == better => judged.right += 1,
                Some(_) => judged.wrong += 1,
                None => judged.open += 1,
            }
        }
        judged
    }
}

/// A setting, as it is told.
type Setting = (&'static str, fn(Config, &Report) -> Config);

const SETTINGS: [Setting; 12] = [
    ("default", |config, _| config),
    ("voxel 0.03 m", |config, _| Config { voxel_m: Some(0.03), ..config }),
    ("voxel 0.05 m", |config, _| Config { voxel_m: Some(0.05), ..config }),
    ("segments: 8 by scans", |config, was| by_scans(config, was, 8)),
    ("segments: 32 by scans", |config, was| by_scans(config, was, 32)),
    ("segments: 1 s", |config, _| Config { segment: Some(SegmentLength::Seconds(1.0)), ..config }),
    ("segments: 0.5 s", |config, _| Config { segment: Some(SegmentLength::Seconds(0.5)), ..config }),
    ("segments: way / 16", |config, was| {
        let way_m = was.config.segments.travel_m / 16.0;
        Config { segment: Some(SegmentLength::Metres(way_m)), ..config }
    }),
    ("every scan a segment", |config, _| Config { segment: Some(SegmentLength::Scans(1)), ..config }),
    ("lengths of a drive", |config, _| Config {
        scales: Some(Scales::Drive),
        voxel_m: Some(0.02),
        min_range_m: Some(0.3),
        max_range_m: Some(10.0),
        ..config
    }),
    ("ranges to 5 m", |config, _| Config { max_range_m: Some(5.0), ..config }),
    ("voxel 0.01 m", |config, _| Config { voxel_m: Some(0.01), ..config }),
];

fn by_scans(config: Config, was: &Report, segments: u64) -> Config {
    let scans = (was.inputs.scans_used as u64).div_ceil(segments).max(1);
    Config { segment: Some(SegmentLength::Scans(scans)), ..config }
}

/// Scores more estimates under every setting: pairs that come out right, wrong, and open, and how alike the orders are.
fn settings(arguments: &RoomsArgs) -> anyhow::Result<()> {
    println!(
        "{:<24}{:>7}{:>7}{:>7}{:>10}{:>10}{:>12}{:>10}",
        "setting", "right", "wrong", "open", "DMP mean", "R_cv", "R_near mid", "coverage"
    );
    let mut rooms = Vec::new();
    for &seed in &arguments.rooms {
        let place = RoomLog::open(seed, arguments)?;
        let mut runs = vec![Run::new("truth", place.truth.clone())];
        for set in 0..SETS {
            let of_set = place.estimates(100 * seed + set)?;
            runs.extend(of_set.into_iter().map(|run| Run { name: format!("{} {set}", run.name), ..run }));
        }
        let ate = |run: &Run| (run.name.clone(), ate_rmse_m(&run.trajectory, &place.truth));
        let ates_m: Vec<_> = runs.iter().map(ate).collect();
        rooms.push((place, runs, ates_m));
    }
    let mut defaults: Vec<Report> = Vec::new();
    for (name, change) in SETTINGS {
        let mut all = Judged::default();
        let mut means = [0.0; 4];
        for (k, (place, runs, ates_m)) in rooms.iter().enumerate() {
            let scored = Config { sample: Sample::Frames(SCORED), ..Config::default() };
            let config = match defaults.get(k) {
                Some(default) => change(scored, default),
                None => scored,
            };
            let report = evaluate(place.log.as_ref(), runs, &config, ())?;
            let judged = Judged::of(&report, ates_m);
            all = Judged {
                right: all.right + judged.right,
                wrong: all.wrong + judged.wrong,
                open: all.open + judged.open,
            };
            let truth: Vec<Option<f64>> = ates_m.iter().map(|(_, ate)| Some(*ate)).collect();
            let tau = |score: fn(&dmp::RunReport) -> Option<f64>| {
                let scores: Vec<_> = report.runs.iter().map(score).collect();
                kendall_tau_b(&scores, &truth).unwrap_or(f64::NAN)
            };
            let coverage = report.runs[0].coverage.unwrap_or(f64::NAN);
            let of_room = [
                tau(|run| run.dmp_mean_m2),
                tau(|run| run.r_cv_m2[0]),
                tau(|run| run.r_near_m2[1]),
                coverage,
            ];
            means.iter_mut().zip(of_room).for_each(|(mean, value)| *mean += value / rooms.len() as f64);
            if defaults.len() == k {
                defaults.push(report);
            }
        }
        let [dmp, cv, near, coverage] = means;
        println!(
            "{name:<24}{:>7}{:>7}{:>7}{dmp:>10.3}{cv:>10.3}{near:>12.3}{coverage:>10.3}",
            all.right, all.wrong, all.open
        );
    }
    Ok(())
}
