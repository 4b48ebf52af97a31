//! `dmp simulate loops`: a pose graph with true and false loop candidates.

use dmp_draw::text::{count, counted};
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use dmp_log::{
    KeyframeTimes, TimeUnit, read_keyframe_times_in, read_trajectory, write_keyframe_times, write_pose_edges,
    write_pose_graph, write_tum,
};
use dmp_sensor::{PoseEdge, Trajectory};
use dmp_sim::{LoopGraph, LoopGraphOptions, LoopKind, Scales, ate_rmse_m};

use super::fault::told;
use crate::clash::refuse_same;
use crate::common::Common;
use crate::exit::Exit;
use crate::parse;
use crate::save::{OutputsFolder, SavedTogether};
use crate::say::say;

/// Make a pose graph without loops from a true trajectory, and loop candidates with labels
///
/// The graph is what a SLAM front end leaves: keyframes, and odometry between them that drifts. True candidates
/// join keyframes within 8 m of each other. False ones join places more than 40 m apart that look alike: they are
/// measured within 2 m, heading the same way or the opposite one. Near ones are true ones that are off by 3 to
/// 10 m along the street; their label is false. All have more than 100 m of travel between their keyframes, claim
/// to be as good (0.1 m, 0.5 degrees) and stand in any order. The same seed gives the same files.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    dmp simulate loops town.truth.tum -o loops/\n  \
    dmp simulate loops room/groundtruth.txt --room -o loops/\n  \
    dmp simulate loops town.truth.tum --keyframes times.txt --spacing 2m -o loops/\n  \
    dmp simulate loops truth.tum --noise 5cm,0.1deg --true 20 --false 40 --near 0 --seed 7 -o hard/\n\n\
    Files in FOLDER: graph.g2o; candidates.g2o; labels.csv, lines of from,to,label,kind; keyframes.txt, lines \
    of id and stamp in seconds; truth.tum, the true poses of the keyframes.")]
pub(crate) struct LoopsArgs {
    /// The true trajectory, with stamps: TUM, or EuRoC
    #[arg(value_name = "TRUTH")]
    truth: PathBuf,
    /// The folder for the files; it is made where there is none. Files that are there are not overwritten
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// The trajectory is that of a hand-held camera in a room (z ahead, y down): one place is 0.8 m and 30 degrees,
    /// another one is 2.2 m or 90 degrees away, near candidates are off by 0.15 to 0.6 m, there are 5 m of travel
    /// between the two keyframes of a candidate, and candidates claim to be as good as 0.01 m
    #[arg(long)]
    room: bool,
    /// Travel from one keyframe to the next, metres [default: 1; with --room 0.2, or a turn of 15 degrees; with
    /// --keyframes 0, which is all of them]
    #[arg(long, value_name = "LENGTH", value_parser = parse::length_m)]
    spacing: Option<f64>,
    /// Instants at which there may be keyframes, such as the times of a log's scans, in seconds: a stamp a
    /// line, or `id stamp`, or a TUM trajectory [default: those of the truth's poses]
    #[arg(long, value_name = "TIMES")]
    keyframes: Option<PathBuf>,
    /// The unit of the stamps of --keyframes, where it is not seconds or is asked for: s, ms, us or ns
    #[arg(long, value_name = "UNIT", requires = "keyframes")]
    time_unit: Option<TimeUnit>,
    /// Number of true candidates
    #[arg(long = "true", default_value_t = 10, value_name = "N")]
    true_loops: usize,
    /// Number of false candidates
    #[arg(long = "false", default_value_t = 10, value_name = "N")]
    false_loops: usize,
    /// Number of near candidates
    #[arg(long = "near", default_value_t = 6, value_name = "N")]
    near_loops: usize,
    /// Noise of a metre of odometry: standard deviation along and about each axis; it grows with the square
    /// root of the way [default: 0.02,0.03deg; with --room 0.02,0.3deg]
    #[arg(long, value_name = "LENGTH,ANGLE", value_parser = parse::noise)]
    noise: Option<(f64, f64)>,
    /// What the odometry turns too far to the left in each metre [default: 0.006deg; with --room 0.1deg]
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, value_parser = parse::angle_rad)]
    yaw_bias: Option<f64>,
    /// Another number makes other noise and other candidates
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

pub(super) fn run(arguments: &LoopsArgs, common: &Common, out: &mut impl Write) -> anyhow::Result<Exit> {
    let files = Files::in_folder(&arguments.output);
    for input in [Some(&arguments.truth), arguments.keyframes.as_ref()].into_iter().flatten() {
        files.all().into_iter().try_for_each(|output| refuse_same(input, output))?;
    }
    let file = read_trajectory(&arguments.truth)?;
    let read_times = |path: &PathBuf| read_keyframe_times_in(path, arguments.time_unit);
    let times = arguments.keyframes.as_ref().map(read_times).transpose()?;
    if !common.quiet {
        let of_times = arguments.keyframes.iter().zip(times.iter().map(|times| &times.notes));
        for (path, notes) in std::iter::once((&arguments.truth, &file.notes)).chain(of_times) {
            notes.iter().for_each(|note| say!(common.host, "note: {}: {note}", path.display()));
        }
    }
    let usual = LoopGraphOptions::on_scales(Scales::of_sensor(arguments.room));
    let (step_sigma_m, step_sigma_rad) =
        arguments.noise.unwrap_or((usual.step_sigma_m, usual.step_sigma_rad));
    let options = LoopGraphOptions {
        seed: arguments.seed,
        spacing_m: arguments.spacing.unwrap_or(if times.is_some() { 0.0 } else { usual.spacing_m }),
        instants_ns: times.map(|times| times.stamps_ns),
        step_sigma_m,
        step_sigma_rad,
        yaw_bias_rad_per_m: arguments.yaw_bias.unwrap_or(usual.yaw_bias_rad_per_m),
        true_loops: arguments.true_loops,
        false_loops: arguments.false_loops,
        near_loops: arguments.near_loops,
        ..usual
    };
    let made = LoopGraph::new(&file.trajectory, &options).map_err(told)?;
    let folder = &arguments.output;
    let _made = OutputsFolder::make(folder)?;
    files.save(&made)?;
    files.tell(&made, out)?;
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
    fn tell(&self, made: &LoopGraph, out: &mut impl Write) -> anyhow::Result<()> {
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

/// From keyframe to keyframe.
fn travel_m(run: &Trajectory) -> f64 {
    let steps = run.poses().windows(2).map(|pair| pair[1].translation.vector - pair[0].translation.vector);
    steps.map(|step| step.norm()).sum()
}
