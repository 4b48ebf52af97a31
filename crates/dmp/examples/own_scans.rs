//! Scores scans in memory, shows the progress, and stops after a time limit:
//! `cargo run --release -p dmp-slam --example own_scans -- [SECONDS]`.

use std::error::Error;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use dmp::prelude::*;

const SCANS: i64 = 60;
const PERIOD_NS: i64 = 100_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    let most_s: f64 = std::env::args().nth(1).map_or(Ok(60.0), |seconds| seconds.parse())?;

    // Your scans: points in the sensor's frame, metres, each scan with a stamp; with point times if available.
    let log = MemoryLog::new("hall", (0..SCANS).map(scan).collect())?;
    // Your trajectories: stamped poses of the body. The second run sways by 20 cm to either side.
    let trajectory = |sway_m: f64| {
        let y_m = |k| if k % 2 == 0 { sway_m } else { -sway_m };
        let pose = |k| (k * PERIOD_NS, Isometry3::translation(x_m(k), y_m(k), 0.0));
        Trajectory::stamped((0..SCANS).map(pose).collect())
    };
    let runs =
        [Run::new("straight", trajectory(0.0)?.trajectory), Run::new("swaying", trajectory(0.2)?.trajectory)];

    let end = Instant::now().checked_add(Duration::try_from_secs_f64(most_s)?).ok_or("too many seconds")?;
    let shown = Shown { end, total: AtomicU64::new(0), done: AtomicU64::new(0) };
    match evaluate(&log, &runs, &Config::default(), &shown) {
        Ok(report) => {
            let verdict = report.verdict_between("straight", "swaying").ok_or("not compared")?;
            println!("better: {}", verdict.better().unwrap_or("neither"));
        }
        Err(EvaluateError::Cancelled) => println!("given up after {most_s} s"),
        Err(error) => return Err(error.into()),
    }
    Ok(())
}

/// Shows the progress. All threads report to it, so it counts in atomics.
struct Shown {
    end: Instant,
    total: AtomicU64,
    done: AtomicU64,
}

impl Progress for Shown {
    fn begin(&self, stage: Stage, total: u64) {
        println!("{stage:?}");
        self.total.store(total, Ordering::Relaxed);
        self.done.store(0, Ordering::Relaxed);
    }

    fn advance(&self, amount: u64) {
        let (before, total) =
            (self.done.fetch_add(amount, Ordering::Relaxed), self.total.load(Ordering::Relaxed));
        let quarters = |done: u64| (4 * done).checked_div(total).unwrap_or(0);
        if quarters(before + amount) > quarters(before) {
            println!("  {} %", 25 * quarters(before + amount));
        }
    }

    /// Called before every scan.
    fn cancelled(&self) -> bool {
        Instant::now() >= self.end
    }
}

/// The sensor's position at the `k`-th scan, along a hall of 24 m.
fn x_m(k: i64) -> f64 {
    k as f64 * 0.3 - 9.0
}

/// Its scan: directions over the sides of a cube, each extended to the wall, floor or ceiling behind.
fn scan(k: i64) -> Scan {
    let steps = || (0..48).map(|i| (i as f64 + 0.5) / 24.0 - 1.0);
    let side = |(u, v): (f64, f64)| {
        [[1.0, u, v], [-1.0, u, v], [u, 1.0, v], [u, -1.0, v], [u, v, 1.0], [u, v, -1.0]].map(|d| {
            let ahead_m = 12.0 - x_m(k) * f64::signum(d[0]);
            let out =
                f64::min(ahead_m / f64::abs(d[0]), f64::min(5.0 / f64::abs(d[1]), 2.5 / f64::abs(d[2])));
            d.map(|c| (c * out) as f32)
        })
    };
    let points_in_sensor_m = steps().flat_map(|u| steps().map(move |v| (u, v))).flat_map(side).collect();
    Scan { stamp_ns: Some(k * PERIOD_NS), points_in_sensor_m, time_offsets_ns: Vec::new() }
}
