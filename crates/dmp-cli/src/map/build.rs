//! `dmp map build`: a map from a log and a trajectory, a cloud or a mesh.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use dmp::{Config, EvaluateError, MapSource, fuse_maps, map_of_cloud};
use dmp_disk::{OutputFile, Unfinished, WorkFolder, folder_of, is_own_folder};
use dmp_draw::text;
use dmp_map::Store;

use crate::common::Common;
use crate::exit::{Exit, Usage, one_line};
use crate::log_args::LogArgs;
use crate::named::NamedFile;
use crate::progress::Progress;
use crate::runs::{OpenedRuns, Runs};
use crate::save::{may_be_file, take_folder};
use crate::say::say;
use crate::score::parse;
use crate::settings::{ResumeArgs, SettingsArgs};
use crate::trajectory_args::TrajectoryArgs;

/// Build a map from a log and a trajectory, or from a cloud or a mesh
///
/// The map is the one that `dmp score` makes of the same run; `dmp score --map` takes it.
#[derive(Debug, Args)]
#[command(
    override_usage = "dmp map build [OPTIONS] LOG -t RUN.tum -o MAP.dmpmap\n       dmp map build [OPTIONS] CLOUD -o MAP.dmpmap",
    after_help = "Examples:\n  \
    dmp map build drive.mcap -t run.tum -o run.dmpmap\n  \
    dmp map build city.mcap -t run.tum -o city.dmpmap --resume\n  \
    dmp map build survey.laz -o survey.dmpmap --voxel 0.3"
)]
pub(crate) struct BuildArgs {
    /// The trajectory of a log: as for `dmp score`. Without one, LOG is a cloud or a mesh
    #[arg(short = 't', long = "trajectory", value_name = "RUN", help_heading = "Input")]
    trajectory: Option<NamedFile>,
    #[command(flatten)]
    reading: TrajectoryArgs,
    /// The unit of a cloud or mesh: `auto` (what the file says, else metres), `m`, `ft` or `us-ft`
    #[arg(long, value_name = "UNIT", default_value = "auto", help_heading = "Input")]
    map_unit: parse::AutoUnit,
    #[command(flatten)]
    log: LogArgs,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    resume: ResumeArgs,
    /// The map to write, FILE.dmpmap
    #[arg(short, long, value_name = "MAP", help_heading = "Output")]
    output: PathBuf,
}

pub(super) fn run(arguments: &BuildArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let config = Config { map_unit: arguments.map_unit.0, ..arguments.settings.config() };
    config.check()?;
    let (map, damaged) = match &arguments.trajectory {
        Some(trajectory) => from_log(arguments, trajectory, &config, common)?,
        None => (from_cloud(arguments, &config, common)?, false),
    };
    let tiles = text::counted(map.entries().count() as u64, "tile");
    writeln!(out, "{}: {} in {tiles}", arguments.output.display(), text::counted(map.surfels(), "surfel"))?;
    Ok(if damaged { Exit::InputDamaged } else { Exit::Done })
}

fn from_log(
    arguments: &BuildArgs,
    trajectory: &NamedFile,
    config: &Config,
    common: &Common,
) -> anyhow::Result<(Store, bool)> {
    let started = Runs::start(std::slice::from_ref(trajectory), &arguments.reading)?;
    let OpenedRuns { log, runs, damaged } = OpenedRuns::open(
        started,
        [MapSource::Fused],
        &arguments.log,
        arguments.settings.poses(),
        config.threads,
        common,
    )?;
    let beside = Beside::new(&arguments.output)?;
    let config =
        arguments.resume.in_config(Config { save_maps: Some(beside.folder.clone()), ..config.clone() });
    let progress = Progress::new(common);
    let maps = fuse_maps(log.as_ref(), &runs, &config, &progress)?;
    drop(progress);
    let made = maps.iter().next().map(|(_, map)| map.path().to_path_buf());
    let map = Beside::give_place(&made.context("no map was made")?, &arguments.output)?;
    say_if_empty(EvaluateError::if_empty(&arguments.output, &map, None, 0), common);
    Ok((map, damaged))
}

fn from_cloud(arguments: &BuildArgs, config: &Config, common: &Common) -> anyhow::Result<Store> {
    let cloud = arguments.log.path();
    if cloud.is_dir() || cloud.extension().is_some_and(|e| e == "mcap" || e == "db3") {
        let problem = "it looks like a log: a map of it needs its trajectory, -t RUN.tum";
        return Err(Usage(format!("{}: {problem}", cloud.display())).into());
    }
    let beside = Beside::new(&arguments.output)?;
    let progress = Progress::new(common);
    let made = map_of_cloud(cloud, &beside.map(), config, &progress)?;
    drop(progress);
    if made.points_dropped > 0 && !common.quiet {
        say!(common.host, "note: {} not finite, left out", text::counted(made.points_dropped, "point"));
    }
    let checked = EvaluateError::if_empty(cloud, &made.store, Some(made.thin_voxels), made.points_dropped);
    match (made.thin_voxels, made.sparse(), made.store.surfels()) {
        // What was there before stays.
        (0, ..) => checked?,
        (_, Some(sparse), 1..) if !common.quiet => {
            say!(common.host, "warning: {}: {sparse} (--voxel)", cloud.display());
        }
        _ => say_if_empty(checked, common),
    }
    Beside::give_place(made.store.path(), &arguments.output)
}

/// A map without a surfel is one that `dmp score` will refuse.
fn say_if_empty(checked: Result<(), EvaluateError>, common: &Common) {
    if let (Err(empty), false) = (checked, common.quiet) {
        say!(common.host, "warning: {}", one_line(&empty.into()));
    }
}

/// The folder beside its place in which a map is made; it goes when this is dropped, with whatever is in it.
///
/// Its name is one of the map's: what a killed process left there is found, and the settings are the same when it is gone on
/// with.
struct Beside {
    folder: PathBuf,
    _unfinished: Unfinished,
    _taken: Option<File>,
    _elsewhere: Option<WorkFolder>,
}

impl Beside {
    fn new(output: &Path) -> anyhow::Result<Self> {
        let name =
            output.file_name().with_context(|| format!("{}: not the name of a file", output.display()))?;
        let name = format!(".dmp-map-{}", name.to_string_lossy());
        // Beside what is no file nothing can be made.
        let elsewhere =
            if may_be_file(output) { None } else { Some(WorkFolder::new(&std::env::temp_dir())?) };
        let folder = elsewhere.as_ref().map_or(folder_of(output), |folder| folder.path()).join(name);
        let made = match Unfinished::make(|| fs::create_dir(&folder).map(|()| (folder.clone(), ()))) {
            Ok((made, ())) => Some(made),
            // A killed process may have left it.
            Err(_) if is_own_folder(&folder) => None,
            Err(error) => {
                let context = || format!("{}: cannot make a folder for the map", folder.display());
                return Err(error).with_context(context);
            }
        };
        let taken = take_folder(&folder)?;
        // Until it is taken it may be another process's.
        let unfinished = made.unwrap_or_else(|| Unfinished::new(&folder));
        Ok(Self { folder, _unfinished: unfinished, _taken: taken, _elsewhere: elsewhere })
    }

    /// Where the map of a cloud is made.
    fn map(&self) -> PathBuf {
        self.folder.join("map.dmpmap")
    }

    /// Gives the map that was `made` in the folder its place.
    fn give_place(made: &Path, output: &Path) -> anyhow::Result<Store> {
        // It stays open where it is.
        let map = Store::open(made)?;
        OutputFile::give_place(made, output)
            .with_context(|| format!("{}: cannot write", output.display()))?;
        Ok(map)
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        // What cannot be removed is taken up by the next build of the same map.
        let _ = fs::remove_dir_all(&self.folder);
    }
}
