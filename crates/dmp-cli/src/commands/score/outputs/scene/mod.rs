//! The scene of `--scene`: all runs in one frame, for viewers.

mod clouds;
mod placed;

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use dmp::Report;
use dmp_draw::{SampledReturn, WorstPlace, colour_of_size, text, worst_places};
use dmp_log::{SceneHead, ScenePlace, SceneRun, SceneWriter};
use dmp_map::Store;
use dmp_sensor::Isometry3;

use super::gathered::Gathered;
use crate::console::Hosted;
use clouds::Shown;
use placed::{Placed, common_frame};

/// Maps and returns of so many runs are shown, the best ones.
const CLOUDS: usize = 6;
/// Points of a way at most.
const WAY: usize = 100_000;

/// A scene that has all but its end and its name.
#[derive(Debug)]
pub(super) struct Scene {
    path: PathBuf,
    writer: SceneWriter,
    about: BTreeMap<String, String>,
    shown: String,
}

impl Scene {
    /// Ends the file and gives it its name; says what it shows.
    pub(super) fn finish(self) -> anyhow::Result<String> {
        let Self { path, writer, about, shown } = self;
        writer.finish(about)?;
        // What is no file has no length.
        let bytes = std::fs::metadata(&path).ok().filter(std::fs::Metadata::is_file);
        Ok(bytes.map_or_else(|| shown.clone(), |found| format!("{}; {shown}", text::bytes(found.len()))))
    }
}

/// Writes everything but the end of the file, while the maps are there.
pub(super) fn draw(
    path: &Path,
    gathered: &Gathered,
    (report, maps): (&Report, &[&Store]),
    host: &Hosted,
) -> anyhow::Result<Scene> {
    let names: Vec<&str> = report.runs.iter().map(|run| run.name.as_str()).collect();
    let best = gathered.order.first().copied().unwrap_or(0);
    let (origin_m, map_from_world) = common_frame(gathered, names.len(), best);
    let placed = Placed { gathered, names, map_from_world };
    let clouds: Vec<usize> = gathered.order.iter().copied().take(CLOUDS).collect();
    let runs: Vec<SceneRun<'_>> = placed
        .names
        .iter()
        .enumerate()
        .map(|(run, name)| SceneRun { name, with_clouds: clouds.contains(&run) })
        .collect();
    let start_ns = gathered.start_ns.unwrap_or(0);
    let mut writer = SceneWriter::create(path, &SceneHead { start_ns, runs: &runs })?;
    let places = worst_places(&gathered.frames, runs.len(), gathered.scales);
    for (run, places) in places.iter().enumerate() {
        placed.write_way(&mut writer, run)?;
        placed.write_places(&mut writer, run, places)?;
    }
    let mut surfels = Shown::default();
    for &run in &clouds {
        host.go_on()?;
        surfels.add(placed.write_map(&mut writer, run, maps[run], host)?);
    }
    let mut returns = Shown { of: clouds.iter().map(|&run| report.runs[run].returns).sum(), shown: 0 };
    returns.shown = placed.play(&mut writer, &clouds, &places, host)?;
    let shown = shown_in_words(&surfels, &returns, (clouds.len(), runs.len()), placed.way_every());
    let [x, y, z] = origin_m;
    let frame = format!(
        "{} with its origin at {x} {y} {z} of its world, metres; each other run is turned and moved as one piece so that its poses lie \
         best on those of that one",
        placed.names.get(best).copied().unwrap_or_default()
    );
    let about = [("map", frame), ("shown", shown.clone())].map(|(name, text)| (name.to_owned(), text));
    Ok(Scene { path: path.to_owned(), writer, about: about.into(), shown })
}

/// What is shown of what there is.
fn shown_in_words(
    surfels: &Shown,
    returns: &Shown,
    (clouds, runs): (usize, usize),
    way_every: usize,
) -> String {
    let of_runs = if clouds < runs { format!(" of the {clouds} best of {runs} runs") } else { String::new() };
    let ways =
        if way_every > 1 { format!("; paths of one scan of every {way_every}") } else { String::new() };
    format!("{} surfels and {} returns{of_runs}{ways}", surfels.in_words(), returns.in_words())
}

impl Placed<'_> {
    /// One scan of so many is a point of the ways.
    fn way_every(&self) -> usize {
        self.gathered.frames.len().div_ceil(WAY).max(1)
    }

    fn write_way(&self, writer: &mut SceneWriter, run: usize) -> anyhow::Result<()> {
        let frames = &self.gathered.frames;
        let chosen = || (0..frames.len()).step_by(self.way_every());
        let mut cloud = writer.start_marks(chosen().len())?;
        for frame in chosen() {
            let at_m = self.at(run, frames[frame].position_in_world_m[run]);
            cloud.push(&self.point_in_map(at_m, self.off_m(frame, run)));
        }
        let pose = |frame: usize| {
            Some((frames[frame].stamp_ns?, self.map_from_world[run] * self.gathered.poses[frame][run]))
        };
        let poses: Vec<(i64, Isometry3<f64>)> = chosen().filter_map(pose).collect();
        Ok(writer.way(run, cloud, &poses)?)
    }

    fn write_places(
        &self,
        writer: &mut SceneWriter,
        run: usize,
        places: &[WorstPlace],
    ) -> anyhow::Result<()> {
        let mut cloud = writer.start_marks(places.len())?;
        let mut texts = Vec::new();
        for (number, place) in places.iter().enumerate() {
            let place_in_map_m = self.at(run, place.centre_in_world_m);
            cloud.push(&self.point_in_map(place_in_map_m, place.off_m(self.scales()).map(|m| m as f32)));
            let text = format!("{} {}", self.names[run], self.place_in_words(number, place));
            texts.push(ScenePlace { place_in_map_m, text });
        }
        Ok(writer.places(run, cloud, (&texts, colour_of_size(Some(self.cut_m()), self.scales())))?)
    }

    fn place_in_words(&self, number: usize, place: &WorstPlace) -> String {
        format!("place {}: {}", number + 1, place.in_words(&self.names, self.scales()))
    }

    /// Writes scan by scan, in the order of the log, where the sensor of every run is, how much its map is off, and the returns of
    /// those runs that have clouds; tells how many returns.
    fn play(
        &self,
        writer: &mut SceneWriter,
        clouds: &[usize],
        places: &[Vec<WorstPlace>],
        host: &Hosted,
    ) -> anyhow::Result<u64> {
        let texts = self.texts_by_frame(places);
        let mut in_log: Vec<usize> = (0..self.gathered.frames.len()).collect();
        in_log.sort_by_key(|&frame| self.gathered.frames[frame].number);
        let mut left = in_log.into_iter().peekable();
        let mut scan = Vec::new();
        let mut shown = 0;
        self.gathered.each(host, |number, returns, is_last| {
            scan.extend_from_slice(returns);
            if !is_last {
                return Ok(());
            }
            while let Some(frame) = left.next_if(|&frame| self.gathered.frames[frame].number <= number) {
                self.write_poses(writer, frame, &texts)?;
                if self.gathered.frames[frame].number == number {
                    for &run in clouds {
                        shown += self.write_returns(writer, frame, run, &scan)?;
                    }
                }
            }
            scan.clear();
            Ok(())
        })?;
        for frame in left {
            self.write_poses(writer, frame, &texts)?;
        }
        Ok(shown)
    }

    /// The messages of each run, by the scans at which they are.
    fn texts_by_frame(&self, places: &[Vec<WorstPlace>]) -> HashMap<usize, Vec<(usize, String)>> {
        let mut texts: HashMap<usize, Vec<(usize, String)>> = HashMap::new();
        for (number, place) in places.iter().flat_map(|of_run| of_run.iter().enumerate()) {
            let Some(pass) = place.passes.first() else { continue };
            texts.entry(pass.frames[0]).or_default().push((place.run, self.place_in_words(number, place)));
        }
        texts
    }

    fn write_poses(
        &self,
        writer: &mut SceneWriter,
        frame: usize,
        texts: &HashMap<usize, Vec<(usize, String)>>,
    ) -> anyhow::Result<()> {
        let Some(stamp_ns) = self.gathered.frames[frame].stamp_ns else { return Ok(()) };
        for (run, map_from_world) in self.map_from_world.iter().enumerate() {
            let pose = map_from_world * self.gathered.poses[frame][run];
            let off_m = self.off_m(frame, run).unwrap_or(f32::NAN);
            writer.pose(run, (stamp_ns, &pose), [off_m, self.cut_m()])?;
        }
        for (run, text) in texts.get(&frame).into_iter().flatten() {
            writer.tell(*run, stamp_ns, text)?;
        }
        Ok(())
    }

    fn write_returns(
        &self,
        writer: &mut SceneWriter,
        frame: usize,
        run: usize,
        scan: &[[u8; SampledReturn::BYTES]],
    ) -> anyhow::Result<u64> {
        let Some(stamp_ns) = self.gathered.frames[frame].stamp_ns else { return Ok(0) };
        let runs = self.names.len().max(1);
        let sensor_from_axes = self.gathered.poses[frame][run].rotation.inverse();
        let mut cloud = writer.start_returns(run, stamp_ns, scan.len() / runs)?;
        for bytes in scan.iter().skip(run).step_by(runs) {
            let sampled = SampledReturn::of_bytes(bytes);
            clouds::push_return(&mut cloud, &sampled, &sensor_from_axes, self.scales());
        }
        Ok(u64::from(writer.returns(run, stamp_ns, cloud)?))
    }
}
