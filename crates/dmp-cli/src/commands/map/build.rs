//! `dmp map build`: a map from a log and a trajectory, a cloud or a mesh.

use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use dmp::{Config, EvaluateError, MapSource, fuse_maps, map_of_cloud};
use dmp_disk::{OutputFile, Unfinished, WorkFolder, folder_of, is_own_folder};
use dmp_draw::text;
use dmp_log::has_bag_name;
use dmp_map::Store;

use crate::console::{Common, Exit, Progress, Usage, one_line, say};
use crate::files::{may_be_file, take_folder};
use crate::inputs::{LogInput, OpenedRuns, Runs};
use crate::options::{Asked, Out, Spec, input, scoring, tools};

pub(super) static SPEC: Spec = Spec {
    name: "build",
    about: "Build a map from a log and a trajectory, or from a cloud or a mesh",
    more: "The map is the one that `dmp score` makes of the same run. `dmp score --map` scores against it.",
    usage: "dmp map build [OPTIONS] LOG -t RUN.tum -o MAP.dmpmap\n       dmp map build [OPTIONS] CLOUD -o MAP.dmpmap",
    after: "Examples:\n  \
            dmp map build drive.mcap -t run.tum -o run.dmpmap\n  \
            dmp map build city.mcap -t run.tum -o city.dmpmap --resume\n  \
            dmp map build survey.laz -o survey.dmpmap --voxel 0.3",
    options: &[
        &[&input::LOG, &tools::RUN_OF_MAP, &input::POSES_AS, &input::BETWEEN, &scoring::MAP_UNIT],
        input::READING,
        &[&input::EXTRINSIC, &input::MAX_TIME_GAP, &input::TIME_OFFSET, &input::POSE_AT],
        scoring::MAPPING,
        scoring::MEANS,
        &[&scoring::RESUME, &tools::BUILT],
    ],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let config = asked.config();
    config.check()?;
    let (log, output) = (LogInput::of(asked)?, asked.need(&tools::BUILT)?);
    let (map, damaged) = match asked.get(&tools::RUN_OF_MAP) {
        Some(_) => from_log(asked, &log, &output, config, common)?,
        None => (from_cloud(&log.path, &output, &config, common)?, false),
    };
    let tiles = text::counted(map.entries().count() as u64, "tile");
    writeln!(out, "{}: {} in {tiles}", output.display(), text::counted(map.surfels(), "surfel"))?;
    Ok(if damaged { Exit::InputDamaged } else { Exit::Done })
}

fn from_log(
    asked: &Asked,
    log: &LogInput,
    output: &Path,
    config: Config,
    common: &Common,
) -> anyhow::Result<(Store, bool)> {
    let started = Runs::start(asked)?;
    let opened = OpenedRuns::open(started, [MapSource::Fused], log, asked, config.threads, common)?;
    let OpenedRuns { log, runs, damaged, .. } = opened;
    let beside = Beside::new(output)?;
    let config = Config { save_maps: Some(beside.folder.clone()), ..config };
    let progress = Progress::new(common);
    let maps = fuse_maps(log.as_ref(), &runs, &config, &progress)?;
    drop(progress);
    let made = maps.iter().next().map(|(_, map)| map.path().to_path_buf());
    let map = Beside::give_place(&made.context("no map was made")?, output)?;
    say_if_empty(EvaluateError::if_empty(output, &map, None, 0), common);
    Ok((map, damaged))
}

fn from_cloud(cloud: &Path, output: &Path, config: &Config, common: &Common) -> anyhow::Result<Store> {
    if cloud.is_dir() || has_bag_name(cloud) {
        let problem = "it looks like a log: a map of it needs its trajectory, -t RUN.tum";
        return Err(Usage(format!("{}: {problem}", cloud.display())).into());
    }
    let beside = Beside::new(output)?;
    let progress = Progress::new(common);
    let made = map_of_cloud(cloud, &beside.map(), config, &progress)?;
    drop(progress);
    if made.points_dropped > 0 && !common.quiet {
        say!(common.host, "note: {} not finite, excluded", text::counted(made.points_dropped, "point"));
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
    Beside::give_place(made.store.path(), output)
}

/// A map without a surfel is one that `dmp score` will refuse.
fn say_if_empty(checked: Result<(), EvaluateError>, common: &Common) {
    if let (Err(empty), false) = (checked, common.quiet) {
        say!(common.host, "warning: {}", one_line(&empty.into()));
    }
}

/// The folder beside its place in which a map is made; it goes when this is dropped, with whatever is in it.
///
/// Its name is one of the map's: what a killed process left there is found, and the settings are the same when it resumes.
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
        // What cannot be removed is found by the next build of the same map.
        let _ = fs::remove_dir_all(&self.folder);
    }
}
