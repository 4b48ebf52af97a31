//! Studies: how well scores, drift and repairs agree with the truth, on drives whose truth is known.

mod chosen;
mod clouds;
mod consistency;
mod conventions;
mod drift;
mod drives;
mod estimates;
mod evaluate;
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
}

pub(crate) fn run(arguments: &StudyArgs) -> anyhow::Result<()> {
    match &arguments.task {
        StudyTask::Score(arguments) => score::run(arguments),
        StudyTask::Null(arguments) => null::run(arguments),
        StudyTask::Drift(arguments) => drift::run(arguments),
        StudyTask::Repair(arguments) => repair::run(arguments),
        StudyTask::Conventions(arguments) => conventions::run(arguments),
    }
}
