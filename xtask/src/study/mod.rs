//! The study: how well scores tell good trajectories from bad ones, on drives whose truth is known.

mod beside;
mod chosen;
mod consistency;
mod conventions;
mod drift;
pub(crate) mod drives;
pub(crate) mod estimates;
mod evaluate;
mod export;
mod figures;
mod interval;
mod judge;
mod logs;
mod loops;
mod null;
mod observe;
mod pair_tables;
mod places;
mod removal;
mod repair;
mod restamped;
mod result;
mod rooms;
mod rule;
mod sample;
mod score;
mod setting;
mod suite;
mod survey;
mod tables;
mod trap;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use drives::{drives, find};
use export::export;

/// The simulated study: does the score rank maps as the truth does?
#[derive(Debug, Args)]
pub(crate) struct StudyArgs {
    #[command(subcommand)]
    task: StudyTask,
}

#[derive(Debug, Subcommand)]
enum StudyTask {
    /// Score the drives and print the tables
    Score(score::ScoreArgs),
    /// Draw samples of the drives' scans and tell how often they are right
    Sample(sample::SampleArgs),
    /// Draw samples of the drives' places and tell how often they are right
    Places(places::PlacesArgs),
    /// Score equal runs, which no command may tell apart, and runs of known order
    Null(null::NullArgs),
    /// Find errors of clock and mounting that were made, and none in right runs
    Conventions(conventions::ConventionsArgs),
    /// Rank loop candidates of the drives and tell how well
    Loops(loops::LoopsArgs),
    /// Measure drift where the drives come back and tell how near it is to what is true
    Drift(drift::DriftArgs),
    /// Repair the drives' estimates and tell how much nearer they come to the truth
    Repair(repair::RepairArgs),
    /// Score depth cameras in simulated rooms: the paper's own experiment
    Rooms(rooms::RoomsArgs),
    /// Compare three settings of a real odometry over simulated drives with `dmp suite`, and with the truth
    Suite(suite::SuiteArgs),
    /// Write a drive as a folder of scans with times, and its truth beside it as FOLDER.truth.tum
    Export {
        /// Name of the drive, e.g. loop-64
        drive: String,
        /// The folder to make
        #[arg(short, long, value_name = "FOLDER")]
        output: PathBuf,
    },
    /// Score four trajectories of one street, among them a collapsed one that other metrics prefer
    Trap {
        /// Which street
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Tell what the drives and their estimates are like
    Drives,
}

pub(crate) fn run(arguments: &StudyArgs) -> anyhow::Result<()> {
    match &arguments.task {
        StudyTask::Score(arguments) => score::run(arguments),
        StudyTask::Sample(arguments) => sample::run(arguments),
        StudyTask::Places(arguments) => places::run(arguments),
        StudyTask::Conventions(arguments) => conventions::run(arguments),
        StudyTask::Null(arguments) => null::run(arguments),
        StudyTask::Loops(arguments) => loops::run(arguments),
        StudyTask::Drift(arguments) => drift::run(arguments),
        StudyTask::Repair(arguments) => repair::run(arguments),
        StudyTask::Rooms(arguments) => rooms::run(arguments),
        StudyTask::Suite(arguments) => suite::run(arguments),
        StudyTask::Export { drive, output } => export(&find(drive)?, output),
        StudyTask::Trap { seed } => trap::run(*seed),
        StudyTask::Drives => drives().iter().try_for_each(survey::print),
    }
}
