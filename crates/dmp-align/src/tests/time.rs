//! How long a registration takes.

use std::time::Instant;

use super::visits::{moved, pyramid, turned, visits};
use crate::align;

#[test]
#[ignore = "it measures; run it in release: cargo test --release -p dmp-align --lib -- --ignored --nocapture takes"]
fn so_long_takes_one_registration() {
    for seed in 1..=3 {
        let [first, second] = visits(seed);
        let by = turned(0.02, [1.0, 0.8, -0.3]);
        let (target, source) = (pyramid(first), pyramid(moved(&by, &second)));
        println!("seed {seed}: {} bytes for {} surfels", target.bytes(), target.surfels());
        let guesses = [-4.0, 0.0, 4.0].map(|x| [-4.0, 0.0, 4.0].map(|y| turned(0.0, [x, y, 0.0])));
        let guesses = guesses.as_flattened();
        for guesses in [&[], guesses] {
            let mut times_ms: Vec<f64> = (0..31)
                .map(|_| {
                    let start = Instant::now();
                    assert!(align(&target, &source, guesses).is_ok());
                    start.elapsed().as_secs_f64() * 1e3
                })
                .collect();
            times_ms.sort_by(f64::total_cmp);
            println!(
                "seed {seed}: {} and {} surfels, {} guesses: {:.2} ms at least, {:.2} ms in the middle",
                target.surfels(),
                source.surfels(),
                guesses.len().max(1),
                times_ms[0],
                times_ms[times_ms.len() / 2],
            );
        }
    }
}
