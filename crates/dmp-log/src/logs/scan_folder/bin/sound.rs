//! Finds the layout of points without a header from their values.
//!
//! A byte of a number looks like the bytes at the same place in other points: the exponents of x are alike, a ring has a
//! high byte of zero. Read with a wrong length of a point, places are mixed. So the length is the one at which the bytes
//! of each place are least mixed: their mean entropy is smallest. The order of the points means nothing to it.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::layout::{BinLayout, KNOWN};
use crate::file::ReadCount;
use crate::points::{Layout, Rows};
use crate::{LogError, PlaceInFile};

/// Files that are looked at, and the bytes read of all together.
const FILES: usize = 16;
const ALL_BYTES: u64 = 1 << 20;
/// Lengths of a point that are tried, bytes.
const LENGTHS: std::ops::RangeInclusive<usize> = 8..=48;
/// Fewer bytes tell no layout: the usual one is taken.
const LEAST_BYTES: usize = 16_000;
/// Several points together may be less mixed by their order: a part of the best length may be right if it is at most
/// this much more mixed, bits.
const BY_ORDER: f64 = 0.3;
/// Parts of a file in which coordinates are compared, the fewest points of one, and how alike they are, in their spread.
const PARTS: usize = 8;
const FEWEST_OF_PART: usize = 100;
const ALIKE_BY: f64 = 0.2;
/// Neighbours of a scan lie near each other: the least correlation of one number of several points.
const TOGETHER: f64 = 0.5;
/// Bytes mixed at random are this much more mixed than those of the right length, bits.
const CLEAR: f64 = 0.1;
/// Share of points whose values must be possible.
const POSSIBLE: f64 = 0.98;
/// No LiDAR sees farther, metres; a smaller coordinate that is not zero is no float at all.
const FARTHEST_M: f64 = 2000.0;
const SMALLEST_M: f64 = 1e-8;
/// Times of points are seconds on some clock, or at most nanoseconds of a second and a half.
const MOST_TIME: f64 = 2e9;

/// The layout of the files of a folder, and a note on where it is from; `said` if it was given.
pub(in super::super) fn layout_of(
    folder: &Path,
    files: &[PathBuf],
    said: Option<&BinLayout>,
    count: &ReadCount,
) -> Result<(Layout, Option<String>), LogError> {
    let usual = || parsed(KNOWN[0].1);
    if let Some(said) = said {
        return Ok((said.layout().clone(), Some(format!("points of {said}, as given"))));
    }
    let samples = samples(files, count)?;
    if samples.iter().map(Vec::len).sum::<usize>() < LEAST_BYTES {
        return Ok((usual(), None));
    }
    let lengths = lengths_of(&samples);
    let wrong = |problem: String| {
        let problem = format!(
            "{problem}. Say the layout, as --bin-layout {}; docs/formats.md has those that are known",
            KNOWN[2].1
        );
        LogError::malformed(folder, PlaceInFile::WholeFile, problem)
    };
    let Some(&length) = lengths.first() else {
        // As of scans without a return, all zeros.
        if fits(&usual(), &samples) {
            return Ok((usual(), None));
        }
        return Err(wrong("the files have no header, and their bytes repeat at no length of a point".into()));
    };
    let of_length =
        |length: usize| KNOWN.iter().filter(move |(_, text)| parsed(text).point_bytes() as usize == length);
    let mut of_lengths = lengths.iter().flat_map(|&length| of_length(length));
    let Some((whose, text)) = of_lengths.find(|(_, text)| fits(&parsed(text), &samples)) else {
        let scaled =
            if length == 8 { ": NCLT's have 16-bit integers, see docs/guide/datasets.md" } else { "" };
        return Err(wrong(format!(
            "the files have no header; points have {length} bytes by their values, which fit no layout known here{scaled}"
        )));
    };
    let note = (*text != KNOWN[0].1)
        .then(|| format!("points of {text}, as {whose} has them: found from the values"));
    Ok((parsed(text), note))
}

pub(super) fn parsed(text: &str) -> Layout {
    // Those of the table are right: a test reads them all.
    text.parse::<BinLayout>()
        .map_or_else(|_| Layout::of_nothing(Vec::new(), false, 16), |layout| layout.layout().clone())
}

/// The first bytes of some of the files.
fn samples(files: &[PathBuf], count: &ReadCount) -> Result<Vec<Vec<u8>>, LogError> {
    let looked_at = files.len().min(FILES);
    let read = |path: &PathBuf| {
        let mut bytes = Vec::new();
        let file = count.open(path).map_err(|e| LogError::io(path, "open", e))?;
        let read = file.take(ALL_BYTES / looked_at as u64).read_to_end(&mut bytes);
        read.map_err(|e| LogError::io(path, "read", e))?;
        Ok(bytes)
    };
    (0..looked_at).map(|k| read(&files[k * files.len() / looked_at])).collect()
}

/// The lengths of a point at which the bytes of each place are least mixed, shortest first; none if no length stands out.
fn lengths_of(samples: &[Vec<u8>]) -> Vec<usize> {
    let mixed: Vec<(usize, f64)> = LENGTHS.map(|length| (length, mean_entropy(samples, length))).collect();
    let Some(&(longest, least)) = mixed.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { return Vec::new() };
    let most = mixed.iter().map(|(_, bits)| *bits).fold(0.0, f64::max);
    let may_be = |&(length, bits): &(usize, f64)| longest % length == 0 && bits <= least + BY_ORDER;
    let found = mixed.into_iter().filter(|_| most - least > CLEAR).filter(may_be);
    found.map(|(length, _)| length).collect()
}

/// Mean over the places in a point of the entropy of their bytes, bits; corrected for the number of points (Miller 1955).
fn mean_entropy(samples: &[Vec<u8>], length: usize) -> f64 {
    let mut counts = vec![[0u32; 256]; length];
    for sample in samples {
        for point in sample.chunks_exact(length) {
            point.iter().zip(&mut counts).for_each(|(&byte, counts)| counts[usize::from(byte)] += 1);
        }
    }
    let entropy = |counts: &[u32; 256]| {
        let all: f64 = counts.iter().copied().map(f64::from).sum();
        let shares = || counts.iter().filter(|count| **count > 0).map(|count| f64::from(*count) / all);
        shares().map(|share| -share * libm::log2(share)).sum::<f64>()
            + (shares().count() as f64 - 1.0) / (2.0 * all * std::f64::consts::LN_2)
    };
    counts.iter().map(entropy).sum::<f64>() / length as f64
}

/// Whether the values of almost all points are possible in a layout, in most files: some may be damaged.
fn fits(layout: &Layout, samples: &[Vec<u8>]) -> bool {
    let fitting = samples.iter().filter(|sample| fits_file(layout, sample)).count();
    2 * fitting > samples.len()
}

fn fits_file(layout: &Layout, sample: &[u8]) -> bool {
    let (mut all, mut possible) = (0u64, 0u64);
    let mut extremes = [f64::INFINITY, f64::NEG_INFINITY];
    let times = ["t", "offset_time", "time_offset_ns"].into_iter().find_map(|name| layout.field(name));
    let rows = Rows::one(layout, sample, sample.len() / layout.point_bytes().max(1) as usize);
    for (place_m, [ring, time]) in rows.values([layout.field("ring"), times]) {
        let is_length = |c: &f64| c.is_nan() || *c == 0.0 || (SMALLEST_M..FARTHEST_M).contains(&c.abs());
        let is_ring = ring.is_none_or(|ring| (0.0..256.0).contains(&ring) && ring.fract() == 0.0);
        let is_time = time.is_none_or(|time| time == 0.0 || (1e-12..MOST_TIME).contains(&time.abs()));
        all += 1;
        possible += u64::from(place_m.iter().all(is_length) && is_ring && is_time);
        if let Some(time) = time.filter(|time| time.is_finite()) {
            extremes = [extremes[0].min(time), extremes[1].max(time)];
        }
    }
    // Times are not all one.
    let are_times = times.is_none() || extremes[0] < extremes[1];
    let places_m: Vec<[f64; 3]> = rows.values([None; 2]).map(|(place_m, _)| place_m).collect();
    are_times && possible as f64 >= POSSIBLE * all as f64 && !are_of_several_points(&places_m)
}

/// Whether x and z of most parts of a file have one mean and one spread, and go together. Then they are one number of
/// several points: all x stand before all y, or a point is a range and an intensity.
fn are_of_several_points(places_m: &[[f64; 3]]) -> bool {
    let parts: Vec<_> = places_m.chunks(places_m.len().div_ceil(PARTS).max(FEWEST_OF_PART)).collect();
    let is_one = |part: &&&[[f64; 3]]| {
        let of = |axis: usize| {
            let mean = part.iter().map(|place| place[axis]).sum::<f64>() / part.len() as f64;
            let square = part.iter().map(|place| (place[axis] - mean) * (place[axis] - mean)).sum::<f64>();
            (mean, (square / part.len() as f64).sqrt())
        };
        let [(x, spread), (z, its)] = [of(0), of(2)];
        let together = part.iter().map(|place| (place[0] - x) * (place[2] - z)).sum::<f64>();
        spread > 0.0
            && (z - x).abs() <= ALIKE_BY * spread
            && (its - spread).abs() <= ALIKE_BY * spread
            && together / part.len() as f64 > TOGETHER * spread * its
    };
    2 * parts.iter().filter(is_one).count() > parts.len()
}
