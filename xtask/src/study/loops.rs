//! `cargo xtask study loops`: how well loop candidates are ranked by the maps they make, fast and directly.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context as _, ensure};
use dmp::Config;
use dmp_log::{LogOptions, ScanLog, open_log};
use dmp_loops::{
    Acceptance, Keyframes, LoopMap, MapOptions, OptimiseOptions, Ranker, Ranking, Scorer, Tried, Verdict,
    in_threads, optimised,
};
use dmp_sensor::PoseEdge;
use dmp_sim::{LoopGraph, LoopGraphOptions, LoopKind, Recording};
use dmp_truth::detection::{PrecisionRecall, Ranked};
use dmp_truth::rank::kendall_tau_b;

use super::drives::{DriveSpec, drives, find};
use super::logs::write_log;

/// Loop candidates of known kind on the drives that come back, ranked by patches and by whole maps
#[derive(Debug, clap::Args)]
pub(super) struct LoopsArgs {
    /// Only these drives, comma-separated; all that come back by default
    #[arg(long, value_delimiter = ',')]
    drives: Vec<String>,
    /// Graphs of each drive, made by as many seeds
    #[arg(long, default_value_t = 2)]
    graphs: u64,
    /// Leave the direct way out
    #[arg(long)]
    fast_only: bool,
    /// Rays of each keyframe
    #[arg(long, default_value_t = MapOptions::default().rays_per_keyframe)]
    rays: usize,
    /// A place where nothing moved further keeps its score, metres
    #[arg(long)]
    moved: Option<f64>,
    /// Also print every candidate
    #[arg(long)]
    each: bool,
    /// Where the drives' logs are kept
    #[arg(long, default_value = "target/study", value_name = "FOLDER")]
    out: PathBuf,
}

/// A drive that never comes back has no true loops.
const WITHOUT_LOOPS: &str = "oneway-32";

pub(super) fn run(arguments: &LoopsArgs) -> anyhow::Result<()> {
    std::fs::create_dir_all(&arguments.out).with_context(|| arguments.out.display().to_string())?;
    for name in &arguments.drives {
        find(name)?;
    }
    let wanted = |spec: &DriveSpec| match arguments.drives.as_slice() {
        [] => spec.name != WITHOUT_LOOPS,
        names => names.iter().any(|name| name == spec.name),
    };
    println!("{}", Row::HEAD);
    let mut rows = Vec::new();
    for spec in drives().iter().filter(|spec| wanted(spec)) {
        for seed in 1..=arguments.graphs {
            let row = graph(spec, seed, arguments).with_context(|| format!("{}, graph {seed}", spec.name))?;
            println!("{row}");
            rows.push(row);
        }
    }
    summary(&rows);
    Ok(())
}

/// One graph's candidates, ranked.
struct Row {
    name: String,
    vertices: usize,
    candidates: usize,
    /// By patches, by the graph alone, and by whole maps.
    fast: Outcome,
    by_graph: f64,
    direct: Option<Outcome>,
    /// Largest difference of `R_near(2 m)` of patches and of whole maps, as a share; and how alike their orders are.
    off: Option<(f64, f64)>,
    accepted: [usize; 3],
}

struct Outcome {
    average_precision: f64,
    seconds: f64,
    cast_share: f64,
}

fn graph(spec: &DriveSpec, seed: u64, arguments: &LoopsArgs) -> anyhow::Result<Row> {
    let town = spec.town()?;
    let recording = Recording::new(&town, &spec.options)?;
    let path = arguments.out.join(format!("{}.mcap", spec.name));
    write_log(&recording, &path)?;
    let log = open_log(&path, &LogOptions::default())?;
    let stamps = log.frames().iter().filter_map(|frame| frame.stamp_ns).collect();
    let options = LoopGraphOptions { seed, instants_ns: Some(stamps), ..LoopGraphOptions::default() };
    let simulated = LoopGraph::new(&spec.truth(&recording)?, &options)?;
    let config = Config::default();
    in_threads(config.threads, || compare(spec, seed, log.as_ref(), &simulated, &config, arguments))?
}

fn compare(
    spec: &DriveSpec,
    seed: u64,
    log: &dyn ScanLog,
    simulated: &LoopGraph,
    config: &Config,
    arguments: &LoopsArgs,
) -> anyhow::Result<Row> {
    let options = OptimiseOptions::default();
    let stamps = simulated.truth.stamps_ns().context("keyframes have stamps")?;
    let (graph, _) = optimised(&simulated.graph, &options)?;
    let keyframes = Keyframes::of(&graph, Some(stamps), log, 0)?;
    let edges: Vec<PoseEdge> = simulated.candidates.iter().map(|one| one.edge.clone()).collect();
    let kinds: Vec<LoopKind> = simulated.candidates.iter().map(|one| one.kind).collect();

    let start = Instant::now();
    let map_options = MapOptions { rays_per_keyframe: arguments.rays, moved_m: arguments.moved };
    let map = LoopMap::new(log, &keyframes, graph.poses(), config, map_options, &())?;
    let ranker = Ranker::new(graph.clone(), options.clone(), Scorer::patches(&map), &())?;
    let fast = ranker.rank(&edges, &())?;
    let fast_s = start.elapsed().as_secs_f64();
    let accepted = ranker.accept(&edges, &fast, &())?;
    let by_graph = Ranker::new(graph.clone(), options.clone(), Scorer::graph(), &())?.rank(&edges, &())?;
    let direct = if arguments.fast_only {
        None
    } else {
        let start = Instant::now();
        let ranker = Ranker::new(graph.clone(), options, Scorer::log(log, &keyframes, config), &())?;
        Some((ranker.rank(&edges, &())?, start.elapsed().as_secs_f64()))
    };
    if arguments.each {
        each(&fast, direct.as_ref().map(|(ranking, _)| ranking), &kinds);
        decisions(&accepted, &kinds);
    }
    Ok(Row {
        name: format!("{} {seed}", spec.name),
        vertices: graph.ids().len(),
        candidates: edges.len(),
        fast: ranked(&fast, &kinds, fast_s)?,
        by_graph: ranked(&by_graph, &kinds, 0.0)?.average_precision,
        off: direct.as_ref().and_then(|(direct, _)| off(&fast, direct)),
        direct: direct.map(|(ranking, seconds)| ranked(&ranking, &kinds, seconds)).transpose()?,
        accepted: kinds_of(&accepted, &kinds),
    })
}

fn ranked(ranking: &Ranking, kinds: &[LoopKind], seconds: f64) -> anyhow::Result<Outcome> {
    ensure!(ranking.failed.is_empty(), "{} candidates have no score", ranking.failed.len());
    let item = |tried: &Tried| Ranked { score: Some(tried.score()), is_true: kinds[tried.index].is_true() };
    let items: Vec<Ranked> = ranking.ranked.iter().map(item).collect();
    let shares = ranking.ranked.iter().filter_map(|tried| Some(tried.map.as_ref()?.cast_share));
    let cast_share = shares.sum::<f64>() / ranking.ranked.len() as f64;
    Ok(Outcome { average_precision: PrecisionRecall::of(&items)?.average_precision, seconds, cast_share })
}

/// The scores of one ranking in the order of the candidates.
fn by_candidate(ranking: &Ranking) -> Vec<f64> {
    let mut scores: Vec<_> = ranking.ranked.iter().map(|tried| (tried.index, tried.score())).collect();
    scores.sort_by_key(|score| score.0);
    scores.into_iter().map(|score| score.1).collect()
}

fn off(fast: &Ranking, direct: &Ranking) -> Option<(f64, f64)> {
    let (fast, direct) = (by_candidate(fast), by_candidate(direct));
    let most = fast.iter().zip(&direct).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    let [fast, direct] = [fast, direct].map(|scores| scores.into_iter().map(Some).collect::<Vec<_>>());
    Some((most, kendall_tau_b(&fast, &direct)?))
}

/// How many true, false and nearly right ones were accepted.
fn kinds_of(accepted: &Acceptance, kinds: &[LoopKind]) -> [usize; 3] {
    let those = || accepted.decisions.iter().filter(|one| matches!(one.verdict, Verdict::Accepted));
    [LoopKind::True, LoopKind::False, LoopKind::Near]
        .map(|kind| those().filter(|one| kinds[one.index] == kind).count())
}

fn each(fast: &Ranking, direct: Option<&Ranking>, kinds: &[LoopKind]) {
    for tried in &fast.ranked {
        let change = tried.map.as_ref().and_then(|map| map.change);
        let whole = direct.and_then(|direct| direct.ranked.iter().find(|other| other.index == tried.index));
        println!(
            "    {:<6} {:9.6} {:+.6} {:?} direct {:9.6}, moved {:6.2} m, chi2 {:8.2}, own {:8.2}, cast {:.2}",
            format!("{:?}", kinds[tried.index]),
            tried.score(),
            change.map_or(f64::NAN, |change| change.value_m2),
            change.and_then(|change| change.interval).map(|interval| [interval.low_m2, interval.high_m2]),
            whole.map_or(f64::NAN, Tried::score),
            tried.largest_move_m,
            tried.chi2_change,
            tried.own_chi2,
            tried.map.as_ref().map_or(0.0, |map| map.cast_share),
        );
    }
}

fn decisions(accepted: &Acceptance, kinds: &[LoopKind]) {
    for decision in &accepted.decisions {
        let map = decision.tried.as_ref().and_then(|tried| tried.map.as_ref());
        let interval = map.and_then(|map| map.change).and_then(|change| change.interval);
        println!(
            "    {:?} after {}: {:?}, {:?}, change {:?}, moved {:.2} m, chi2 {:.1}",
            kinds[decision.index],
            decision.after,
            decision.verdict,
            map.and_then(|map| map.change).map(|change| change.value_m2),
            interval.map(|interval| [interval.low_m2, interval.high_m2]),
            decision.tried.as_ref().map_or(0.0, |tried| tried.largest_move_m),
            decision.tried.as_ref().map_or(0.0, |tried| tried.chi2_change),
        );
    }
}

impl Row {
    const HEAD: &str = "graph            vertices  candidates  AP fast  AP direct  AP graph  R_near off  tau   cast   fast s  direct s  \
        accepted true, false, near";
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shown = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
        let [right, wrong, near] = self.accepted;
        write!(
            f,
            "{:<16} {:8}  {:10}  {:7.3}  {:>9}  {:8.3}  {:>10}  {:>5}  {:.2}  {:7.1}  {:>8}  {right:13} {wrong:6} {near:5}",
            self.name,
            self.vertices,
            self.candidates,
            self.fast.average_precision,
            shown(self.direct.as_ref().map(|direct| direct.average_precision)),
            self.by_graph,
            shown(self.off.map(|off| off.0)),
            shown(self.off.map(|off| off.1)),
            self.fast.cast_share,
            self.fast.seconds,
            self.direct.as_ref().map_or("-".to_owned(), |direct| format!("{:.1}", direct.seconds)),
        )
    }
}

fn summary(rows: &[Row]) {
    let mean = |of: &dyn Fn(&Row) -> Option<f64>| {
        let values: Vec<f64> = rows.iter().filter_map(of).collect();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        (!values.is_empty()).then(|| (values.iter().sum::<f64>() / values.len() as f64, least))
    };
    let tell = |what: &str, of: &dyn Fn(&Row) -> Option<f64>| {
        if let Some((mean, least)) = mean(of) {
            println!("{what}: mean {mean:.4}, worst {least:.4}");
        }
    };
    println!();
    tell("average precision, fast", &|row| Some(row.fast.average_precision));
    tell("average precision, direct", &|row| Some(row.direct.as_ref()?.average_precision));
    tell("average precision, graph alone", &|row| Some(row.by_graph));
    let differences = rows
        .iter()
        .filter_map(|row| Some((row.fast.average_precision - row.direct.as_ref()?.average_precision).abs()));
    if let Some(most) = differences.reduce(f64::max) {
        println!("fast against direct: at most {most:.4} apart");
    }
    let time = |of: &dyn Fn(&Row) -> Option<f64>| rows.iter().filter_map(of).sum::<f64>();
    println!(
        "seconds: fast {:.0}, direct {:.0}",
        time(&|row| Some(row.fast.seconds)),
        time(&|row| Some(row.direct.as_ref()?.seconds))
    );
    let accepted = rows.iter().fold([0; 3], |sum, row| std::array::from_fn(|k| sum[k] + row.accepted[k]));
    println!("accepted: {} true, {} false, {} nearly right", accepted[0], accepted[1], accepted[2]);
}
