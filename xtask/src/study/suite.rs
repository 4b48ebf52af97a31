//! Three settings of a real odometry over many drives: does the verdict over all logs agree with the truth?

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context as _, ensure};
use clap::Args;
use dmp::{SuitePairReport, SuiteReport};
use dmp_log::read_trajectory;
use dmp_reduce::sign_test;
use dmp_sim::{LidarOptions, RecordingOptions, Route, Scenery};

use super::drives::{DriveSpec, Half};
use super::estimates::ate_m;
use super::export::export;
use crate::trials::command;

/// The settings of `xtask/odometry/odometry.py`.
const VERSIONS: [&str; 3] = ["coarse", "rigid", "default"];
/// The drives are seeds from here on.
const FIRST_SEED: u64 = 201;
const NAMES: [&str; 16] = [
    "drive-01", "drive-02", "drive-03", "drive-04", "drive-05", "drive-06", "drive-07", "drive-08",
    "drive-09", "drive-10", "drive-11", "drive-12", "drive-13", "drive-14", "drive-15", "drive-16",
];

/// Compares three settings of KISS-ICP over simulated drives by `dmp suite` and by the truth
#[derive(Debug, Args)]
pub(crate) struct SuiteArgs {
    /// The folder for drives, runs, suite and results; what is there is used as it is
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// A Python that has what xtask/odometry/README.md names
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    python: PathBuf,
    /// The command, if it is not beside this program
    #[arg(long, value_name = "PROGRAM")]
    dmp: Option<PathBuf>,
    /// How many drives
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(2..=16))]
    drives: u64,
    /// Scans of each
    #[arg(long, value_name = "N", default_value_t = 400)]
    scans: usize,
}

pub(crate) fn run(arguments: &SuiteArgs) -> anyhow::Result<()> {
    let dmp = command(arguments.dmp.as_deref())?;
    let folder = &arguments.output;
    let began = Instant::now();
    let specs: Vec<DriveSpec> = (0..arguments.drives).map(|k| spec(k, arguments.scans)).collect();
    for spec in &specs {
        make(spec, arguments)?;
    }
    println!("drives and runs: {:.0} s", began.elapsed().as_secs_f64());
    fs::write(folder.join("suite.toml"), suite(&specs))?;
    let mut printed = Vec::new();
    for what in ["first", "second"] {
        let began = Instant::now();
        printed.push(called(&dmp, folder, &["suite", "suite.toml", "--quiet"])?);
        println!("the {what} time: {:.2} s", began.elapsed().as_secs_f64());
    }
    ensure!(printed[0] == printed[1], "the cache changes the answer");
    println!("\n{}", printed[0]);
    let report: SuiteReport =
        serde_json::from_str(&called(&dmp, folder, &["suite", "suite.toml", "--quiet", "--json"])?)?;
    let errors: Vec<Vec<f64>> =
        specs.iter().map(|spec| errors_m(spec, folder)).collect::<anyhow::Result<_>>()?;
    println!(
        "Trajectory error (ATE, m)\n{:<12}{}",
        "drive",
        VERSIONS.map(|name| format!("{name:>10}")).concat()
    );
    for (spec, errors) in specs.iter().zip(&errors) {
        let errors: Vec<String> = errors.iter().map(|m| format!("{m:>10.3}")).collect();
        println!("{:<12}{}", spec.name, errors.concat());
    }
    println!();
    report.pairs.iter().try_for_each(|pair| compare(pair, &errors))
}

/// A verdict beside the truth: it must not be for the version whose errors are larger.
fn compare(pair: &SuitePairReport, errors_m: &[Vec<f64>]) -> anyhow::Result<()> {
    let place = |name: &str| VERSIONS.iter().position(|version| *version == name);
    let (Some(a), Some(b)) = (place(&pair.a), place(&pair.b)) else { return Ok(()) };
    let smaller = |one: usize, other: usize| errors_m.iter().filter(|m| m[one] < m[other]).count() as u64;
    let (of_a, of_b) = (smaller(a, b), smaller(b, a));
    let verdict = pair.better.as_deref().unwrap_or("not told apart");
    println!(
        "{} / {}: dmp {} : {}, {verdict}; ATE smaller on {of_a} : {of_b} drives (p = {:.4}), medians {:.3} and {:.3} m",
        pair.a,
        pair.b,
        pair.a_better,
        pair.b_better,
        sign_test(of_a, of_b),
        median(errors_m, a),
        median(errors_m, b)
    );
    let against = (pair.better.as_deref() == Some(&pair.a) && of_a < of_b)
        || (pair.better.as_deref() == Some(&pair.b) && of_b < of_a);
    ensure!(!against, "{} / {}: the verdict is against the truth", pair.a, pair.b);
    Ok(())
}

fn median(errors_m: &[Vec<f64>], version: usize) -> f64 {
    let mut values: Vec<f64> = errors_m.iter().map(|m| m[version]).collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}

/// Another town for every drive, and one way after the other.
fn spec(k: u64, scans: usize) -> DriveSpec {
    let route = [Route::Loop, Route::OutAndBack, Route::TwoLaps][(k % 3) as usize];
    let lidar = LidarOptions { azimuth_steps: 360, ..LidarOptions::with_beams(16) };
    let options = RecordingOptions { seed: FIRST_SEED + k, scans, route, speed_m_s: 9.0, traffic: 0, lidar };
    DriveSpec {
        name: NAMES[k as usize],
        half: Half::HeldOut,
        about: "a drive of the suite",
        options,
        scenery: Scenery::default(),
        poses_per_scan: 1,
    }
}

/// The scans of a drive, and the runs of all versions, as far as they are not there.
fn make(spec: &DriveSpec, arguments: &SuiteArgs) -> anyhow::Result<()> {
    let log = arguments.output.join("logs").join(spec.name);
    if !log.with_extension("truth.tum").exists() {
        fs::create_dir_all(arguments.output.join("logs"))?;
        export(spec, &log)?;
    }
    for version in VERSIONS {
        let run = run_path(&arguments.output, version, spec);
        if run.exists() {
            continue;
        }
        fs::create_dir_all(arguments.output.join("runs").join(version))?;
        let script = crate::workspace::root().join("xtask/odometry/odometry.py");
        let mut called = Command::new(&arguments.python);
        called.arg(script).arg(&log).arg(&run).args(["--config", version]);
        let ended = called.output().with_context(|| format!("{}", arguments.python.display()))?;
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        ensure!(ended.status.success(), "{} {version}: {said}", spec.name);
    }
    Ok(())
}

fn run_path(folder: &Path, version: &str, spec: &DriveSpec) -> PathBuf {
    folder.join("runs").join(version).join(format!("{}.tum", spec.name))
}

fn suite(specs: &[DriveSpec]) -> String {
    let logs: Vec<String> = specs.iter().map(|spec| format!("\"logs/{}\"", spec.name)).collect();
    let versions = VERSIONS.map(|name| format!("\"{name}\"")).join(", ");
    format!(
        "versions = [{versions}]\ntrajectories = \"runs/{{version}}/{{log}}.tum\"\nlogs = [{}]\n",
        logs.join(", ")
    )
}

fn called(dmp: &Path, folder: &Path, arguments: &[&str]) -> anyhow::Result<String> {
    let output = Command::new(dmp).args(arguments).current_dir(folder).output()?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    ensure!(output.status.success(), "dmp {}: {said}", arguments.join(" "));
    Ok(String::from_utf8(output.stdout)?)
}

/// The error of each version on a drive, after the best rigid alignment, metres.
fn errors_m(spec: &DriveSpec, folder: &Path) -> anyhow::Result<Vec<f64>> {
    let truth = read_trajectory(&folder.join("logs").join(spec.name).with_extension("truth.tum"))?.trajectory;
    let of = |version: &&str| ate_m(&read_trajectory(&run_path(folder, version, spec))?.trajectory, &truth);
    VERSIONS.iter().map(of).collect()
}
