//! Studies: how well scores, drift and repairs agree with the truth, on drives whose truth is known.

mod chosen;
mod clouds;
mod consistency;
mod conventions;
mod drift;
mod drives;
mod estimates;
mod evaluate;
mod export;
mod interval;
mod judge;
mod logs;
mod noisy;
mod null;
mod observe;
mod repair;
mod result;
mod rooms;
mod rule;
mod score;
mod tables;
mod truth;

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Measure accuracy on simulated drives whose truth is known
#[derive(Debug, Args)]
pub(crate) struct StudyArgs {
    #[command(subcommand)]
    task: StudyTask,
}

#[derive(Debug, Subcommand)]
enum StudyTask {
    Score(score::ScoreArgs),
    Null(null::NullArgs),
    Drift(drift::DriftArgs),
    Repair(repair::RepairArgs),
    Conventions(conventions::ConventionsArgs),
    /// Write a drive as a folder of scans with times, and its truth beside it as FOLDER.truth.tum
    ///
    /// xtask/odometry/odometry.py reads the folder.
    Export {
        /// Name of the drive, e.g. loop-64
        drive: String,
        /// The folder to create
        #[arg(short, long, value_name = "FOLDER")]
        output: PathBuf,
    },
}

pub(crate) fn run(arguments: &StudyArgs) -> anyhow::Result<()> {
    match &arguments.task {
        StudyTask::Score(arguments) => score::run(arguments),
        StudyTask::Null(arguments) => null::run(arguments),
        StudyTask::Drift(arguments) => drift::run(arguments),
        StudyTask::Repair(arguments) => repair::run(arguments),
        StudyTask::Conventions(arguments) => conventions::run(arguments),
        StudyTask::Export { drive, output } => export::export(&drives::find(drive)?, output),
    }
}
