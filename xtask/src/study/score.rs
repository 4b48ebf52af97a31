//! `cargo xtask study score`: every drive under every setting, then the tables.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};

use super::drives::{drives, find};
use super::evaluate::{evaluate, measure_drift_anew};
use super::result::DriveResult;
use super::setting::{Setting, settings};
use super::{pair_tables, tables};

/// What is scored, and where the results are kept.
#[derive(Debug, clap::Args)]
pub(super) struct ScoreArgs {
    /// Only these drives, comma-separated; all of them by default
    #[arg(long, value_delimiter = ',')]
    drives: Vec<String>,
    /// Only these settings, comma-separated, e.g. "default,voxel 0.2 m"; all of them by default
    #[arg(long, value_delimiter = ',')]
    settings: Vec<String>,
    /// Where scans and results are kept. Results that are there are taken as they are: remove the folder to
    /// score anew
    #[arg(long, default_value = "target/study", value_name = "FOLDER")]
    out: PathBuf,
    /// Score nothing, print the tables of what is there
    #[arg(long)]
    tables: bool,
    /// Measure drift anew for results that are there
    #[arg(long, conflicts_with = "tables")]
    drift: bool,
    /// Draw the figures into this folder
    #[arg(long, value_name = "FOLDER")]
    figures: Option<PathBuf>,
}

pub(super) fn run(arguments: &ScoreArgs) -> anyhow::Result<()> {
    let ScoreArgs { drives: only_drives, settings: only_settings, out, tables: tables_only, drift, figures } =
        arguments;
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    for name in only_drives {
        find(name)?;
    }
    for name in only_settings {
        let names: Vec<_> = settings().iter().map(|setting| setting.name).collect();
        ensure!(names.contains(&name.as_str()), "{name}: no such setting; they are {}", names.join(", "));
    }
    let wanted = |name: &str, only: &[String]| only.is_empty() || only.iter().any(|wanted| wanted == name);
    if !tables_only {
        for setting in settings().iter().filter(|setting| wanted(setting.name, only_settings)) {
            for spec in drives().iter().filter(|drive| wanted(drive.name, only_drives)) {
                let path = path_of(out, spec.name, setting);
                let result = if !path.exists() {
                    let result = evaluate(spec, setting, out)?;
                    eprintln!("{} under {}: {:.0} s", spec.name, setting.name, result.seconds);
                    result
                } else if *drift {
                    let mut result = read(&path)?;
                    measure_drift_anew(spec, setting, out, &mut result)?;
                    result
                } else {
                    continue;
                };
                std::fs::write(&path, serde_json::to_string(&result)?)
                    .with_context(|| path.display().to_string())?;
            }
        }
    }
    let results = results(out)?;
    print!("{}", tables_of(&results));
    if let Some(folder) = figures {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let default: Vec<&DriveResult> = results.iter().filter(|r| r.setting == "default").collect();
        for picture in super::figures::figures(&default) {
            let path = folder.join(picture.file_name);
            std::fs::write(&path, picture.svg).with_context(|| path.display().to_string())?;
        }
    }
    Ok(())
}

fn path_of(out: &Path, drive: &str, setting: &Setting) -> PathBuf {
    out.join(format!("{drive}.{}.json", setting.file_stem()))
}

fn read(path: &Path) -> anyhow::Result<DriveResult> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| path.display().to_string())
}

/// Every result that is kept, in the order of settings and drives.
fn results(out: &Path) -> anyhow::Result<Vec<DriveResult>> {
    let mut results = Vec::new();
    for setting in settings() {
        for spec in drives() {
            let path = path_of(out, spec.name, &setting);
            if path.exists() {
                results.push(read(&path)?);
            }
        }
    }
    Ok(results)
}

fn tables_of(results: &[DriveResult]) -> String {
    let under = |name: &str| -> Vec<&DriveResult> {
        results.iter().filter(|result| result.setting == name).collect()
    };
    let default = under("default");
    let half = |held_out: bool| -> Vec<&DriveResult> {
        default.iter().copied().filter(|result| result.held_out == held_out).collect()
    };
    let settings = settings();
    let chosen_under = |name: &str| -> Vec<&DriveResult> {
        under(name).into_iter().filter(|result| !result.held_out).collect()
    };
    let others = settings.iter().skip(1).map(|setting| (setting.name, chosen_under(setting.name)));
    let others: Vec<(&str, Vec<&DriveResult>)> = others.filter(|(_, drives)| !drives.is_empty()).collect();
    let (chosen, held_out) = (half(false), half(true));
    [
        pair_tables::grounds(&default),
        tables::single_scores(&default),
        pair_tables::pair_rules("Pairs, all drives", &default),
        pair_tables::pair_rules("Pairs, chosen drives", &chosen),
        pair_tables::pair_rules("Pairs, drives held out", &held_out),
        tables::beside_drift("Scores and drift, chosen drives", &chosen),
        tables::beside_drift("Scores and drift, drives held out", &held_out),
        pair_tables::cascades(&chosen, &held_out),
        pair_tables::errors_and_messages(&default),
        pair_tables::messages(&default),
        pair_tables::definitions(&chosen, &held_out),
        pair_tables::by_drive(&default),
        pair_tables::by_kind(&default),
        tables::truncations(&default),
        tables::by_setting(&others),
        pair_tables::contradictions(&default),
    ]
    .concat()
}
