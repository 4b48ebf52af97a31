//! How fast LAZ is decoded, on one thread and on several.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::Context as _;
use clap::{Args, ValueEnum};
use dmp_log::{FolderFormat, LogOptions, MadeWith, ScanLog, open_log, read_cloud};
use dmp_sensor::{Isometry3, Scan, Trajectory};
use serde::{Deserialize, Serialize};

use super::decode::{Container, simulate, write};
use super::taken::taken_by;
use super::times::{circumstances, on_core_s, spread};

/// Nanoseconds from scan to scan.
const PERIOD_NS: i64 = 100_000_000;
/// Metres of a step of the file in world coordinates.
const STEP_M: f64 = 1e-3;

/// Decoding LAZ on one thread and on several: points a second, what it takes of the cores, and memory
#[derive(Debug, Args)]
pub(crate) struct LazArgs {
    /// Points of each file or folder, millions
    #[arg(long, default_value_t = 10)]
    points_millions: u64,
    /// Runs of each row, interleaved
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Threads that are compared with one
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Do this once in --threads and print how long it took, in JSON: what the benchmark starts for every run
    #[arg(long, hide = true, requires = "child")]
    task: Option<Task>,
    /// The file or the folder of that
    #[arg(long, hide = true, requires = "task")]
    child: Option<PathBuf>,
}

/// What is timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Task {
    /// A folder of scans, opened: each is decoded once.
    FolderOpened,
    /// Its scans, read once more.
    FolderRead,
    /// A file in world coordinates, opened as a log.
    FileOpened,
    /// A file as a map.
    MapRead,
}

impl Task {
    fn name(self) -> &'static str {
        match self {
            Self::FolderOpened => "folder of .laz, opened",
            Self::FolderRead => "folder of .laz, its scans read",
            Self::FileOpened => "one .laz with --made-with, opened",
            Self::MapRead => "one .laz, read as a map",
        }
    }
}

/// What the process of a run tells of it.
#[derive(Debug, Serialize, Deserialize)]
struct Done {
    points: u64,
    wall_s: f64,
    /// How long each thread was on a core, seconds.
    on_core_s: Vec<f64>,
}

/// A run, and the memory of its process from start to end.
struct Run {
    done: Done,
    peak_anon_bytes: u64,
}

impl Run {
    /// Points a second, by the clock on the wall.
    fn by_wall(&self) -> f64 {
        self.done.points as f64 / self.done.wall_s
    }

    /// Points for each second that the busiest thread was on its core: what it would be if nothing else ran and no thread waited
    /// for another.
    fn by_busiest(&self) -> f64 {
        self.done.points as f64 / self.done.on_core_s.iter().copied().fold(0.0, f64::max)
    }
}

pub(crate) fn run(arguments: &LazArgs) -> anyhow::Result<()> {
    if let (Some(task), Some(path)) = (arguments.task, &arguments.child) {
        let done = dmp::in_threads(arguments.threads, || timed(task, path, arguments.threads))??;
        println!("{}", serde_json::to_string(&done)?);
        return Ok(());
    }
    let folder = tempfile::tempdir_in("/var/tmp")?;
    let (scans, file) = (folder.path().join("scans"), folder.path().join("file.laz"));
    let distinct = simulate()?;
    let points = arguments.points_millions * 1_000_000;
    write(&scans, Container::Folder(FolderFormat::Laz), &distinct, points)?;
    write_file(&file, &distinct, points)?;
    drop(distinct);
    let mut rows = Vec::new();
    for &task in Task::value_variants() {
        rows.extend([1, arguments.threads].map(|threads| (task, threads, Vec::new())));
    }
    for _ in 0..arguments.runs {
        for (task, threads, runs) in &mut rows {
            let path = if *task == Task::FolderOpened || *task == Task::FolderRead { &scans } else { &file };
            runs.push(child(*task, path, *threads)?);
        }
    }
    println!("logs in the page cache, {} runs of each, interleaved; {}", arguments.runs, circumstances());
    println!(
        "{:<36}{:>8}{:>10}{:>14}{:>16}{:>13}{:>12}{:>10}",
        "",
        "threads",
        "M points",
        "busiest, M/s",
        "least – largest",
        "on wall, M/s",
        "on cores, s",
        "anon MiB"
    );
    for (task, threads, runs) in rows {
        let points = runs.first().map_or(0, |run| run.done.points) as f64 / 1e6;
        let [busiest, least, largest] = spread(runs.iter().map(|run| run.by_busiest() / 1e6).collect());
        let [by_wall, ..] = spread(runs.iter().map(|run| run.by_wall() / 1e6).collect());
        let [on_cores_s, ..] = spread(runs.iter().map(|run| run.done.on_core_s.iter().sum()).collect());
        let peak = runs.iter().map(|run| run.peak_anon_bytes).max().unwrap_or(0) as f64 / f64::from(1 << 20);
        println!(
            "{:<36}{threads:>8}{points:>10.1}{busiest:>14.1}{:>16}{by_wall:>13.1}{on_cores_s:>12.2}{peak:>10.1}",
            task.name(),
            format!("{least:.1} – {largest:.1}")
        );
    }
    Ok(())
}

fn child(task: Task, path: &Path, threads: usize) -> anyhow::Result<Run> {
    let task = task.to_possible_value().context("a task has a name")?;
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["bench", "laz", "--task", task.get_name(), "--threads", &threads.to_string(), "--child"]);
    let (taken, said) = taken_by(command.arg(path))?;
    let done = serde_json::from_slice(&said).context("what the child printed")?;
    Ok(Run { done, peak_anon_bytes: taken.peak_anon_bytes })
}

fn timed(task: Task, path: &Path, threads: usize) -> anyhow::Result<Done> {
    let usual = LogOptions::default();
    match task {
        Task::FolderOpened => in_pool(|| Ok(open_log(path, &usual)?.summary().returns)),
        Task::FolderRead => read_scans(open_log(path, &usual)?.as_ref(), threads),
        Task::FileOpened => {
            let poses = (-10..100_000).map(|k| (k * PERIOD_NS, Isometry3::identity())).collect();
            let made_with = MadeWith::new(Trajectory::stamped(poses)?.trajectory);
            let options = LogOptions { made_with: Some(made_with), ..usual };
            in_pool(|| Ok(open_log(path, &options)?.summary().returns))
        }
        Task::MapRead => in_pool(|| {
            let mut sum_m = 0.0;
            let summary = read_cloud(path, None, |batch| -> anyhow::Result<()> {
                sum_m += batch.iter().flatten().sum::<f64>();
                Ok(())
            })?;
            black_box(sum_m);
            Ok(summary.points)
        }),
    }
}

/// Times what is done in the pool that this is called in.
fn in_pool(work: impl FnOnce() -> anyhow::Result<u64>) -> anyhow::Result<Done> {
    let on_cores_s = || rayon::broadcast(|_| on_core_s()).into_iter().collect::<anyhow::Result<Vec<f64>>>();
    let (start, before_s) = (Instant::now(), on_cores_s()?);
    let points = work()?;
    let wall_s = start.elapsed().as_secs_f64();
    let on_core_s =
        on_cores_s()?.iter().zip(before_s).map(|(after_s, before_s)| after_s - before_s).collect();
    Ok(Done { points, wall_s, on_core_s })
}

/// Reads all scans as a score does: each thread takes some that lie together, with a reader of its own.
fn read_scans(log: &dyn ScanLog, threads: usize) -> anyhow::Result<Done> {
    let (groups, next) = (log.groups(), AtomicUsize::new(0));
    let work = || -> anyhow::Result<(u64, f64)> {
        let (mut reader, mut scan, mut points) = (log.reader()?, Scan::default(), 0);
        while let Some(group) = groups.get(next.fetch_add(1, Ordering::Relaxed)) {
            for frame in group.clone() {
                reader.read(frame, &mut scan)?;
                points += black_box(&scan).len() as u64;
            }
        }
        Ok((points, on_core_s()?))
    };
    let start = Instant::now();
    let done: Vec<(u64, f64)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let joined = |thread: std::thread::ScopedJoinHandle<'_, anyhow::Result<(u64, f64)>>| {
            thread.join().map_err(|_| anyhow::anyhow!("a thread that reads ended early"))?
        };
        threads.into_iter().map(joined).collect::<anyhow::Result<_>>()
    })?;
    let wall_s = start.elapsed().as_secs_f64();
    let (points, on_core_s): (Vec<u64>, Vec<f64>) = done.into_iter().unzip();
    Ok(Done { points: points.iter().sum(), wall_s, on_core_s })
}

/// Writes the scans as points of a world in which the sensor stands still, until there are as many points.
fn write_file(path: &Path, scans: &[Scan], points: u64) -> anyhow::Result<()> {
    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(6)?;
    let axis = las::Transform { scale: STEP_M, offset: 0.0 };
    builder.transforms = las::Vector { x: axis, y: axis, z: axis };
    let mut writer = las::Writer::from_path(path, builder.into_header()?)?;
    let mut written = 0;
    for (number, scan) in (0_i64..).zip(scans.iter().cycle()) {
        if written >= points {
            break;
        }
        for (&place, offset_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
            let [x, y, z] = if place.iter().all(|c| c.is_finite()) { place.map(f64::from) } else { [0.0; 3] };
            let gps_time = Some((number * PERIOD_NS + offset_ns) as f64 / 1e9);
            writer.write_point(las::Point {
                x,
                y,
                z,
                gps_time,
                return_number: 1,
                number_of_returns: 1,
                ..las::Point::default()
            })?;
        }
        written += scan.len() as u64;
    }
    Ok(writer.close()?)
}
