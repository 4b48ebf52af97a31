//! Summarises the displacements of a run.

use dmp_reduce::Confidence;

use super::displacement::Displacement;
use super::report::{DriftBin, DriftComparison, Measured, RunDrift, VisitPairReport};
use crate::sample::mixed;

/// Consecutive pairs that form a block: drift changes slowly along the path. With few pairs blocks are
/// smaller, so that their number is about [`BLOCKS`].
const BLOCK_PAIRS: usize = 5;
const BLOCKS: usize = 8;
/// Pairs are consecutive if both of their visits are at most this far apart, segments.
const BLOCK_STEP: usize = 2;
/// With fewer blocks there is no interval.
const LEAST_BLOCKS: usize = 6;
/// Number of bootstrap resamples.
const RESAMPLES: usize = 1000;
/// Upper bounds of the first bins of a curve, metres of a drive and seconds.
const FIRST_WAY_M: f64 = 125.0;
const FIRST_TIME_S: f64 = 30.0;

/// The facts of a pair of visits beside its displacements.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairFacts {
    /// Pairs with the same number are assumed to have correlated drift.
    pub(super) block: usize,
    pub(super) way_m: f64,
    pub(super) time_s: Option<f64>,
}

/// Assigns blocks to pairs, keyed by the segments of their visits in the order of the first.
pub(super) fn blocks(segments: &[(usize, usize)]) -> Vec<usize> {
    let most = (segments.len() / BLOCKS).clamp(1, BLOCK_PAIRS);
    let (mut block, mut length) = (0, 0);
    let mut last: Option<(usize, usize)> = None;
    segments
        .iter()
        .map(|&(first, second)| {
            let follows = last.is_some_and(|last| {
                first.abs_diff(last.0) <= BLOCK_STEP && second.abs_diff(last.1) <= BLOCK_STEP
            });
            if last.is_some() && (!follows || length == most) {
                (block, length) = (block + 1, 0);
            }
            (last, length) = (Some((first, second)), length + 1);
            block
        })
        .collect()
}

/// A pair of visits in one run.
#[derive(Debug, Clone, Copy)]
struct Entry<'a> {
    facts: PairFacts,
    off: &'a Displacement,
    distance_m: f64,
}

fn entries<'a>(run: usize, visits: &'a [VisitPairReport], facts: &'a [PairFacts]) -> Vec<Entry<'a>> {
    let entry = |(visit, facts): (&'a VisitPairReport, &PairFacts)| {
        let off = visit.runs[run].off.as_ref()?;
        Some(Entry { facts: *facts, off, distance_m: off.distance_m? })
    };
    visits.iter().zip(facts).filter_map(entry).collect()
}

/// A run's part of the report.
pub(super) fn of_run(
    name: &str,
    run: usize,
    visits: &[VisitPairReport],
    facts: &[PairFacts],
    (metre_m, confidence): (f64, Confidence),
) -> RunDrift {
    let entries = entries(run, visits, facts);
    let offs = || visits.iter().filter_map(|visit| visit.runs[run].off.as_ref());
    let with_interval = |of: &dyn Fn(&[&Entry<'_>]) -> Option<f64>| {
        let blocks: Vec<usize> = entries.iter().map(|entry| entry.facts.block).collect();
        let of = |chosen: &[usize]| of(&chosen.iter().map(|&k| &entries[k]).collect::<Vec<_>>());
        measured(&blocks, confidence, 0.0, &of)
    };
    let part = |of: &dyn Fn(&Displacement) -> Option<(f64, f64)>| {
        let squares: Vec<f64> = offs().filter_map(of).map(|(off, noise_m2)| off * off - noise_m2).collect();
        rms(&squares)
    };
    let degrees = |of: &dyn Fn(&Displacement) -> f64| part(&|off| Some((of(off), 0.0)));
    let shares = entries.iter().filter(|entry| entry.facts.way_m > 0.0);
    RunDrift {
        name: name.to_owned(),
        pairs: entries.len(),
        pairs_in_part: offs().count() - entries.len(),
        pairs_refused: visits.len() - offs().count(),
        median_m: length(with_interval(&|chosen| quantile(distances(chosen), 0.5))),
        rms_m: length(with_interval(&|chosen| rms_of(chosen.iter().copied()))),
        p95_m: length(with_interval(&|chosen| quantile(distances(chosen), 0.95))),
        along_m: part(&|off| Some((off.along_m?, off.noise_m2()[0]))),
        sideways_m: part(&|off| Some((off.sideways_m?, off.noise_m2()[1]))),
        up_m: part(&|off| Some((off.up_m?, off.noise_m2()[2]))),
        roll_deg: degrees(&|off| off.roll_deg),
        pitch_deg: degrees(&|off| off.pitch_deg),
        yaw_deg: degrees(&|off| off.yaw_deg),
        angle_deg: degrees(&|off| off.angle_deg),
        of_the_way_percent: quantile(
            shares.map(|entry| 100.0 * entry.distance_m / entry.facts.way_m).collect(),
            0.5,
        ),
        over_way: curve(&entries, FIRST_WAY_M * metre_m, |facts| Some(facts.way_m)),
        over_time: curve(&entries, FIRST_TIME_S, |facts| facts.time_s),
    }
}

/// Lengths, clamped at 0.
fn length(measured: Measured) -> Measured {
    Measured { interval: measured.interval.map(|ends| ends.map(|end| end.max(0.0))), ..measured }
}

/// Two runs on the pairs measured in both.
pub(super) fn compared(
    (a, b): (usize, usize),
    names: [&str; 2],
    visits: &[VisitPairReport],
    facts: &[PairFacts],
    confidence: Confidence,
) -> DriftComparison {
    let of_run = |visit: &VisitPairReport, run: usize| {
        let off = visit.runs[run].off.as_ref()?;
        let square_m2 = off.distance_m? * off.distance_m? - off.noise_m2().iter().sum::<f64>();
        Some((square_m2, off.variance_of_square_m4()?))
    };
    let (mut both, mut blocks, mut variance_m4) = (Vec::new(), Vec::new(), 0.0);
    for (visit, facts) in visits.iter().zip(facts) {
        let (Some((a_m2, a_m4)), Some((b_m2, b_m4))) = (of_run(visit, a), of_run(visit, b)) else { continue };
        both.push((a_m2, b_m2));
        blocks.push(facts.block);
        variance_m4 += a_m4 + b_m4;
    }
    let pairs = both.len() as f64;
    let difference = |chosen: &[usize]| {
        let sum: f64 = chosen.iter().map(|&k| both[k].0 - both[k].1).sum();
        (!chosen.is_empty()).then(|| sum / chosen.len() as f64)
    };
    let difference_m2 = measured(&blocks, confidence, variance_m4 / (pairs * pairs), &difference);
    let better = match difference_m2.interval {
        Some([_, high]) if high < 0.0 => Some(names[0].to_owned()),
        Some([low, _]) if low > 0.0 => Some(names[1].to_owned()),
        _ => None,
    };
    DriftComparison {
        a: names[0].to_owned(),
        b: names[1].to_owned(),
        pairs: both.len(),
        rms_a_m: rms(&both.iter().map(|(a, _)| *a).collect::<Vec<_>>()),
        rms_b_m: rms(&both.iter().map(|(_, b)| *b).collect::<Vec<_>>()),
        difference_m2,
        better,
    }
}

fn distances(chosen: &[&Entry<'_>]) -> Vec<f64> {
    chosen.iter().map(|entry| entry.distance_m).collect()
}

fn rms_of<'a>(entries: impl Iterator<Item = &'a Entry<'a>>) -> Option<f64> {
    rms(&entries
        .map(|entry| entry.distance_m * entry.distance_m - entry.off.noise_m2().iter().sum::<f64>())
        .collect::<Vec<_>>())
}

/// The root of the mean; 0 if the mean is negative.
fn rms(squares: &[f64]) -> Option<f64> {
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    (!squares.is_empty()).then(|| mean.max(0.0).sqrt())
}

/// The smallest value that at least this part of all does not exceed.
fn quantile(mut values: Vec<f64>, part: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let rank = (part * values.len() as f64).ceil() as usize;
    values.get(rank.max(1) - 1).copied()
}

/// Bins that double in length; empty bins are omitted.
fn curve(entries: &[Entry<'_>], first: f64, of: impl Fn(&PairFacts) -> Option<f64>) -> Vec<DriftBin> {
    let mut bins = Vec::new();
    let (mut from, mut to) = (0.0, first);
    let longest = entries.iter().filter_map(|entry| of(&entry.facts)).fold(0.0, f64::max);
    while from <= longest {
        let within = |entry: &&Entry<'_>| of(&entry.facts).is_some_and(|value| (from..to).contains(&value));
        let some: Vec<&Entry<'_>> = entries.iter().filter(within).collect();
        if let (Some(rms_m), Some(median_m)) = (rms_of(some.iter().copied()), quantile(distances(&some), 0.5))
        {
            bins.push(DriftBin { from, to, pairs: some.len(), rms_m, median_m });
        }
        (from, to) = (to, 2.0 * to);
    }
    bins
}

/// A statistic over entries, given the block of each. Its interval is that of Student's t with one degree of
/// freedom less than there are blocks. The standard error comes from a bootstrap over blocks (Efron &
/// Tibshirani 1993, "An Introduction to the Bootstrap", §6.2; percentiles are too narrow for few blocks),
/// plus `variance_known` from the uncertainty of each entry.
fn measured(
    blocks: &[usize],
    confidence: Confidence,
    variance_known: f64,
    of: &dyn Fn(&[usize]) -> Option<f64>,
) -> Measured {
    let all: Vec<usize> = (0..blocks.len()).collect();
    let members: Vec<&[usize]> = all.chunk_by(|&a, &b| blocks[a] == blocks[b]).collect();
    let value = of(&all);
    let Some(middle) = value.filter(|_| members.len() >= LEAST_BLOCKS) else {
        return Measured { value, interval: None };
    };
    let drawn: Vec<f64> = (0..RESAMPLES)
        .filter_map(|resample| {
            let draw = |k: usize| {
                let drawn = u128::from(mixed((resample * members.len() + k) as u64));
                members[((drawn * members.len() as u128) >> 64) as usize]
            };
            let chosen = (0..members.len()).flat_map(draw);
            of(&chosen.copied().collect::<Vec<_>>())
        })
        .collect();
    let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
    let variance =
        drawn.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / drawn.len() as f64;
    // Resampled blocks scatter less than the blocks do, since they are drawn about their own mean.
    let degrees = members.len() - 1;
    let error = (variance * members.len() as f64 / degrees as f64 + variance_known).sqrt();
    let half = if error > 0.0 { confidence.student_t(degrees as u64) * error } else { 0.0 };
    Measured { value, interval: Some([middle - half, middle + half]) }
}

#[cfg(test)]
mod tests;
