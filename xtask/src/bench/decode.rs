//! How fast logs are read.

use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use anyhow::Context as _;
use clap::Args;
use dmp_log::{
    FolderFormat, FolderScanWriter, LogOptions, McapCompression, McapScanWriter, McapWriterOptions, open_log,
};
use dmp_sensor::Scan;
use dmp_sim::{LidarOptions, Recording, RecordingOptions, Route};
use serde::{Deserialize, Serialize};

use super::times::{circumstances, on_core_s, spread};

/// Scans that are simulated; a longer log repeats them under later stamps.
const DISTINCT_SCANS: usize = 20;

/// Reading logs of every format: points a second of one core, and memory
#[derive(Debug, Args)]
pub(crate) struct DecodeArgs {
    /// Points of each log, millions
    #[arg(long, default_value_t = 20)]
    points_millions: u64,
    /// Runs of each format, interleaved
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Only formats whose name contains this
    #[arg(long)]
    only: Option<String>,
    /// Read this log once and print what it took, in JSON: what the benchmark starts for every run
    #[arg(long, hide = true)]
    child: Option<PathBuf>,
}

/// A log that is written for the benchmark.
struct Format {
    name: &'static str,
    file: &'static str,
    kind: Container,
}

#[derive(Clone, Copy)]
pub(super) enum Container {
    Mcap(McapCompression),
    Folder(FolderFormat),
}

const FORMATS: [Format; 8] = [
    Format { name: "MCAP, zstd", file: "zstd.mcap", kind: Container::Mcap(McapCompression::Zstd) },
    Format { name: "MCAP, lz4", file: "lz4.mcap", kind: Container::Mcap(McapCompression::Lz4) },
    Format { name: "MCAP, none", file: "none.mcap", kind: Container::Mcap(McapCompression::None) },
    Format { name: "folder of .bin", file: "bin", kind: Container::Folder(FolderFormat::Bin) },
    Format { name: "folder of .pcd", file: "pcd", kind: Container::Folder(FolderFormat::Pcd) },
    Format { name: "folder of .ply", file: "ply", kind: Container::Folder(FolderFormat::Ply) },
    Format { name: "folder of .las", file: "las", kind: Container::Folder(FolderFormat::Las) },
    Format { name: "folder of .laz", file: "laz", kind: Container::Folder(FolderFormat::Laz) },
];

/// What one reading took.
#[derive(Debug, Serialize, Deserialize)]
struct Taken {
    points: u64,
    open_s: f64,
    read_s: f64,
    peak_anon_bytes: u64,
}

pub(crate) fn run(arguments: &DecodeArgs) -> anyhow::Result<()> {
    if let Some(log) = &arguments.child {
        println!("{}", serde_json::to_string(&read(log)?)?);
        return Ok(());
    }
    let wanted =
        |format: &&Format| arguments.only.as_ref().is_none_or(|part| format.name.contains(part.as_str()));
    let formats: Vec<&Format> = FORMATS.iter().filter(wanted).collect();
    let folder = tempfile::tempdir_in("/var/tmp")?;
    let distinct = simulate()?;
    let mut bytes = Vec::new();
    for format in &formats {
        let path = folder.path().join(format.file);
        write(&path, format.kind, &distinct, arguments.points_millions * 1_000_000)?;
        bytes.push(size(&path)?);
    }
    drop(distinct);
    let mut taken: Vec<Vec<Taken>> = formats.iter().map(|_| Vec::new()).collect();
    for _ in 0..arguments.runs {
        for (format, taken) in formats.iter().zip(&mut taken) {
            taken.push(child(&folder.path().join(format.file))?);
        }
    }
    println!(
        "one thread, its time on the core, logs in the page cache, {} runs of each, interleaved; {}",
        arguments.runs,
        circumstances()
    );
    println!(
        "{:<18}{:>10}{:>10}{:>18}{:>18}{:>22}{:>12}",
        "format", "M points", "MB", "opening, M pt/s", "reading, M pt/s", "least – largest", "anon MiB"
    );
    for ((format, taken), bytes) in formats.iter().zip(taken).zip(bytes) {
        let points = taken.first().map_or(0, |one| one.points) as f64 / 1e6;
        let speed =
            |seconds: fn(&Taken) -> f64| spread(taken.iter().map(|one| points / seconds(one)).collect());
        let [opening, ..] = speed(|one| one.open_s);
        let [reading, least, largest] = speed(|one| one.read_s);
        let peak = taken.iter().map(|one| one.peak_anon_bytes).max().unwrap_or(0) as f64 / f64::from(1 << 20);
        println!(
            "{:<18}{points:>10.1}{:>10.0}{opening:>18.1}{reading:>18.1}{:>22}{peak:>12.1}",
            format.name,
            bytes as f64 / 1e6,
            format!("{least:.1} – {largest:.1}")
        );
    }
    Ok(())
}

fn child(log: &Path) -> anyhow::Result<Taken> {
    let output =
        Command::new(std::env::current_exe()?).args(["bench", "decode", "--child"]).arg(log).output()?;
    anyhow::ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).context("what the child printed")
}

/// Opens a log and reads all its scans, watching the memory.
fn read(log: &Path) -> anyhow::Result<Taken> {
    static PEAK: AtomicU64 = AtomicU64::new(0);
    static DONE: AtomicBool = AtomicBool::new(false);
    let watching = std::thread::spawn(|| {
        while !DONE.load(Ordering::Relaxed) {
            PEAK.fetch_max(anonymous_bytes().unwrap_or(0), Ordering::Relaxed);
            std::thread::sleep(Duration::from_millis(5));
        }
    });
    let start_s = on_core_s()?;
    let log = open_log(log, &LogOptions::default())?;
    let opened_s = on_core_s()?;
    let mut reader = log.reader()?;
    let (mut scan, mut points) = (Scan::default(), 0);
    for frame in 0..log.frames().len() {
        reader.read(frame, &mut scan)?;
        points += black_box(&scan).len() as u64;
    }
    let read_s = on_core_s()? - opened_s;
    DONE.store(true, Ordering::Relaxed);
    watching.join().map_err(|_| anyhow::anyhow!("the watch on the memory ended early"))?;
    Ok(Taken { points, open_s: opened_s - start_s, read_s, peak_anon_bytes: PEAK.load(Ordering::Relaxed) })
}

fn anonymous_bytes() -> Option<u64> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("RssAnon:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kib| kib * 1024)
}

/// Scans of a 64-beam sensor driving round a block.
pub(super) fn simulate() -> anyhow::Result<Vec<Scan>> {
    let lidar = LidarOptions { azimuth_steps: 1800, rate_hz: 10.0, ..LidarOptions::with_beams(64) };
    let options = RecordingOptions {
        seed: 1,
        scans: DISTINCT_SCANS,
        route: Route::Loop,
        speed_m_s: 8.0,
        traffic: 20,
        lidar,
    };
    let town = options.town()?;
    Ok(Recording::new(&town, &options)?.scans().collect())
}

/// Writes the scans again and again, ten a second, until there are as many points.
pub(super) fn write(path: &Path, kind: Container, scans: &[Scan], points: u64) -> anyhow::Result<()> {
    let stamped = |(number, scan): (usize, &Scan)| Scan {
        stamp_ns: Some(1_600_000_000_000_000_000 + number as i64 * 100_000_000),
        ..scan.clone()
    };
    let mut written = 0;
    let log = scans.iter().cycle().enumerate().map(stamped).take_while(|scan| {
        let is_wanted = written < points;
        written += scan.len() as u64;
        is_wanted
    });
    match kind {
        Container::Mcap(compression) => {
            let options = McapWriterOptions { compression, ..McapWriterOptions::default() };
            let mut writer = McapScanWriter::create(path, &options)?;
            for scan in log {
                writer.write_scan(&scan)?;
            }
            Ok(writer.finish()?)
        }
        Container::Folder(format) => {
            let mut writer = FolderScanWriter::create(path, format)?;
            for scan in log {
                writer.write_scan(&scan)?;
            }
            Ok(writer.finish()?)
        }
    }
}

/// Bytes of a file, or of everything in a folder.
fn size(path: &Path) -> anyhow::Result<u64> {
    let metadata = fs::metadata(path)?;
    if !metadata.is_dir() {
        return Ok(metadata.len());
    }
    fs::read_dir(path)?.map(|entry| size(&entry?.path())).sum()
}
