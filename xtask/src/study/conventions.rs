//! `cargo xtask study conventions`: whether errors of clock and extrinsic are detected, and correct runs are not changed.

use std::path::PathBuf;

use anyhow::Context as _;
use dmp::{Axis, Config, Run, vet};
use dmp_log::{LogOptions, ScanLog, open_log, read_trajectory};
use dmp_sensor::{Isometry3, Trajectory, Vector3};

use super::drives::{drives, find};
use super::estimates::simulated;
use super::logs::DriveLog;
use super::noisy;
use super::rooms::room;

/// Detect known errors of clock and extrinsic, and none in correct runs
#[derive(Debug, clap::Args)]
pub(super) struct ConventionsArgs {
    /// Drives, comma-separated [default: laps-16,oneway-32 for errors, all for noise; that also takes room-1, `nclt_revisit`]
    #[arg(long, value_delimiter = ',')]
    drives: Vec<String>,
    /// Folder of real recordings: makes errors on that of NCLT, too
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Only this part
    #[arg(long)]
    only: Option<Part>,
    /// Folder for the recordings
    #[arg(long, default_value = "target/study", value_name = "FOLDER")]
    out: PathBuf,
}

/// A part of the study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// One error at a time
    Errors,
    /// Correct runs
    Right,
    /// Correct runs with noise, of poses at several rates
    Noise,
}

/// Drives on which errors are made.
const USUAL: [&str; 2] = ["laps-16", "oneway-32"];
/// The errors that are made, to both sides: milliseconds, degrees, centimetres.
const TIMES_MS: [f64; 5] = [5.0, 10.0, 20.0, 50.0, 100.0];
const ANGLES_DEG: [f64; 4] = [0.1, 0.2, 0.5, 1.0];
const LENGTHS_CM: [f64; 3] = [2.0, 5.0, 20.0];

pub(super) fn run(arguments: &ConventionsArgs) -> anyhow::Result<()> {
    std::fs::create_dir_all(&arguments.out).with_context(|| arguments.out.display().to_string())?;
    let wanted = |part: Part| arguments.only.is_none_or(|only| only == part);
    if wanted(Part::Errors) {
        errors(arguments)?;
    }
    if wanted(Part::Right) {
        right(arguments)?;
    }
    if wanted(Part::Noise) {
        noisy::print(&arguments.drives, &arguments.out, arguments.data.as_deref())?;
    }
    Ok(())
}

fn errors(arguments: &ConventionsArgs) -> anyhow::Result<()> {
    println!(
        "| world | number | observable | half an interval | errors | detected | in the interval |\n|---|---|---|---|---|---|---|"
    );
    let usual = USUAL.map(str::to_owned);
    for name in if arguments.drives.is_empty() { &usual } else { arguments.drives.as_slice() } {
        let spec = find(name)?;
        let DriveLog { log, truth, .. } = DriveLog::open(&spec, &arguments.out)?;
        World { name, log: log.as_ref(), truth: &truth }.errors()?;
    }
    let (log, runs) = room(1, &arguments.out.join("rooms"))?;
    World { name: "room 1", log: log.as_ref(), truth: &runs[0].trajectory }.errors()?;
    if let Some(nclt) = arguments.data.as_ref().map(|data| data.join("nclt_revisit")) {
        let log = open_log(&nclt, &LogOptions::default())?;
        let truth = read_trajectory(&nclt.join("poses_lidar_odometry.txt"))?.trajectory;
        World { name: "nclt_revisit", log: log.as_ref(), truth: &truth }.errors()?;
    }
    Ok(())
}

fn right(arguments: &ConventionsArgs) -> anyhow::Result<()> {
    println!(
        "\ncorrect runs\n\n| world | runs | excluded | reported | off, and too little to be reported |\n|---|---|---|---|---|"
    );
    for seed in 1..=3 {
        let (log, runs) = room(seed, &arguments.out.join("rooms"))?;
        World { name: &format!("room {seed}"), log: log.as_ref(), truth: &runs[0].trajectory }
            .right(&runs)?;
    }
    for spec in drives() {
        let DriveLog { log, truth, .. } = DriveLog::open(&spec, &arguments.out)?;
        let runs: Vec<Run> = simulated(&spec, &truth)?
            .into_iter()
            .map(|estimate| Run::new(estimate.name, estimate.trajectory))
            .collect();
        World { name: spec.name, log: log.as_ref(), truth: &truth }.right(&runs)?;
    }
    Ok(())
}

/// A log and its truth.
struct World<'a> {
    name: &'a str,
    log: &'a dyn ScanLog,
    truth: &'a Trajectory,
}

/// An error that is made, in seconds, radians or metres.
struct Made {
    axis: Axis,
    value: f64,
}

impl World<'_> {
    /// Each error by itself.
    fn errors(&self) -> anyhow::Result<()> {
        let made = all_errors();
        let runs: Vec<Run> = made.iter().enumerate().map(|(k, made)| self.with(k, made)).collect();
        let plain = vet(self.log, &[Run::new("plain", self.truth.clone())], &Config::default(), false, &())?;
        let vetted = vet(self.log, &runs, &Config::default(), false, &())?;
        let Some(zero) = plain.found[0].calibration.as_ref() else {
            println!("| {} | nothing is seen ||||||", self.name);
            return Ok(());
        };
        for axis in Axis::ALL.into_iter().filter(|&axis| axis != Axis::Sweep) {
            let of_axis: Vec<_> =
                made.iter().zip(&vetted.found).filter(|(made, _)| made.axis == axis).collect();
            let (mut found, mut inside, mut estimated) = (0, 0, 0);
            for (made, of_run) in &of_axis {
                let Some(calibration) = &of_run.calibration else { continue };
                let one = calibration.of(axis);
                estimated += 1;
                found += usize::from(one.is_off);
                inside += usize::from((one.value - zero.of(axis).value + made.value).abs() <= one.half);
            }
            let (half, seen) = (zero.of(axis).half, if zero.of(axis).is_seen { "yes" } else { "no" });
            println!(
                "| {} | {} | {seen} | {} | {} | {found} | {inside} of {estimated} |",
                self.name,
                axis.name(),
                in_units(axis, half),
                of_axis.len()
            );
        }
        Ok(())
    }

    /// The truth with an error.
    fn with(&self, number: usize, made: &Made) -> Run {
        let mut run = Run::new(format!("{number}"), self.truth.clone());
        let of = |axis: Axis| if made.axis == axis { made.value } else { 0.0 };
        run.time_offset_ns = Some((of(Axis::Time) * 1e9).round() as i64);
        run.body_from_sensor = Some(Isometry3::new(
            Vector3::new(of(Axis::X), of(Axis::Y), of(Axis::Z)),
            Vector3::new(of(Axis::Roll), of(Axis::Pitch), of(Axis::Yaw)),
        ));
        run
    }

    /// Runs with errors of their poses alone.
    fn right(&self, runs: &[Run]) -> anyhow::Result<()> {
        let vetted = vet(self.log, runs, &Config::default(), false, &())?;
        let excluded = vetted.found.iter().filter(|found| !found.is_kept()).count();
        let (mut reported, mut little) = (Vec::new(), Vec::new());
        for found in &vetted.found {
            let Some(calibration) = &found.calibration else { continue };
            for one in calibration.off() {
                let off = format!(
                    "{}: {} {} ± {}",
                    found.name,
                    one.axis.name(),
                    in_units(one.axis, one.value),
                    in_units(one.axis, one.half)
                );
                if one.pays { reported.push(off) } else { little.push(off) }
            }
        }
        let [reported, little] =
            [reported, little].map(|off| if off.is_empty() { "nothing".to_owned() } else { off.join("; ") });
        println!("| {} | {} | {excluded} | {reported} | {little} |", self.name, runs.len());
        Ok(())
    }
}

fn all_errors() -> Vec<Made> {
    let sides = |values: &[f64], factor: f64| -> Vec<f64> {
        values.iter().flat_map(|value| [-value * factor, value * factor]).collect()
    };
    let of = |axis: Axis| {
        let values = match axis {
            Axis::Time => sides(&TIMES_MS, 1e-3),
            Axis::Sweep => Vec::new(),
            Axis::Roll | Axis::Pitch | Axis::Yaw => sides(&ANGLES_DEG, 1.0_f64.to_radians()),
            Axis::X | Axis::Y | Axis::Z => sides(&LENGTHS_CM, 0.01),
        };
        values.into_iter().map(move |value| Made { axis, value })
    };
    Axis::ALL.into_iter().flat_map(of).collect()
}

fn in_units(axis: Axis, value: f64) -> String {
    match axis {
        Axis::Time => format!("{:.2} ms", 1e3 * value),
        Axis::Sweep => format!("{value:.3}"),
        Axis::Roll | Axis::Pitch | Axis::Yaw => format!("{:.3}°", value.to_degrees()),
        Axis::X | Axis::Y | Axis::Z => format!("{:.2} cm", 100.0 * value),
    }
}
