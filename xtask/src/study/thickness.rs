//! How thick the maps of streets are whose noise is known, and how many walls stand twice where the way back is off.

use clap::Args;
use dmp::{Config, DriftPairs, Run, evaluate};
use dmp_log::MemoryLog;
use dmp_map::Thickness;
use dmp_sensor::{Isometry3, Scan, Trajectory, Translation3};
use dmp_sim::{LidarOptions, Recording, RecordingOptions, Route};

/// Streets out and back with known noise, and with a way back that is off: thickness and double layers
#[derive(Debug, Args)]
pub(crate) struct ThicknessArgs {
    /// Short right drives, by seed, in which no layer is to be found
    #[arg(long, value_name = "N", default_value_t = 20)]
    seeds: u64,
}

pub(super) fn run(arguments: &ThicknessArgs) -> anyhow::Result<()> {
    println!(
        "| range noise, cm | way back off, cm | cells | thick, cm | within, cm | sensor, cm | seen twice | doubled | layers, cm |\n\
         |---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    );
    for (noise_m, off_m) in [0.0, 0.01, 0.02, 0.04]
        .map(|noise_m| (noise_m, 0.0))
        .into_iter()
        .chain([0.05, 0.1, 0.2, 0.4].map(|off_m| (0.02, off_m)))
    {
        let cm = |m: Option<f64>| m.map_or("–".to_owned(), |m| format!("{:.2}", 100.0 * m));
        let Some(found) = street(1, 300, (noise_m, off_m))? else {
            println!("| {:.0} | {:.0} | too few |", 100.0 * noise_m, 100.0 * off_m);
            continue;
        };
        let layers = &found.layers;
        println!(
            "| {:.0} | {:.0} | {} | {} | {} | {} | {} | {:.3} | {} |",
            100.0 * noise_m,
            100.0 * off_m,
            found.cells,
            cm(Some(found.median_m)),
            cm(Some(found.within_median_m)),
            cm(found.sensor_median_m),
            layers.cells,
            layers.doubled as f64 / layers.cells.max(1) as f64,
            cm(layers.median_m)
        );
    }
    let (mut cells, mut doubled) = (0, 0);
    for seed in 1..=arguments.seeds {
        if let Some(found) = street(seed, 60 + 10 * (seed as usize % 7), (0.02, 0.0))? {
            cells += found.layers.cells;
            doubled += found.layers.doubled;
        }
    }
    println!(
        "\n{} right drives: {doubled} of {cells} cells that several visits saw are called doubled",
        arguments.seeds
    );
    Ok(())
}

/// The thickness of a street's map whose way back lies so far to the side and above.
fn street(seed: u64, scans: usize, (noise_m, off_m): (f64, f64)) -> anyhow::Result<Option<Thickness>> {
    let lidar = LidarOptions {
        range_noise_m: noise_m,
        azimuth_steps: 450,
        rate_hz: 4.0,
        ..LidarOptions::with_beams(16)
    };
    let options =
        RecordingOptions { seed, scans, route: Route::OutAndBack, speed_m_s: 6.0, traffic: 0, lidar };
    let town = options.town()?;
    let recording = Recording::new(&town, &options)?;
    let truth = recording.drive().trajectory(20.0)?;
    let log = MemoryLog::new("street", recording.scans().collect::<Vec<Scan>>())?;
    let half = truth.poses().len() / 2;
    // Along each axis by as much, so that every surface is off by more or less of it.
    let off = Translation3::new(off_m, off_m, off_m) * Isometry3::identity();
    let moved = |(k, pose): (usize, &Isometry3<f64>)| if k < half { *pose } else { off * pose };
    let poses: Vec<Isometry3<f64>> = truth.poses().iter().enumerate().map(moved).collect();
    let stamps_ns = truth.stamps_ns().unwrap_or_default().to_vec();
    let posed = Trajectory::stamped(stamps_ns.into_iter().zip(poses).collect())?.trajectory;
    let config = Config { drift: DriftPairs::None, ..Config::default() };
    let mut report = evaluate(&log, &[Run::new("run", posed)], &config, ())?;
    Ok(report.runs.remove(0).map.thickness)
}
