//! A small model of a score in parts on many workers: what waits for what, who computes, who fetches.

use super::measured::Measured;

/// A stage that is done in parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stage {
    Fuse,
    Merge,
    Cast,
    Drift,
}

pub(super) const STAGES: [Stage; 4] = [Stage::Fuse, Stage::Merge, Stage::Cast, Stage::Drift];

/// What a worker fetches in a second, bytes: 1 Gbit/s for each core.
const FETCHED_BYTES_S: f64 = 1.25e8;
/// What a scheduler takes to give out a part, seconds: the most that was seen on a loaded machine.
const DISPATCH_S: f64 = 7e-3;
/// What parts are to take, seconds, and how many there are for each worker at least, so that few wait at the end.
const PART_S: f64 = 60.0;
const PARTS_OF_WORKER: f64 = 3.0;
/// Longest part relative to the median.
const SKEW: f64 = 1.3;
/// What a core costs for an hour, of any currency.
const CORE_HOUR: f64 = 0.05;

/// Workers, the cores that they share, and who gives out parts one by one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cluster {
    pub(super) workers: usize,
    pub(super) cores: usize,
    pub(super) dispatch_s: f64,
}

/// The parts of a stage.
#[derive(Debug, Clone)]
pub(super) struct Job {
    /// Core seconds of each.
    pub(super) parts_s: Vec<f64>,
    /// What each waits for what it reads, seconds; no core is busy then.
    pub(super) fetched_s: f64,
}

impl Cluster {
    /// How long the parts of a stage take: each worker takes the next one when it has ended the one before, and those that compute
    /// at the same time share the cores.
    pub(super) fn stage_s(&self, job: &Job) -> f64 {
        let mut waiting = job.parts_s.iter().copied();
        // Of each that is at work: seconds left to fetch, and on a core.
        let mut at_work: Vec<(f64, f64)> = Vec::new();
        let (mut now_s, mut given_out_s) = (0.0_f64, 0.0_f64);
        let mut next = waiting.next();
        loop {
            while let Some(part_s) = next.filter(|_| at_work.len() < self.workers) {
                given_out_s = given_out_s.max(now_s) + self.dispatch_s;
                at_work.push((job.fetched_s + given_out_s - now_s, part_s));
                next = waiting.next();
            }
            if at_work.is_empty() {
                return now_s;
            }
            let computing = at_work.iter().filter(|(fetch_s, _)| *fetch_s <= 0.0).count();
            let speed = (self.cores as f64 / computing.max(1) as f64).min(1.0);
            let until =
                |&(fetch_s, part_s): &(f64, f64)| if fetch_s > 0.0 { fetch_s } else { part_s / speed };
            let step_s = at_work.iter().map(until).fold(f64::INFINITY, f64::min).max(1e-9);
            now_s += step_s;
            for (fetch_s, part_s) in &mut at_work {
                if *fetch_s > 0.0 {
                    *fetch_s -= step_s;
                    *fetch_s = if *fetch_s < 1e-9 { 0.0 } else { *fetch_s };
                } else {
                    *part_s -= step_s * speed;
                }
            }
            at_work.retain(|(fetch_s, part_s)| *fetch_s > 0.0 || *part_s > 1e-9);
        }
    }
}

/// What a stage takes in all: core seconds, and bytes that are fetched.
struct Load {
    core_s: f64,
    fetched_bytes: f64,
}

impl Measured {
    /// The stages for so many returns, in so many parts.
    fn loads(&self, returns: f64, merge_parts: f64) -> [Load; 4] {
        let grown = returns / self.returns;
        let core_s = |stage: usize| self.parts_s[stage].iter().sum::<f64>() * grown;
        // A part of the tiles reads those beside it too: two rows of about as many as there are columns.
        let halo = 1.0 + 2.0 * merge_parts / (2000.0 * grown.sqrt()).max(merge_parts);
        [
            Load { core_s: core_s(0), fetched_bytes: self.log_bytes * grown },
            Load { core_s: core_s(1) * halo, fetched_bytes: self.sums_bytes * grown * halo },
            // What is in reach of neighbours is fetched by each of them.
            Load { core_s: core_s(2), fetched_bytes: (self.log_bytes + 2.0 * self.map_bytes) * grown },
            Load { core_s: core_s(3), fetched_bytes: 0.5 * self.log_bytes * grown },
        ]
    }
}

/// Parts of about a minute, and enough for every worker.
fn parts_of(core_s: f64, workers: usize) -> usize {
    let enough = PARTS_OF_WORKER * workers as f64;
    (core_s / PART_S).max(enough.min(core_s / 10.0)).ceil().max(1.0) as usize
}

/// What the model says of many returns and workers.
pub(super) fn table(measured: &Measured) {
    println!("\nforetold from what was measured: {}", measured.machine);
    println!(
        "{} runs; {} MB/s for each worker, {} ms to give out a part",
        measured.runs,
        FETCHED_BYTES_S / 1e6,
        1e3 * DISPATCH_S
    );
    println!(
        "{:>9}{:>9}{:>10}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>10}{:>9}",
        "returns", "workers", "time h", "plan", "fuse", "merge", "cast", "drift", "speed-up", "TB", "cost"
    );
    for returns in [1e10, 1e11, 1e12] {
        for workers in [1, 32, 256, 2048] {
            row(measured, returns, workers);
        }
    }
}

fn row(measured: &Measured, returns: f64, workers: usize) {
    let grown = returns / measured.returns;
    let cluster = Cluster { workers, cores: workers, dispatch_s: DISPATCH_S };
    // The plan reads the log once, in one process; to reduce takes longer with more parts.
    let plan_s = measured.plan_s * grown + measured.log_bytes * grown / FETCHED_BYTES_S;
    let merge_parts = parts_of(measured.loads(returns, 1.0)[1].core_s, workers) as f64;
    let loads = measured.loads(returns, merge_parts);
    let mut stages_s = [0.0; 4];
    let mut parts = 0;
    for (load, stage_s) in loads.iter().zip(&mut stages_s) {
        let count = parts_of(load.core_s, workers);
        // Parts are not alike: every tenth takes longer.
        let even_s = load.core_s / (count as f64 * (1.0 + (SKEW - 1.0) / 10.0));
        let parts_s = (0..count).map(|k| if k % 10 == 9 { SKEW * even_s } else { even_s }).collect();
        let fetched_s = load.fetched_bytes / count as f64 / FETCHED_BYTES_S;
        *stage_s = cluster.stage_s(&Job { parts_s, fetched_s });
        parts += count;
    }
    let reduce_s = measured.reduce_s * (1.0 + parts as f64 * 1e-3);
    let [fuse, merge, cast, drift] = stages_s;
    // Drift waits for the plan alone, and takes workers from the others: it is counted behind them.
    let all_s = plan_s + fuse + merge + cast + drift + reduce_s;
    let core_s = loads.iter().map(|load| load.core_s).sum::<f64>() + plan_s + reduce_s;
    let bytes = loads.iter().map(|load| load.fetched_bytes).sum::<f64>() + measured.log_bytes * grown;
    let hours = |s: f64| format!("{:.2}", s / 3600.0);
    println!(
        "{returns:>9.0e}{workers:>9}{:>10}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9.0}{:>10.2}{:>9.1}",
        hours(all_s),
        hours(plan_s),
        hours(fuse),
        hours(merge),
        hours(cast),
        hours(drift),
        core_s / all_s,
        bytes / 1e12,
        workers as f64 * all_s / 3600.0 * CORE_HOUR
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cluster(workers: usize, cores: usize) -> Cluster {
        Cluster { workers, cores, dispatch_s: 0.0 }
    }

    fn takes(cluster: Cluster, parts_s: &[f64], fetched_s: f64) -> f64 {
        cluster.stage_s(&Job { parts_s: parts_s.to_vec(), fetched_s })
    }

    #[test]
    fn parts_follow_each_other_and_share_cores() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
        near(takes(cluster(1, 1), &[3.0, 2.0], 0.0), 5.0);
        near(takes(cluster(2, 2), &[3.0, 2.0, 2.0], 0.0), 4.0);
        // Four at a time on two cores: as if each had half of one.
        near(takes(cluster(4, 2), &[2.0; 4], 0.0), 4.0);
        // One that waits for its bytes needs no core.
        near(takes(cluster(2, 1), &[2.0, 2.0], 1.0), 5.0);
        near(takes(cluster(1, 1), &[2.0, 2.0], 1.0), 6.0);
        near(takes(Cluster { workers: 4, cores: 4, dispatch_s: 0.5 }, &[1.0; 4], 0.0), 3.0);
        near(takes(cluster(3, 3), &[], 0.0), 0.0);
    }
}
