//! What a score in parts takes beside one in one process, and what that foretells of many workers.

mod measured;
mod model;
mod processes;

use std::path::PathBuf;
use std::process::Command;

use clap::Args;
use serde_json::Value;

use super::city::{City, drift_of, truth_of};
use super::taken::taken_by;
use super::times::circumstances;
use measured::Measured;
use model::{Cluster, Job, STAGES, Stage};
use processes::{Process, in_workers};

/// A score in parts on a drive through a city: its core time by that of `dmp score`, bytes that parts read, and what the model says
/// of 2 and 4 workers beside what they took; then what it says of 10¹⁰ to 10¹² returns on 32 to 2048 workers
#[derive(Debug, Args)]
pub(crate) struct ShardArgs {
    /// Length of the drive, kilometres
    #[arg(long, default_value_t = 4.0)]
    km: f64,
    /// Parts of fusing and casting
    #[arg(long, default_value_t = 8)]
    parts: u32,
    /// Where the log is kept; one that is there already is used again
    #[arg(long, default_value = "target/shard")]
    folder: PathBuf,
    /// Only the model, with what was measured before
    #[arg(long)]
    model: bool,
}

pub(crate) fn run(arguments: &ShardArgs) -> anyhow::Result<()> {
    std::fs::create_dir_all(&arguments.folder)?;
    let kept = arguments.folder.join("measured.json");
    if !arguments.model {
        let measured = measure(arguments)?;
        std::fs::write(&kept, serde_json::to_vec_pretty(&measured)?)?;
    }
    let measured: Measured = serde_json::from_slice(&std::fs::read(&kept)?)?;
    model::table(&measured);
    Ok(())
}

fn measure(arguments: &ShardArgs) -> anyhow::Result<Measured> {
    let dmp = std::env::current_exe()?.with_file_name("dmp");
    anyhow::ensure!(dmp.exists(), "no {}: cargo build --release -p dmp-cli", dmp.display());
    let city = City { km: arguments.km, revisit: 0.3, azimuth_steps: 1024 };
    let log = city.log(&arguments.folder, &dmp)?;
    let asked = |command: &mut Command| -> anyhow::Result<()> {
        command.arg(&log).arg("-t").arg(format!("truth={}", truth_of(&log).display()));
        command.arg("-t").arg(drift_of(&log, 1, &dmp)?).args(["--trust", "--quiet"]);
        Ok(())
    };
    let mut score = Command::new(&dmp);
    score.arg("score");
    asked(&mut score)?;
    let (whole, said) = taken_by(score.args(["--json", "--threads", "2", "--work"]).arg(&arguments.folder))?;
    let expected: Value = serde_json::from_slice(&said)?;
    let returns = expected["inputs"]["returns"].as_f64().unwrap_or(0.0);
    println!("{} km, {returns:.3e} returns, 2 runs; {}", arguments.km, circumstances());
    println!("dmp score --threads 2: {:.1} s on cores, {:.1} s", whole.on_cores_s, whole.wall_s);

    let work = arguments.folder.join("work");
    let counts = [arguments.parts, 2, arguments.parts, 2];
    let mut first: Option<(Vec<Vec<Process>>, f64, f64)> = None;
    for workers in [1, 2, 4] {
        if work.exists() {
            std::fs::remove_dir_all(&work)?;
        }
        let mut plan = Command::new(&dmp);
        plan.args(["shard", "plan"]);
        asked(&mut plan)?;
        let (planned, _) = taken_by(plan.args(["--threads", "1", "-o"]).arg(&work))?;
        let (mut wall_s, mut stages) = (planned.wall_s, Vec::new());
        for (stage, parts) in STAGES.into_iter().zip(counts) {
            let (processes, stage_s) = in_workers(workers, parts, |part| {
                let mut command = Command::new(&dmp);
                command.args(["shard", stage.name()]).arg(&work).args(["--threads", "1", "--part"]);
                command.arg(format!("{part}/{parts}"));
                command
            })?;
            wall_s += stage_s;
            stages.push(processes);
        }
        let mut reduce = Command::new(&dmp);
        let (reduced, said) =
            taken_by(reduce.args(["shard", "reduce"]).arg(&work).args(["--json", "--quiet"]))?;
        wall_s += reduced.wall_s;
        anyhow::ensure!(comparable(&said)? == comparable_of(expected.clone()), "not the same scores");
        let parts_s = stages.iter().flatten().map(|process| process.on_cores_s).sum::<f64>();
        let all_s = parts_s + planned.on_cores_s + reduced.on_cores_s;
        let by_score = all_s / whole.on_cores_s;
        println!("{workers} workers: {all_s:.1} s on cores, {by_score:.3} of dmp score, {wall_s:.1} s");
        if let Some((parts, plan_s, reduce_s)) = &first {
            let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
            let foretold =
                plan_s + reduce_s + parts.iter().map(|stage| shared_s(stage, workers, cores)).sum::<f64>();
            println!(
                "  foretold by what one worker took: {foretold:.1} s, {:+.1} %",
                100.0 * (foretold / wall_s - 1.0)
            );
        } else {
            told(&stages, counts);
            first = Some((stages, planned.wall_s, reduced.wall_s));
        }
    }
    let (stages, plan_s, reduce_s) = first.unwrap_or_default();
    let bytes_of = |extension: &str| -> anyhow::Result<f64> {
        let files = std::fs::read_dir(&work)?.collect::<Result<Vec<_>, _>>()?;
        let files = files.iter().filter(|file| file.path().extension().is_some_and(|e| e == extension));
        Ok(files.map(|file| file.metadata().map_or(0, |data| data.len())).sum::<u64>() as f64)
    };
    let of_stage = |stage: usize| stages[stage].iter().map(|process| process.on_cores_s).collect();
    Ok(Measured {
        machine: circumstances(),
        returns,
        runs: 2.0,
        log_bytes: std::fs::metadata(&log)?.len() as f64,
        sums_bytes: bytes_of("sums")?,
        map_bytes: bytes_of("dmpmap")?,
        plan_s,
        reduce_s,
        parts_s: [of_stage(0), of_stage(1), of_stage(2), of_stage(3)],
    })
}

/// What parts took, and what they read of the log.
fn told(stages: &[Vec<Process>], counts: [u32; 4]) {
    println!("{:<8}{:>6}{:>10}{:>22}{:>16}", "", "parts", "on cores", "least – most s", "of the log");
    for ((stage, processes), parts) in STAGES.into_iter().zip(stages).zip(counts) {
        let times: Vec<f64> = processes.iter().map(|process| process.on_cores_s).collect();
        let (least, most) = times.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), &s| (a.min(s), b.max(s)));
        let read = processes.iter().filter_map(|process| process.share_read).fold(0.0, |a, b| a + b);
        let all = times.iter().sum::<f64>();
        println!("{:<8}{parts:>6}{all:>10.1}{least:>14.1} – {most:.1}{read:>16.3}", stage.name());
    }
}

/// How long some parts take that several workers do on fewer cores, which they share.
fn shared_s(parts: &[Process], workers: usize, cores: usize) -> f64 {
    let job = Job { parts_s: parts.iter().map(|process| process.on_cores_s).collect(), fetched_s: 0.0 };
    Cluster { workers, cores: cores.min(workers), dispatch_s: 0.0 }.stage_s(&job)
}

fn comparable(json: &[u8]) -> anyhow::Result<Value> {
    Ok(comparable_of(serde_json::from_slice(json)?))
}

/// Without what may differ.
fn comparable_of(mut json: Value) -> Value {
    if let Some(object) = json.as_object_mut() {
        object.remove("timing");
        object.remove("memory");
    }
    json
}

impl Stage {
    fn name(self) -> &'static str {
        match self {
            Self::Fuse => "fuse",
            Self::Merge => "merge",
            Self::Cast => "cast",
            Self::Drift => "drift",
        }
    }
}
