//! `dmp simulate loops`: a pose graph with true and false loop candidates.

use std::io::Write;
use std::path::{Path, PathBuf};

use dmp_draw::text::{count, counted};
use dmp_log::{
    KeyframeTimes, read_keyframe_times_in, read_trajectory, write_keyframe_times, write_pose_edges,
    write_pose_graph, write_tum,
};
use dmp_sensor::{PoseEdge, Trajectory};
use dmp_sim::{LoopGraph, LoopGraphOptions, LoopKind, Scales, ate_rmse_m};

use super::error::in_words;
use super::recording::travel_m;
use crate::console::{Common, Exit, say};
use crate::files::{OutputsFolder, SavedTogether, refuse_same};
use crate::options::{Asked, Out, Spec, input, simulate};

pub(super) static SPEC: Spec = Spec {
    name: "loops",
    about: "Make a pose graph without loops from a true trajectory, and loop candidates with labels",
    more: "The graph is that of a SLAM front end: keyframes, and odometry between them that drifts. True candidates join \
           keyframes within 8 m of each other. False ones join places more than 40 m apart that look alike, measured within \
           2 m, in the same or the opposite direction. Near ones are true ones that are off by 3 to 10 m along the street, \
           labelled false. The keyframes of a candidate have more than 100 m of path between them. All claim the same standard \
           deviations (0.1 m, 0.5 degrees). With --room: 0.8 m and 30 degrees; 2.2 m or 90 degrees; 0.15 to 0.6 m; 5 m; 0.01 m. \
           The same seed gives the same files.",
    after: "Examples:\n  \
            dmp simulate loops town.truth.tum -o loops/\n  \
            dmp simulate loops room/groundtruth.txt --room -o loops/\n  \
            dmp simulate loops town.truth.tum --keyframes times.txt --spacing 2m -o loops/\n  \
            dmp simulate loops truth.tum --noise 5cm,0.1deg --true 20 --false 40 --near 0 --seed 7 -o hard/\n\n\
            Files in FOLDER: graph.g2o; candidates.g2o; labels.csv, lines of from,to,label,kind; keyframes.txt, lines of id \
            and stamp in seconds; truth.tum, the true poses of the keyframes.",
    options: &[&[
        &simulate::LOOPS_TRUTH,
        &simulate::LOOPS_FOLDER,
        &simulate::IN_ROOM,
        &simulate::SPACING,
        &input::KEYFRAMES,
        &input::TIME_UNIT,
        &simulate::TRUE_LOOPS,
        &simulate::FALSE_LOOPS,
        &simulate::NEAR_LOOPS,
        &simulate::ODOMETRY_NOISE,
        &simulate::YAW_BIAS,
        &simulate::SEED,
    ]],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let (truth, folder) = (asked.need(&simulate::LOOPS_TRUTH)?, asked.need(&simulate::LOOPS_FOLDER)?);
    let keyframes = asked.get(&input::KEYFRAMES);
    let files = Files::in_folder(&folder);
    for input in [Some(&truth), keyframes.as_ref()].into_iter().flatten() {
        files.all().into_iter().try_for_each(|output| refuse_same(input, output))?;
    }
    let file = read_trajectory(&truth)?;
    let read_times = |path: &PathBuf| read_keyframe_times_in(path, asked.get(&input::TIME_UNIT));
    let times = keyframes.as_ref().map(read_times).transpose()?;
    if !common.quiet {
        let of_times = keyframes.iter().zip(times.iter().map(|times| &times.notes));
        for (path, notes) in std::iter::once((&truth, &file.notes)).chain(of_times) {
            notes.iter().for_each(|note| say!(common.host, "note: {}: {note}", path.display()));
        }
    }
    let usual = LoopGraphOptions::on_scales(Scales::of_sensor(asked.has(&simulate::IN_ROOM)));
    let noise = asked.get(&simulate::ODOMETRY_NOISE);
    let (step_sigma_m, step_sigma_rad) = noise.unwrap_or((usual.step_sigma_m, usual.step_sigma_rad));
    let spacing_m = if times.is_some() { 0.0 } else { usual.spacing_m };
    let options = LoopGraphOptions {
        seed: asked.get(&simulate::SEED).unwrap_or(1),
        spacing_m: asked.get(&simulate::SPACING).unwrap_or(spacing_m),
        instants_ns: times.map(|times| times.stamps_ns),
        step_sigma_m,
        step_sigma_rad,
        yaw_bias_rad_per_m: asked.get(&simulate::YAW_BIAS).unwrap_or(usual.yaw_bias_rad_per_m),
        true_loops: asked.get(&simulate::TRUE_LOOPS).unwrap_or(10),
        false_loops: asked.get(&simulate::FALSE_LOOPS).unwrap_or(10),
        near_loops: asked.get(&simulate::NEAR_LOOPS).unwrap_or(6),
        ..usual
    };
    let made = LoopGraph::new(&file.trajectory, &options).map_err(in_words)?;
    let _made = OutputsFolder::make(&folder)?;
    files.save(&made)?;
    files.print(&made, out)?;
    Ok(Exit::Done)
}

/// What is written.
struct Files {
    graph: PathBuf,
    candidates: PathBuf,
    labels: PathBuf,
    keyframes: PathBuf,
    truth: PathBuf,
}

impl Files {
    fn in_folder(folder: &Path) -> Self {
        Self {
            graph: folder.join("graph.g2o"),
            candidates: folder.join("candidates.g2o"),
            labels: folder.join("labels.csv"),
            keyframes: folder.join("keyframes.txt"),
            truth: folder.join("truth.tum"),
        }
    }

    fn all(&self) -> [&Path; 5] {
        [&self.graph, &self.candidates, &self.labels, &self.keyframes, &self.truth]
    }

    fn save(&self, made: &LoopGraph) -> anyhow::Result<()> {
        let mut files = SavedTogether::default();
        files.add_unnamed(&self.graph, |out| write_pose_graph(out, &made.graph))?;
        let edges: Vec<PoseEdge> = made.candidates.iter().map(|candidate| candidate.edge.clone()).collect();
        files.add_unnamed(&self.candidates, |out| write_pose_edges(out, &edges))?;
        files.add_unnamed(&self.labels, |out| {
            writeln!(out, "from,to,label,kind")?;
            made.candidates.iter().try_for_each(|candidate| {
                let (edge, kind) = (&candidate.edge, candidate.kind);
                writeln!(out, "{},{},{},{kind}", edge.from, edge.to, kind.is_true())
            })
        })?;
        let stamps_ns = made.truth.stamps_ns().unwrap_or_default().to_vec();
        let times = KeyframeTimes { ids: Some(made.graph.ids().to_vec()), stamps_ns, notes: Vec::new() };
        files.add_unnamed(&self.keyframes, |out| write_keyframe_times(out, &times))?;
        files.add_unnamed(&self.truth, |out| write_tum(out, &made.truth))?;
        files.commit()
    }

    /// A line for each file.
    fn print(&self, made: &LoopGraph, out: &mut impl Write) -> anyhow::Result<()> {
        let (vertices, edges) = (made.graph.ids().len(), made.graph.edges().len());
        let ate_m = ate_rmse_m(&Trajectory::unstamped(made.graph.poses().to_vec())?, &made.truth);
        writeln!(
            out,
            "{}: {} vertices, {}, {:.1} m of travel, ATE {ate_m:.3} m",
            self.graph.display(),
            count(vertices as u64),
            counted(edges as u64, "edge"),
            travel_m(&made.truth),
        )?;
        writeln!(
            out,
            "{}: {}",
            self.candidates.display(),
            counted(made.candidates.len() as u64, "candidate")
        )?;
        let [right, wrong, near] = [LoopKind::True, LoopKind::False, LoopKind::Near]
            .map(|kind| made.candidates.iter().filter(|candidate| candidate.kind == kind).count());
        writeln!(out, "{}: {right} true, {wrong} false, {near} near", self.labels.display())?;
        writeln!(out, "{}: {}", self.keyframes.display(), counted(vertices as u64, "stamp"))?;
        writeln!(out, "{}: {}", self.truth.display(), counted(made.truth.len() as u64, "pose"))?;
        Ok(())
    }
}
