//! How fast residuals are squared and added up.

use clap::Args;
use dmp_reduce::{Basis, FrameSums, Residuals, SurfaceGroup};

use super::times::{circumstances, on_core_s, spread};
use crate::trials::Random;

/// Returns of a scan.
const SCAN: usize = 60_000;
/// Residuals that are added up in one timing: half a second, as some systems tell the time on a core in steps of 4 ms.
const TIMED: usize = 20_000_000;
/// A residual is as long as the noise of such a sensor, metres.
const NOISE_M: f64 = 0.02;

/// Adding up the residuals of a simulated drive: returns a second of one core, for one run and for several at once
#[derive(Debug, Args)]
pub(crate) struct ReduceArgs {
    /// Runs that are scored together, each number in its turn
    #[arg(long, value_delimiter = ',', default_value = "1,2,4,12")]
    together: Vec<usize>,
    /// Scans of 60,000 returns
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    scans: u32,
    /// How often they are added up
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u32).range(5..))]
    runs: u32,
}

pub(crate) fn run(arguments: &ReduceArgs) -> anyhow::Result<()> {
    let returns = SCAN * arguments.scans as usize;
    println!(
        "{} returns, one thread, its time on the core, {} runs; {}",
        returns,
        arguments.runs,
        circumstances()
    );
    println!("{:<10}{:>24}{:>28}", "together", "ns a return and run", "least – largest");
    for &together in &arguments.together {
        anyhow::ensure!(together > 0, "--together {together}: one run at least");
        let residuals = residuals(returns, together);
        let mut frame = FrameSums::new(&vec![Basis::CrossValidated; together]);
        let mut times_ns = Vec::new();
        for _ in 0..arguments.runs {
            let passes = TIMED.div_ceil(residuals.len());
            let start_s = on_core_s()?;
            for scan in (0..passes).flat_map(|_| residuals.chunks(SCAN * together)) {
                frame.clear();
                for of_return in scan.chunks_exact(together) {
                    frame.add_return(of_return);
                }
                std::hint::black_box(&frame);
            }
            times_ns.push((on_core_s()? - start_s) * 1e9 / (passes * residuals.len()) as f64);
        }
        let [ns, least, largest] = spread(times_ns);
        println!("{together:<10}{ns:>24.1}{:>28}", format!("{least:.1} – {largest:.1}"));
    }
    Ok(())
}

/// Return after return, of each what every run leaves. Neighbouring returns lie on one surface, on which all runs agree but for
/// one return in twenty; of seven stretches of 300 returns two see nothing that another part of the drive measured; one return
/// in 30 is blocked, one in 300 misses.
fn residuals(returns: usize, runs: usize) -> Vec<Residuals> {
    let mut random = Random::of(&[1]);
    let mut below = |most: f64| most * random.below(1 << 20) as f64 / f64::from(1 << 20);
    let mut residuals = Vec::with_capacity(returns * runs);
    for number in 0..returns {
        let [surface, stretch] = [number / 40, number / 300].map(|k| k as i32);
        let (chance, apart) = (below(1.0), below(1.0) < 0.05);
        let blocked_m = below(20.0);
        for run in 0..runs {
            let noise_m = below(2.0 * NOISE_M) - NOISE_M;
            let first_m = if chance < 1.0 / 30.0 { blocked_m } else { noise_m };
            let hits = chance < 1.0 - 1.0 / 300.0;
            let piece = if apart { [surface, run as i32, 1] } else { [surface, 0, 0] };
            residuals.push(Residuals {
                first_m: hits.then_some(first_m),
                nearest_m: hits.then_some(noise_m),
                independent_m: (hits && stretch % 7 > 1).then_some(first_m),
                revisited: stretch % 50 == 2,
                surfaces: [SurfaceGroup::of_cube(piece), SurfaceGroup::NONE],
                ..Residuals::MISS
            });
        }
    }
    residuals
}
