//! What casting a share of the returns changes: verdicts and intervals, beside those of all returns.

use std::path::PathBuf;

use anyhow::Context as _;
use dmp::{CastReturns, Config, DriftPairs, PairReport, Report, Run, Verdict, evaluate};
use dmp_log::{LogOptions, ScanLog, open_log, read_trajectory};

use super::chosen::Chosen;
use super::estimates::estimates;
use super::logs::DriveLog;

/// Verdicts and intervals where a share of the returns is cast, beside those of all
#[derive(Debug, clap::Args)]
pub(crate) struct DrawArgs {
    #[command(flatten)]
    chosen: Chosen,
    /// Instead of drives: this log
    #[arg(long, requires = "trajectories")]
    log: Option<PathBuf>,
    /// The runs of this log
    #[arg(short, long)]
    trajectories: Vec<PathBuf>,
    /// One return of so many is cast, comma-separated
    #[arg(long, value_delimiter = ',', default_value = "2,4,8,16")]
    one_in: Vec<u32>,
    /// Draws of each
    #[arg(long, value_name = "N", default_value_t = 10)]
    seeds: u64,
}

/// What the draws of one share did to the pairs of a log.
#[derive(Default)]
struct Changes {
    pairs: usize,
    /// Pairs that all returns decide; of these, those with the same verdict, at the same scale, and the other run.
    decided: usize,
    same: usize,
    same_scale: usize,
    reversed: usize,
    /// Pairs that are not decided by all returns, and are by the draw.
    new: usize,
    /// Of the decided pairs, widths of intervals over those of all returns.
    widths: Vec<f64>,
}

pub(crate) fn run(arguments: &DrawArgs) -> anyhow::Result<()> {
    println!(
        "| log | runs | M returns cast | one in | decided | same verdict | same scale | reversed | newly decided | width, median | most |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    );
    if let Some(path) = &arguments.log {
        let log = open_log(path, &LogOptions::default())?;
        let read = |path: &PathBuf| {
            let name = path.file_stem().context("a trajectory has a name")?.to_string_lossy();
            Ok(Run::new(name, read_trajectory(path)?.trajectory))
        };
        let runs = arguments.trajectories.iter().map(read).collect::<anyhow::Result<Vec<_>>>()?;
        return rows(&path.file_name().unwrap_or_default().to_string_lossy(), log.as_ref(), &runs, arguments);
    }
    for spec in arguments.chosen.drives()? {
        let DriveLog { log, truth, .. } = DriveLog::open(&spec, &arguments.chosen.out)?;
        let wanted =
            estimates(&spec, &truth)?.into_iter().filter(|estimate| arguments.chosen.wants(estimate));
        let runs: Vec<Run> = wanted.map(|estimate| Run::new(estimate.name, estimate.trajectory)).collect();
        rows(spec.name, log.as_ref(), &runs, arguments)?;
    }
    Ok(())
}

fn rows(name: &str, log: &dyn ScanLog, runs: &[Run], arguments: &DrawArgs) -> anyhow::Result<()> {
    let score = |one_in, seed| {
        let returns = CastReturns::OneIn(one_in);
        let config = Config { returns, seed, drift: DriftPairs::None, ..Config::default() };
        evaluate(log, runs, &config, ()).with_context(|| name.to_owned())
    };
    let all = score(1, 0)?;
    for &one_in in &arguments.one_in {
        let (mut changes, mut returns) = (Changes::default(), 0);
        for seed in 0..arguments.seeds {
            let drawn = score(one_in, seed)?;
            returns = drawn.inputs.returns_used;
            changes.add(&all, &drawn)?;
        }
        changes.widths.sort_unstable_by(f64::total_cmp);
        let [median, most] = [changes.widths.len() / 2, changes.widths.len().saturating_sub(1)]
            .map(|k| changes.widths.get(k).copied().unwrap_or(f64::NAN));
        let Changes { pairs, decided, same, same_scale, reversed, new, .. } = changes;
        println!(
            "| {name} | {} | {:.2} | {one_in} | {decided} of {pairs} | {same} | {same_scale} | {reversed} | {new} | {median:.3} | {most:.2} |",
            runs.len(),
            returns as f64 / 1e6
        );
    }
    Ok(())
}

impl Changes {
    fn add(&mut self, all: &Report, drawn: &Report) -> anyhow::Result<()> {
        for pair in &all.pairs {
            let other = drawn.pair(&pair.a, &pair.b).context("the same pairs")?;
            self.pairs += 1;
            self.widths.extend(width(pair, other));
            let [before, after] = [&pair.verdict, &other.verdict].map(Verdict::ahead);
            if before.is_none() {
                self.new += usize::from(after.is_some());
                continue;
            }
            self.decided += 1;
            self.reversed += usize::from(after.is_some() && after != before);
            let is_same = before == after && pair.verdict.better() == other.verdict.better();
            self.same += usize::from(is_same);
            self.same_scale +=
                usize::from(is_same && pair.verdict.decided_at_m() == other.verdict.decided_at_m());
        }
        Ok(())
    }
}

/// At the scale that decides by all returns, how wide the interval of the draw is over theirs.
fn width(all: &PairReport, drawn: &PairReport) -> Option<f64> {
    let scale_m = all.verdict.decided_at_m()?;
    let [drawn_m2, all_m2] = [drawn, all].map(|pair| {
        let scale = pair.scales.iter().find(|scale| scale.scale_m == scale_m)?;
        scale.interval_m2.map(|[low_m2, high_m2]| high_m2 - low_m2)
    });
    Some(drawn_m2? / all_m2?)
}
