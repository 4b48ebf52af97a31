//! `dmp truth study`: every score beside ground truth.

mod render;

use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use dmp::MapSource;
use dmp_log::{LogError, is_mesh, read_cloud, read_mesh, read_trajectory};
use dmp_study::peers::PeerOptions;
use dmp_study::{ReferenceSurface, Study, StudyError, StudyOptions, TruthOptions, plots_of, study};
use dmp_truth::surface::Reference;

use crate::common::Common;
use crate::exit::{Exit, Usage};
use crate::host::Hosted;
use crate::log_args::LogArgs;
use crate::named::NamedFile;
use crate::progress::Progress;
use crate::runs::{OpenedRuns, Runs};
use crate::save::{OutputsFolder, SavedTogether, is_missing};
use crate::say::say;
use crate::score::announce;
use crate::settings::SettingsArgs;
use crate::trajectory_args::TrajectoryArgs;

/// Every score of several runs beside ground truth, and how well they rank alike
///
/// Scores the runs as `dmp score` does, measures each against a reference trajectory and perhaps a reference
/// map, takes the map metrics MME, MPV and MOM besides, and says how alike they rank the runs. docs/study.md
/// has the meaning of every column.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp truth study [OPTIONS] LOG -t [NAME=]RUN.tum … --reference TRUTH.tum",
    after_help = "Examples:\n  \
    dmp truth study drive.mcap -t runs/*.tum --reference rtk.tum --plots figures/\n  \
    dmp truth study drive.mcap -t runs/*.tum --reference rtk.tum --reference-map survey.laz --json\n\n\
    Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but part of the log was lost or damaged."
)]
pub(crate) struct StudyArgs {
    /// A run: its trajectory, world_from_body in metres: a file or a topic, as for dmp score. Called NAME, or
    /// like the file
    #[arg(short = 't', long = "trajectory", value_name = "[NAME=]RUN", help_heading = "Input")]
    #[arg(required_unless_present = "more")]
    trajectories: Vec<NamedFile>,
    #[command(flatten)]
    reading: TrajectoryArgs,
    /// The true trajectory of the same body, in a world of its own
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    reference: PathBuf,
    /// The true surface, in the world of --reference: a mesh (PLY with faces, OBJ) or a cloud (LAS, LAZ, PLY)
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    reference_map: Option<PathBuf>,
    #[command(flatten)]
    log: LogArgs,
    /// More runs: what a shell makes of `-t runs/*.tum`
    #[arg(value_name = "[NAME=]RUN", hide = true)]
    more: Vec<NamedFile>,
    #[command(flatten)]
    settings: SettingsArgs,

    /// Poses of run and reference belong together when their stamps are at most so far apart, seconds
    #[arg(long, value_name = "SECONDS", default_value_t = TruthOptions::default().max_diff_s)]
    #[arg(help_heading = "Ground truth")]
    max_diff: f64,
    /// Way between the two poses of a relative error, metres
    #[arg(long, value_name = "METRES", default_value_t = TruthOptions::default().rpe_delta_m)]
    #[arg(value_parser = crate::parse::length_m, help_heading = "Ground truth")]
    rpe_delta: f64,
    /// A point further from the reference map than this counts as this far, metres
    #[arg(long, value_name = "METRES", default_value_t = StudyOptions::default().surface_cap_m)]
    #[arg(value_parser = crate::parse::length_m, help_heading = "Ground truth")]
    cap: f64,

    /// Leave the metrics MME, MPV and MOM out
    #[arg(long, overrides_with = "peers", help_heading = "Metrics of others")]
    no_peers: bool,
    /// Take the metrics MME, MPV and MOM: what is done anyway
    #[arg(long, hide = true, help_heading = "Metrics of others")]
    peers: bool,
    /// Points closer than this are neighbours, metres
    #[arg(long, value_name = "METRES", default_value_t = PeerOptions::default().radius_m)]
    #[arg(value_parser = crate::parse::length_m, help_heading = "Metrics of others")]
    peer_radius: f64,
    /// About so many returns stand for a run's map, in these metrics and in the surface distance
    #[arg(long, value_name = "N", default_value_t = StudyOptions::default().max_points)]
    #[arg(help_heading = "Metrics of others")]
    max_points: usize,

    /// Print one JSON object (schema dmp-study/1) instead of tables
    #[arg(long, help_heading = "Output")]
    json: bool,
    /// Draw every score against ATE and SMD, and the runs' curves, as SVG in this folder; it is made if need be
    #[arg(long, value_name = "FOLDER", help_heading = "Output")]
    plots: Option<PathBuf>,
}

impl StudyArgs {
    fn options(&self) -> StudyOptions {
        let peers = PeerOptions { radius_m: self.peer_radius, ..PeerOptions::default() };
        StudyOptions {
            truth: TruthOptions { max_diff_s: self.max_diff, rpe_delta_m: self.rpe_delta },
            surface_cap_m: self.cap,
            peers: (!self.no_peers).then_some(peers),
            max_points: self.max_points,
            ..StudyOptions::default()
        }
    }
}

pub(crate) fn run(arguments: &StudyArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let config = arguments.settings.config();
    config.check()?;
    let files: Vec<NamedFile> = arguments.trajectories.iter().chain(&arguments.more).cloned().collect();
    let started = Runs::start(&files, &arguments.reading)?;
    let reference = read_trajectory(&arguments.reference)?;
    // Told before the log is read, not after.
    if let Some(path) = arguments.reference_map.as_ref().filter(|path| is_missing(path)) {
        return Err(LogError::NotFound { path: path.clone() }.into());
    }
    let _plots = arguments.plots.as_deref().map(OutputsFolder::make).transpose()?;
    let fused = std::iter::repeat(MapSource::Fused);
    let OpenedRuns { log, runs, damaged } =
        OpenedRuns::open(started, fused, &arguments.log, arguments.settings.poses(), config.threads, common)?;

    let feed = arguments.reference_map.as_deref().map(surface_of);
    let surface = feed.as_ref().map(|feed| feed as &ReferenceSurface<'_>);
    let progress = Progress::new(common);
    let options = arguments.options();
    let study = study(log.as_ref(), &runs, &reference.trajectory, surface, &config, &options, &progress);
    drop(progress);
    let study = study.map_err(told)?;

    if let Some(folder) = &arguments.plots {
        let mut pictures = SavedTogether::default();
        for picture in plots_of(&study) {
            pictures.add(&folder.join(&picture.file_name), |out| out.write_all(picture.svg.as_bytes()))?;
        }
        pictures.commit()?;
    }
    if arguments.json {
        serde_json::to_writer_pretty(&mut *out, &study).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        render::study(out, &study)?;
    }
    if !common.quiet {
        tell(&common.host, &study);
        announce::done(&common.host, &study.score);
    }
    Ok(if damaged { Exit::InputDamaged } else { Exit::Done })
}

/// Reads a mesh or a cloud into the reference.
fn surface_of(path: &Path) -> impl Fn(&mut Reference) -> Result<(), Box<dyn Error + Send + Sync>> {
    move |reference| {
        let read = if is_mesh(path)? {
            read_mesh(path, |batch| -> anyhow::Result<()> { Ok(reference.add_triangles(batch)?) }).map(|_| ())
        } else {
            read_cloud(path, None, |batch| -> anyhow::Result<()> { Ok(reference.add_points(batch)?) })
                .map(|_| ())
        };
        Ok(read?)
    }
}

/// The error with the exit code it deserves.
fn told(error: StudyError) -> anyhow::Error {
    match error {
        StudyError::Evaluate(error) => error.into(),
        StudyError::Setting { .. } => Usage(error.to_string()).into(),
        error => error.into(),
    }
}

fn tell(host: &Hosted, study: &Study) {
    let warnings = study.score.warnings.iter().map(ToString::to_string);
    for note in study.notes.iter().cloned().chain(warnings) {
        say!(host, "note: {note}");
    }
}
