//! A map on disk: how large, and how long until rays can be cast into it.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context as _;
use clap::Args;
use dmp::{Config, Run, fuse_maps};
use dmp_cast::CastTile;
use dmp_map::{Store, Tile, TileEntry, TileId};

use super::cast::scene::{SCENES, SimulatedDrive};
use super::times::{circumstances, drop_pages, spread};

/// Stored maps: bytes, and time to load, warm and cold
#[derive(Debug, Args)]
pub(crate) struct StoreArgs {
    /// Names of the simulated scenes, as of `bench cast`
    #[arg(default_values = ["dense", "city", "coarse"])]
    scenes: Vec<String>,
    /// A store instead of a simulated one
    #[arg(long, conflicts_with = "scenes")]
    store: Option<PathBuf>,
    /// Scans of the simulated drive
    #[arg(long, default_value_t = 600, value_parser = clap::value_parser!(u32).range(1..))]
    scans: u32,
    /// Loads of all tiles in each way, in turns
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Where the maps are written: on the disk to be measured
    #[arg(long, default_value = "/var/tmp")]
    folder: PathBuf,
}

pub(crate) fn run(arguments: &StoreArgs) -> anyhow::Result<()> {
    let folder = tempfile::tempdir_in(&arguments.folder)?;
    println!(
        "one thread, all tiles in the order of the file, {} loads in each way, in turns; {}",
        arguments.runs,
        circumstances()
    );
    if let Some(path) = &arguments.store {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        return measure(&name, path, arguments.runs);
    }
    let drive = SimulatedDrive::new(arguments.scans as usize, folder.path())?;
    for name in &arguments.scenes {
        let known = SCENES.iter().find(|(known, _)| known == name);
        let &(_, voxel_m) = known.with_context(|| format!("{name}: no such scene"))?;
        let config =
            Config { voxel_m: Some(voxel_m), save_maps: Some(folder.path().into()), ..Config::default() };
        drop(fuse_maps(drive.log.as_ref(), &[Run::new(name, drive.truth.clone())], &config, ())?);
        measure(name, &folder.path().join(format!("{name}.dmpmap")), arguments.runs)?;
    }
    Ok(())
}

fn measure(name: &str, path: &Path, runs: u32) -> anyhow::Result<()> {
    let store = Store::open(path)?;
    let surfels = store.surfels();
    let copies: u64 = store.entries().map(|entry| u64::from(entry.borders.surfels)).sum();
    println!(
        "\n{name}: {surfels} surfels and {copies} copies in {} tiles, voxels of {:.2} m",
        store.entries().count(),
        store.lattice().voxel_m()
    );
    let ids = in_order(store.entries());
    drop(store);
    let per = 1e9 / surfels as f64;

    println!("{:>18}{:>10}  until rays can be cast, ns a surfel", "bytes a surfel", "MB");
    println!(
        "{:<28}{:>10}{:>18}{:>10}{:>18}{:>10}",
        "", "warm", "least – largest", "cold", "least – largest", "MB read"
    );
    let bytes = std::fs::metadata(path)?.len();
    let (mut warm_s, mut cold_s, mut read_bytes) = (Vec::new(), Vec::new(), 0);
    for _ in 0..runs {
        drop_pages(path)?;
        let before = bytes_read()?;
        cold_s.push(load(path, &ids)?);
        read_bytes = bytes_read()? - before;
        warm_s.push(load(path, &ids)?);
    }
    let [warm, cold] = [warm_s, cold_s].map(|times_s| spread(times_s).map(|time_s| time_s * per));
    println!(
        "{:>18.2}{:>10.1}{:>10.1}{:>18}{:>10.1}{:>18}{:>10.1}",
        bytes as f64 / surfels as f64,
        bytes as f64 / 1e6,
        warm[0],
        format!("{:.1} – {:.1}", warm[1], warm[2]),
        cold[0],
        format!("{:.1} – {:.1}", cold[1], cold[2]),
        read_bytes as f64 / 1e6
    );
    println!("{:<40}{:>10}{:>18}", "steps, warm", "ns", "least – largest");
    for (step, times_s) in steps(path, &ids, runs)? {
        let [median, least, largest] = spread(times_s).map(|time_s| time_s * per);
        println!("{step:<40}{median:>10.1}{:>18}", format!("{least:.1} – {largest:.1}"));
    }
    Ok(())
}

/// Opens a map and makes every tile ready; seconds.
fn load(path: &Path, ids: &[TileId]) -> anyhow::Result<f64> {
    let start = Instant::now();
    let store = Store::open(path)?;
    let radius_m = store.lattice().disc_radius_m() as f32;
    for &id in ids {
        black_box(store.load(id)?.map(|tile| CastTile::build(&tile, radius_m)));
    }
    Ok(start.elapsed().as_secs_f64())
}

/// What loading consists of, each over all tiles; seconds.
fn steps(path: &Path, ids: &[TileId], runs: u32) -> anyhow::Result<Vec<(&'static str, Vec<f64>)>> {
    let mut times: Vec<(&str, Vec<f64>)> =
        ["checksums", "unzip", "codes to surfels", "tree"].map(|step| (step, Vec::new())).into();
    let store = Store::open(path)?;
    let radius_m = store.lattice().disc_radius_m() as f32;
    for _ in 0..runs {
        let mut taken_s = [0.0; 4];
        for &id in ids {
            let entry = store.entry(id).context("a tile")?;
            let blobs = [&entry.own, &entry.borders].into_iter().filter(|blob| blob.surfels > 0);
            let mut clock = Clock::start();
            let mut packed = Vec::new();
            for blob in blobs.clone() {
                packed.push(store.blob(id, blob)?);
            }
            let checksums_s = clock.lap_s();
            for (packed, blob) in packed.iter().zip(blobs) {
                let most = 15 * (blob.rows + blob.surfels) as usize;
                black_box(zstd::bulk::decompress(packed, most)?);
            }
            let unzip_s = clock.lap_s();
            let tile: Option<Tile> = store.load(id)?;
            let load_s = clock.lap_s();
            black_box(tile.map(|tile| CastTile::build(&tile, radius_m)));
            let tree_s = clock.lap_s();
            let all = [checksums_s, unzip_s, (load_s - checksums_s - unzip_s).max(0.0), tree_s];
            taken_s.iter_mut().zip(all).for_each(|(sum, time_s)| *sum += time_s);
        }
        times.iter_mut().zip(taken_s).for_each(|((_, times_s), time_s)| times_s.push(time_s));
    }
    Ok(times)
}

struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Self(Instant::now())
    }

    /// Seconds since the last lap.
    fn lap_s(&mut self) -> f64 {
        let now = Instant::now();
        now.duration_since(std::mem::replace(&mut self.0, now)).as_secs_f64()
    }
}

fn in_order<'a>(entries: impl Iterator<Item = &'a TileEntry>) -> Vec<TileId> {
    let mut ids: Vec<TileId> = entries.map(|entry| entry.tile).collect();
    ids.sort_unstable();
    ids
}

/// Bytes that this process has had read from disks.
fn bytes_read() -> anyhow::Result<u64> {
    let text = std::fs::read_to_string("/proc/self/io")?;
    let line = text.lines().find_map(|line| line.strip_prefix("read_bytes: "));
    Ok(line.context("/proc/self/io has no read_bytes")?.trim().parse()?)
}
