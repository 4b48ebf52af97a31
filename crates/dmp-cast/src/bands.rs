//! Keys that sort rays to their neighbours: by sector, shell of range, band of elevation, azimuth.

use crate::query::Query;

/// Largest height of a band at its largest range, in radii of a disc.
const BAND_RADII: f32 = 6.0;
/// Rays farther than this from their neighbour in a band start a new packet, radii of a disc at the shell.
const GAP_RADII: f32 = 12.0;
/// Largest height of a band, in steps between consecutive rays: sixteen rays fill a square.
const BAND_STEPS: f32 = 4.0;

/// Where the first and the last shell begin: powers of two, in heights of a band. Rays beyond belong to them too.
const FIRST_SHELL: f32 = 1.0;
const LAST_SHELL: f32 = 256.0;
const SHELLS: usize = 9;
/// Most bands of a shell, as limited by the step between rays.
const MOST_BY_STEPS: f32 = 384.0;
pub(crate) const BANDS: u32 = 1 << BAND_BITS;
const BAND_BITS: u32 = 12;
// The last shell has two bands per height; the others have at most that, or as many as the steps require.
const _: () = assert!(MOST_BY_STEPS as u32 * (SHELLS as u32 - 1) + 2 * LAST_SHELL as u32 <= BANDS);
/// Steps of azimuth around a band: those of a sector in the low bits, the sector above.
const AZIMUTHS: u32 = 1 << (AZIMUTH_BITS + SECTOR_BITS);
pub(crate) const AZIMUTH_BITS: u32 = 9;
const SECTOR_BITS: u32 = 3;
/// Pairs of rays sampled for the step between consecutive rays.
const PAIRS: usize = 64;

/// The division of rays into bands.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bands {
    /// Heights of a band per metre of range.
    heights_per_m: f32,
    /// Number of bands of each shell.
    counts: [f32; SHELLS],
    /// First band of each shell.
    starts: [f32; SHELLS],
}

impl Bands {
    /// Bands for these rays into discs of this radius, metres.
    ///
    /// At its largest range a band is at most [`BAND_RADII`] high. A packet tests everything within a disc's radius, so
    /// a long row costs little more than a square, and rings farther apart stay separate. If rays are closer than that,
    /// long rows have no benefit: a band is then four rays high.
    pub(crate) fn of(queries: &[Query], radius_m: f32) -> Self {
        let heights_per_m = 1.0 / (BAND_RADII * radius_m).max(f32::MIN_POSITIVE);
        // Elevations are numbered by their sines, from −1 to 1.
        let by_steps = (2.0 / (BAND_STEPS * step_between(queries))).min(MOST_BY_STEPS);
        let mut bands = Self { heights_per_m, ..Self::default() };
        let (mut shell, mut start) = (FIRST_SHELL, 0.0);
        for k in 0..SHELLS {
            (bands.counts[k], bands.starts[k]) = ((2.0 * shell).max(by_steps).floor(), start);
            (start, shell) = (start + bands.counts[k], 2.0 * shell);
        }
        bands
    }

    /// Sector (3 bits), shell and band (12), azimuth in the sector (9).
    #[inline(always)]
    pub(crate) fn key_of(&self, query: &Query) -> u32 {
        let [x, y, z] = query.ray.direction_in_world.map(|c| c as f32);
        let range = (query.ray.range_m as f32 * self.heights_per_m).clamp(FIRST_SHELL, LAST_SHELL);
        let shell = ((range.to_bits() >> 23) - (FIRST_SHELL.to_bits() >> 23)) as usize % 16;
        let (count, start) = (self.counts[shell.min(SHELLS - 1)], self.starts[shell.min(SHELLS - 1)]);
        let band = (start + ((1.0 + z) * 0.5 * count).min(count - 1.0)) as u32;
        // Grows with the angle in the plane, from 0 to 4, without a sine.
        let sum = x.abs() + y.abs();
        let part = if sum > 0.0 { y / sum } else { 0.0 };
        let turn = if x >= 0.0 { 1.0 + part } else { 3.0 - part };
        let azimuth = (turn * (AZIMUTHS as f32 / 4.0)) as u32;
        let azimuth = azimuth.min(AZIMUTHS - 1);
        let (sector, azimuth) = (azimuth >> AZIMUTH_BITS, azimuth % (1 << AZIMUTH_BITS));
        (sector << BAND_BITS | band.min(BANDS - 1)) << AZIMUTH_BITS | azimuth
    }

    /// The largest step of azimuth between neighbours in a band, by any key of the band.
    #[inline(always)]
    pub(crate) fn largest_gap(&self, key: u32) -> u32 {
        let band = ((key >> AZIMUTH_BITS) % BANDS) as f32;
        let shell = self.starts.iter().rposition(|&start| start <= band).unwrap_or(0);
        let shell = FIRST_SHELL * (1u32 << shell) as f32;
        (AZIMUTHS as f32 * GAP_RADII / BAND_RADII / (6.0 * shell)) as u32 + 1
    }
}

/// The typical angle between consecutive rays with different directions, radians: a beam may have two returns. Infinite
/// for one ray.
fn step_between(queries: &[Query]) -> f32 {
    let mut steps2 = [f32::INFINITY; PAIRS];
    let stride = (queries.len() / PAIRS).max(1);
    let pairs = queries.windows(2).step_by(stride).take(PAIRS);
    let mut count = 0;
    for (step2, pair) in steps2.iter_mut().zip(pairs) {
        let [a, b] = [&pair[0], &pair[1]].map(|q| q.ray.direction_in_world);
        let along = [0, 1, 2].map(|k| (a[k] - b[k]) as f32);
        let step_here2: f32 = along.iter().map(|step| step * step).sum();
        if step_here2 > 0.0 {
            *step2 = step_here2;
            count += 1;
        }
    }
    let middle = count / 2;
    steps2.select_nth_unstable_by(middle, f32::total_cmp).1.sqrt()
}
