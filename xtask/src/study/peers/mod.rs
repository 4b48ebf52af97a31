//! `cargo xtask study peers`: the scores and the map metrics MME, MPV and MOM of others, beside the truth.
//!
//! MME and MPV are the mean map entropy and the mean plane variance (Razlaw et al. 2015), MOM the mutually orthogonal metric
//! (Kornilova & Ferrer 2021). Definitions and settings are those of the Python package map-metrics 0.0.4; lower is better.

mod grid;
mod orthogonal;
mod sharpness;
mod ward;

use anyhow::Context as _;
use dmp::{Config, Run, RunReport, Watch};
use dmp_truth::rank::kendall_tau_b;

use self::orthogonal::{mutually_orthogonal, orthogonal_planes};
use self::sharpness::sharpness;
use super::chosen::Chosen;
use super::clouds::{Clouds, RunClouds};
use super::drives::DriveSpec;
use super::estimates::{ate_m, estimates};
use super::logs::DriveLog;

/// Compare the scores and the map metrics MME, MPV and MOM with the trajectory error
#[derive(Debug, clap::Args)]
pub(super) struct PeersArgs {
    #[command(flatten)]
    chosen: Chosen,
}

/// The columns of the tables.
const COLUMNS: [&str; 7] = ["ATE m", "R_cv(10)", "R_near(5)", "DMP mean", "MME", "MPV", "MOM"];
/// The values of a run, or of a row of correlations.
type Values = [Option<f64>; COLUMNS.len()];

pub(super) fn run(arguments: &PeersArgs) -> anyhow::Result<()> {
    let mut taus: Vec<Values> = Vec::new();
    for spec in &arguments.chosen.drives()? {
        let rows = drive(spec, &arguments.chosen).with_context(|| spec.name.to_owned())?;
        println!("\n{} ({})", spec.name, spec.about);
        row("estimate", &COLUMNS.map(|name| format!("{name:>11}")));
        for (name, values) in &rows {
            row(name, &values.map(cell));
        }
        let column = |k: usize| rows.iter().map(|(_, values)| values[k]).collect::<Vec<_>>();
        let ates_m = column(0);
        let tau = std::array::from_fn(|k| kendall_tau_b(&column(k), &ates_m));
        row("tau with ATE", &tau.map(cell));
        taus.push(tau);
    }
    let mean: Values = std::array::from_fn(|k| {
        let known: Vec<f64> = taus.iter().filter_map(|tau| tau[k]).collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    });
    println!();
    row("mean tau", &mean.map(cell));
    Ok(())
}

fn row(name: &str, cells: &[String; COLUMNS.len()]) {
    println!("{name:<18}{}", cells.concat());
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(|| format!("{:>11}", "–"), |value| format!("{value:>11.5}"))
}

/// The estimates of a drive with their values.
fn drive(spec: &DriveSpec, chosen: &Chosen) -> anyhow::Result<Vec<(String, Values)>> {
    let DriveLog { log, truth, fine } = DriveLog::open(spec, &chosen.out)?;
    let mut estimates = estimates(spec, &truth)?;
    estimates.retain(|estimate| chosen.wants(estimate));
    let runs: Vec<Run> = estimates.iter().map(|e| Run::new(&e.name, e.trajectory.clone())).collect();
    let clouds = Clouds::default();
    let report = dmp::evaluate(log.as_ref(), &runs, &Config::default(), Watch::sink(&clouds))?;
    let clouds = clouds.finish();
    let moms = moms(&clouds);
    let values = |(index, run): (usize, &Run)| {
        let scores: &RunReport = &report.runs[index];
        let (mme, mpv_m2) = sharpness(&clouds.thinned[index]);
        let values = [
            Some(ate_m(&run.trajectory, &fine)?),
            scores.r_cv_m2.at(10.0),
            scores.r_near_m2.at(5.0),
            scores.dmp_mean_m2,
            mme,
            mpv_m2,
            moms[index],
        ];
        Ok((run.name.clone(), values))
    };
    runs.iter().enumerate().map(values).collect()
}

/// MOM of every run, around the same returns: those of the run in whose first scans most are on planes at right angles.
fn moms(clouds: &RunClouds) -> Vec<Option<f64>> {
    let planes = clouds.first.iter().filter_map(|scans| orthogonal_planes(scans));
    let count = |planes: &[Vec<usize>; 3]| planes.iter().map(Vec::len).sum::<usize>();
    let Some(planes) = planes.max_by_key(count) else { return vec![None; clouds.thinned.len()] };
    let of_run = |(scans, cloud): (&Vec<[f64; 3]>, &Vec<[f64; 3]>)| {
        let places = planes.each_ref().map(|points| points.iter().map(|&k| scans[k]).collect::<Vec<_>>());
        mutually_orthogonal(cloud, &places)
    };
    clouds.first.iter().zip(&clouds.thinned).map(of_run).collect()
}
