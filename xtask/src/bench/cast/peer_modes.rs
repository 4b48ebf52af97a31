//! The other casters among themselves: which of their ways is the fastest here.

use std::path::PathBuf;

use anyhow::{Context as _, ensure};
use clap::Args;

use super::peers::{Exact, Peer, PeerKind, RAY_BYTES};
use crate::bench::{circumstances, spread};

/// Embree and `open3d` on a scene's files, in all their modes, beside exact ranges
#[derive(Debug, Args)]
pub(crate) struct PeerArgs {
    /// Folder of the scenes
    folder: PathBuf,
    /// Names of the scenes
    #[arg(required = true)]
    scenes: Vec<String>,
    /// Casts in each mode, interleaved
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// A Python that has `open3d`
    #[arg(long, default_value = "python3")]
    python: PathBuf,
    /// The core that everything runs on
    #[arg(long, default_value_t = 0)]
    core: usize,
    /// Options of `cast` of bench/peers/embree, in one word; once for each Embree to compare
    #[arg(long, default_values = ["", "--isa avx2"], allow_hyphen_values = true)]
    embree: Vec<String>,
    /// Only modes whose name contains this
    #[arg(long, default_value = "")]
    only: String,
}

const EMBREE_MODES: [&str; 11] = [
    "single",
    "single-bounded",
    "single-filter",
    "wide4",
    "wide8",
    "wide16",
    "wide8-bounded",
    "wide16-bounded",
    "wide16-incoherent",
    "stream",
    "stream-bounded",
];

/// One mode of one caster and what was measured.
struct Row {
    peer: usize,
    mode: &'static str,
    times_s: Vec<f64>,
}

pub(crate) fn run(arguments: &PeerArgs) -> anyhow::Result<()> {
    println!(
        "core {}, {} casts in each mode, interleaved; {}",
        arguments.core,
        arguments.runs,
        circumstances()
    );
    arguments.scenes.iter().try_for_each(|scene| measure(arguments, scene))
}

fn measure(arguments: &PeerArgs, scene: &str) -> anyhow::Result<()> {
    let [surfels, rays] = ["surfels", "rays"].map(|kind| arguments.folder.join(format!("{scene}.{kind}")));
    let bytes = std::fs::metadata(&rays).with_context(|| rays.display().to_string())?.len();
    let count = (bytes / RAY_BYTES) as f64;
    let embrees = arguments.embree.iter().map(|options| PeerKind::embree(options));
    let open3d = PeerKind::Open3d { python: arguments.python.clone() };
    let (mut peers, mut rows) = (Vec::new(), Vec::new());
    for kind in embrees.chain([open3d]) {
        let modes = if matches!(kind, PeerKind::Embree { .. }) { &EMBREE_MODES[..] } else { &["single"] };
        match Peer::start(&kind, &surfels, &rays, Some(arguments.core)) {
            Ok(peer) => {
                println!("{scene}: {}: {}", peer.name(), peer.ready);
                let wanted = modes.iter().filter(|mode| mode.contains(&arguments.only));
                rows.extend(wanted.map(|mode| Row { peer: peers.len(), mode, times_s: Vec::new() }));
                peers.push(peer);
            }
            Err(error) => println!("{scene}: without {}: {error:#}", kind.name()),
        }
    }
    ensure!(!peers.is_empty(), "{scene}: no caster is left");
    let exact = Exact::of_scene(&arguments.folder, scene);
    let exact = exact.inspect_err(|error| println!("{scene}: without exact ranges: {error:#}")).ok();
    if let Some(exact) = &exact {
        let misses = |ranges: &[f64]| ranges.iter().filter(|range| range.is_nan()).count();
        let Exact { first_m, nearest_m, independent_m } = exact;
        let [first, nearest, independent] = [first_m, nearest_m, independent_m].map(|ranges| misses(ranges));
        println!("{scene}: exact misses: {first} first, {nearest} nearest, {independent} independent");
    }
    let told: Vec<String> = rows
        .iter()
        .map(|row| {
            let ranges = peers[row.peer].ranges(row.mode)?;
            Ok(exact.as_ref().map_or_else(String::new, |exact| agreement(&ranges, &exact.first_m)))
        })
        .collect::<anyhow::Result<_>>()?;
    for _ in 0..arguments.runs {
        for row in &mut rows {
            row.times_s.push(peers[row.peer].cast_s(row.mode)?);
        }
    }
    println!(
        "{:<34}{:<20}{:>10}{:>18}{:>10}   against exact first ranges",
        "caster", "mode", "M rays/s", "least – largest", "ratio"
    );
    let first_s = rows.first().map_or(1.0, |row| spread(row.times_s.clone())[0]);
    for (row, told) in rows.iter().zip(told) {
        let [median, least, largest] = spread(row.times_s.clone());
        let speed = |seconds: f64| count / seconds / 1e6;
        println!(
            "{:<34}{:<20}{:>10.2}{:>18}{:>9.2}x   {told}",
            peers[row.peer].name(),
            row.mode,
            speed(median),
            format!("{:.2} – {:.2}", speed(largest), speed(least)),
            first_s / median
        );
    }
    Ok(())
}

/// How far ranges agree with the exact ones, in words.
fn agreement(ranges: &[f32], exact_m: &[f64]) -> String {
    let pairs = || ranges.iter().map(|&range| f64::from(range)).zip(exact_m.iter().copied());
    let both = pairs().filter(|(a, b)| !a.is_nan() && !b.is_nan()).count();
    let off = pairs().filter(|(a, b)| (a - b).abs() > 1e-3).count();
    let lost = pairs().filter(|(a, b)| a.is_nan() && !b.is_nan()).count();
    let found = pairs().filter(|(a, b)| !a.is_nan() && b.is_nan()).count();
    format!("{off} of {both} off by over 1 mm, {lost} more misses, {found} fewer")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agreement_counts_what_is_off_lost_and_found() {
        let nan = f64::NAN;
        let told =
            agreement(&[1.0, 2.01, f32::NAN, 4.0, f32::NAN, f32::NAN], &[1.0005, 2.0, 3.0, nan, nan, 6.0]);
        assert_eq!(told, "1 of 2 off by over 1 mm, 2 more misses, 1 fewer");
    }
}
