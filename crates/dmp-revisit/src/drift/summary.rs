//! Summarises the displacements of a run.

use dmp_reduce::Confidence;
use dmp_reduce::mixed;

use super::displacement::Displacement;
use super::report::{DriftBin, DriftComparison, Measured, RunDrift, VisitPairReport};

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
pub struct PairFacts {
    /// Pairs with the same number are assumed to have correlated drift.
    pub block: usize,
    /// Distance travelled between the visits, metres.
    pub way_m: f64,
    /// Time between them, seconds.
    pub time_s: Option<f64>,
}

/// Assigns blocks to pairs, keyed by the segments of their visits in the order of the first.
pub fn blocks(segments: &[(usize, usize)]) -> Vec<usize> {
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

/// A pair of visits with a distance, or at least a bound on it.
#[derive(Debug, Clone, Copy)]
struct Entry {
    facts: PairFacts,
    distance_m: f64,
    /// What noise of the measurement adds to its square.
    noise_m2: f64,
    /// Variance of its square; 0 of a bound.
    variance_m4: f64,
}

impl Entry {
    fn of(visit: &VisitPairReport, facts: PairFacts) -> Option<Self> {
        let bound = visit.at_least_m.map(|distance_m| (distance_m, 0.0, 0.0));
        let measured = visit.off.as_ref().and_then(|off| {
            Some((off.distance_m?, off.noise_m2().iter().sum(), off.variance_of_square_m4()?))
        });
        let (distance_m, noise_m2, variance_m4) = measured.or(bound)?;
        Some(Self { facts, distance_m, noise_m2, variance_m4 })
    }

    fn square_m2(&self) -> f64 {
        self.distance_m * self.distance_m - self.noise_m2
    }
}

/// What is known of a run's visits beside their displacements.
#[derive(Debug, Clone, Copy)]
pub struct RunFacts<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its path length, metres.
    pub travel_m: f64,
    /// Number of segments of its path.
    pub segments: usize,
    /// Number of pairs of visits found.
    pub pairs_found: usize,
    /// How far around its poses was searched, metres.
    pub searched_m: f64,
    /// Of each pair that was looked at.
    pub pairs: &'a [PairFacts],
}

/// A run's part of the report.
pub fn of_run(
    of_run: &RunFacts<'_>,
    visits: Vec<VisitPairReport>,
    (metre_m, confidence): (f64, Confidence),
) -> RunDrift {
    let entry = |(visit, &facts): (&VisitPairReport, &PairFacts)| Entry::of(visit, facts);
    let entries: Vec<Entry> = visits.iter().zip(of_run.pairs).filter_map(entry).collect();
    let pairs_lost = visits.iter().filter(|visit| visit.at_least_m.is_some()).count();
    let offs = || visits.iter().filter_map(|visit| visit.off.as_ref());
    let with_interval = |of: &dyn Fn(&[&Entry]) -> Option<f64>| {
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
    let RunFacts { name, travel_m, segments, pairs_found, searched_m, .. } = *of_run;
    let mut drift = RunDrift {
        name: name.to_owned(),
        travel_m,
        segments,
        pairs_found,
        pairs_measured: visits.len(),
        pairs: entries.len() - pairs_lost,
        pairs_in_part: offs().count() + pairs_lost - entries.len(),
        pairs_lost,
        searched_m,
        pairs_refused: visits.len() - offs().count() - pairs_lost,
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
        visits: Vec::new(),
    };
    drift.visits = visits;
    drift
}

/// Lengths, clamped at 0.
fn length(measured: Measured) -> Measured {
    Measured { interval: measured.interval.map(|ends| ends.map(|end| end.max(0.0))), ..measured }
}

/// Two runs on the pairs of visits that both have; of the first the block of each pair and the scans with which its segments
/// begin. The visits of two runs, whose segments are their own, are the same up to one segment. `confidences`: of the interval, and of
/// what is decided.
pub fn compared(
    [a, b]: [&RunDrift; 2],
    blocks_of_a: &[usize],
    starts_of_a: &[usize],
    confidences: [Confidence; 2],
) -> DriftComparison {
    // Pairs on which only the other has an answer.
    let mut silent = [0.0; 2];
    let (mut both, mut blocks, mut variance_m4) = (Vec::new(), Vec::new(), 0.0);
    let mut left: Vec<&VisitPairReport> = b.visits.iter().collect();
    for (visit, &block) in a.visits.iter().zip(blocks_of_a) {
        let near = |(k, other): (usize, &&VisitPairReport)| {
            segments_apart(visit, other, starts_of_a).map(|apart| (apart, k))
        };
        let nearest = left.iter().enumerate().filter_map(near).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, same)) = nearest else { continue };
        let pair = [visit, left.remove(same)];
        let facts = PairFacts { block, way_m: 0.0, time_s: None };
        let entries = pair.map(|visit| Entry::of(visit, facts));
        for k in 0..2 {
            let is_silent = pair[k].off.is_none() && pair[k].at_least_m.is_none();
            silent[k] += f64::from(u8::from(is_silent && entries[1 - k].is_some()));
        }
        let [Some(of_a), Some(of_b)] = entries else { continue };
        both.push((of_a.square_m2(), of_b.square_m2()));
        blocks.push(block);
        variance_m4 += of_a.variance_m4 + of_b.variance_m4;
    }
    let pairs = both.len() as f64;
    let difference = |chosen: &[usize]| {
        let sum: f64 = chosen.iter().map(|&k| both[k].0 - both[k].1).sum();
        (!chosen.is_empty()).then(|| sum / chosen.len() as f64)
    };
    let [difference_m2, decides] = confidences
        .map(|confidence| measured(&blocks, confidence, variance_m4 / (pairs * pairs), &difference));
    // Who is lost, or silent more often than the other by over two standard errors, is not better.
    let may_win = [0, 1].map(|k| {
        let more: f64 = silent[k] - silent[1 - k];
        [a, b][k].pairs_lost == 0 && (more <= 0.0 || more * more <= 4.0 * (silent[k] + silent[1 - k]))
    });
    let better = match decides.interval {
        Some([_, high]) if high < 0.0 && may_win[0] => Some(a.name.clone()),
        Some([low, _]) if low > 0.0 && may_win[1] => Some(b.name.clone()),
        _ => None,
    };
    DriftComparison {
        a: a.name.clone(),
        b: b.name.clone(),
        pairs: both.len(),
        rms_a_m: rms(&both.iter().map(|(a, _)| *a).collect::<Vec<_>>()),
        rms_b_m: rms(&both.iter().map(|(_, b)| *b).collect::<Vec<_>>()),
        difference_m2,
        better,
    }
}

/// How many segments two pairs of visits, of two runs, lie apart in all; `None` where either visit is off by more than one.
fn segments_apart(a: &VisitPairReport, b: &VisitPairReport, starts: &[usize]) -> Option<f64> {
    let place = |scan: usize| {
        let next = starts.partition_point(|&start| start <= scan);
        let segment = next.saturating_sub(1);
        let part = match starts.get(segment..=next) {
            Some(&[start, end]) => (scan - start) as f64 / (end - start) as f64,
            _ => 0.0,
        };
        segment as f64 + part
    };
    let apart = |a: usize, b: usize| (place(a) - place(b)).abs();
    let (first, second) = (apart(a.first.scan, b.first.scan), apart(a.second.scan, b.second.scan));
    (first.max(second) <= 1.0).then_some(first + second)
}

fn distances(chosen: &[&Entry]) -> Vec<f64> {
    chosen.iter().map(|entry| entry.distance_m).collect()
}

fn rms_of<'a>(entries: impl Iterator<Item = &'a Entry>) -> Option<f64> {
    rms(&entries.map(Entry::square_m2).collect::<Vec<_>>())
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
fn curve(entries: &[Entry], first: f64, of: impl Fn(&PairFacts) -> Option<f64>) -> Vec<DriftBin> {
    let mut bins = Vec::new();
    let (mut from, mut to) = (0.0, first);
    let longest = entries.iter().filter_map(|entry| of(&entry.facts)).fold(0.0, f64::max);
    while from <= longest {
        let within = |entry: &&Entry| of(&entry.facts).is_some_and(|value| (from..to).contains(&value));
        let some: Vec<&Entry> = entries.iter().filter(within).collect();
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
