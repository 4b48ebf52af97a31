//! Which rays go together.

use crate::packet_rays::RAYS;
use crate::query::Query;

/// Height of the bands that rays are sorted into, as far away as they reach, metres.
const BAND_M: f32 = 0.5;
/// The largest shell begins here; rays beyond are in it too. A power of two, metres.
const LAST_SHELL_M: f32 = 128.0;
/// Steps of azimuth around a band: those of a sector below, the sector above.
const AZIMUTHS: u32 = 1 << (AZIMUTH_BITS + SECTOR_BITS);
const AZIMUTH_BITS: u32 = 9;
const SECTOR_BITS: u32 = 3;
const BANDS: u32 = 1 << BAND_BITS;
const BAND_BITS: u32 = 12;
/// Rays whose neighbour in a band is further than this from them begin a new packet, metres at the shell.
const GAP_M: f32 = 1.0;

/// Packets are cut at gaps only where they have so many rays: with fewer, what a packet costs by itself is worse than
/// rays that do not belong together.
const LEAST_RAYS: usize = 8;
/// Rays whose origins are further apart do not belong together: those of another scan, metres.
const ORIGINS_M: f64 = 0.5;

/// Bits sorted by at a time.
const DIGIT_BITS: u32 = 12;
const DIGITS: usize = 1 << DIGIT_BITS;

/// Rays in the order in which they are cast, and their packets.
#[derive(Debug, Default)]
pub(crate) struct Order {
    /// Key above, index of the query below.
    sorted: Vec<u64>,
    other: Vec<u64>,
    counts: Vec<u32>,
}

impl Order {
    /// Takes the queries as they come.
    pub(crate) fn as_given(&mut self, queries: &[Query]) {
        self.sorted.clear();
        self.sorted.extend(0..queries.len() as u64);
    }

    /// Brings neighbours in direction and range together, among rays that follow each other from about one place
    /// in one segment.
    ///
    /// Rays are cut into eight sectors, so that what is cast one after the other meets the same part of the map, a
    /// sector into shells by the octave of the measured range, a shell into bands of elevation about [`BAND_M`] high
    /// there, and a band is run through by azimuth. So the rings of a spinning sensor come out one after the other
    /// without their numbers being known; near ones, which lie closer than a disc, together.
    #[inline(always)]
    pub(crate) fn by_direction(&mut self, queries: &[Query]) {
        self.sorted.clear();
        self.sorted.reserve(queries.len());
        self.other.resize(queries.len(), 0);
        let mut start = 0;
        let Some(first) = queries.first() else { return };
        let (mut place, mut segment) = (first.origin_in_world_m, first.segment);
        for (index, query) in queries.iter().enumerate() {
            let origin = query.origin_in_world_m;
            let is_near = |k: usize| (origin[k] - place[k]).abs() <= ORIGINS_M;
            let same_segment = query.segment == segment;
            if !(is_near(0) & is_near(1) & is_near(2) & same_segment) {
                self.sort(start, index);
                (start, place, segment) = (index, origin, query.segment);
            }
            self.sorted.push(u64::from(key_of(query)) << 32 | index as u64);
        }
        self.sort(start, queries.len());
    }

    /// Sorts a range of the entries by their keys.
    #[inline(always)]
    fn sort(&mut self, start: usize, end: usize) {
        let (sorted, other) = (&mut self.sorted[start..end], &mut self.other[start..end]);
        if sorted.len() < DIGITS / 8 {
            sorted.sort_unstable();
            return;
        }
        let counts = &mut self.counts;
        counts.clear();
        counts.resize(2 * DIGITS, 0);
        let digits = |entry: u64| [entry >> 32, entry >> (32 + DIGIT_BITS)].map(|d| d as usize % DIGITS);
        for &entry in &*sorted {
            let [low, high] = digits(entry);
            counts[low] += 1;
            counts[DIGITS + high] += 1;
        }
        for counts in counts.chunks_exact_mut(DIGITS) {
            counts.iter_mut().fold(0, |sum, count| sum + std::mem::replace(count, sum));
        }
        let (lows, highs) = counts.split_at_mut(DIGITS);
        for &entry in &*sorted {
            let at = &mut lows[digits(entry)[0]];
            other[*at as usize] = entry;
            *at += 1;
        }
        for &entry in &*other {
            let at = &mut highs[digits(entry)[1]];
            sorted[*at as usize] = entry;
            *at += 1;
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.sorted.len()
    }

    /// The packet that begins at `start`: up to sixteen rays, where possible of one band and without a gap.
    #[inline(always)]
    pub(crate) fn packet(&self, start: usize) -> &[u64] {
        let rest = &self.sorted[start..self.len().min(start + RAYS)];
        let key = |entry: u64| (entry >> 32) as u32;
        let (first, last) = (key(rest[0]), key(rest[rest.len() - 1]));
        // Keys of the next run may be smaller again.
        let goes_on =
            |a: u32, b: u32| a >> AZIMUTH_BITS == b >> AZIMUTH_BITS && b.wrapping_sub(a) <= largest_gap(a);
        if goes_on(first, last) {
            return rest;
        }
        let mut ends = (LEAST_RAYS..rest.len()).filter(|&at| !goes_on(key(rest[at - 1]), key(rest[at])));
        let end = ends.next().unwrap_or(rest.len());
        &rest[..end]
    }
}

/// Sector (3 bits), shell and band (12), azimuth in the sector (9).
#[inline(always)]
fn key_of(query: &Query) -> u32 {
    let [x, y, z] = query.direction_in_world.map(|c| c as f32);
    // Twice the number of bands of a shell is that of the next, so shells lie one behind the other.
    let range_m = (query.measured_m as f32).clamp(0.5, LAST_SHELL_M);
    let shell_m = f32::from_bits(range_m.to_bits() & 0x7f80_0000);
    let bands = shell_m * (2.0 / BAND_M);
    let band = (bands + (1.0 + z) * 0.5 * bands) as u32;
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
fn largest_gap(key: u32) -> u32 {
    let band = (key >> AZIMUTH_BITS) % BANDS;
    // Bands of a shell begin at their number: the highest bit is the shell.
    let shell_m = (1u32 << band.max(1).ilog2()) as f32 * (BAND_M / 2.0);
    (AZIMUTHS as f32 * GAP_M / (6.0 * shell_m)) as u32 + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn query(azimuth: f64, elevation: f64, measured_m: f64) -> Query {
        let d = [azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin()];
        Query { origin_in_world_m: [0.0; 3], direction_in_world: d, measured_m, segment: None }
    }

    proptest! {
        #[test]
        fn every_ray_is_in_one_packet_with_its_neighbours(
            rays in prop::collection::vec((-3.2..3.2f64, -1.5..1.5f64, 0.0..300.0f64), 1..300),
        ) {
            let queries: Vec<Query> = rays.iter().map(|&(a, e, r)| query(a, e, r)).collect();
            let mut order = Order::default();
            order.by_direction(&queries);
            let mut expected: Vec<(u32, u32)> = queries.iter().map(key_of).zip(0..).collect();
            expected.sort_unstable();
            let sorted: Vec<(u32, u32)> = order.sorted.iter().map(|&e| ((e >> 32) as u32, e as u32)).collect();
            prop_assert_eq!(sorted, expected);
            let mut start = 0;
            while start < order.len() {
                let packet = order.packet(start);
                prop_assert!((1..=RAYS).contains(&packet.len()));
                prop_assert!(packet.len() >= LEAST_RAYS || start + packet.len() == order.len());
                start += packet.len();
            }
        }
    }

    #[test]
    fn rings_of_a_scan_come_out_as_packets_of_neighbours() {
        // 32 rings of 1800 rays, column by column, all 20 m away.
        let queries: Vec<Query> = (0..1800)
            .flat_map(|a| (0..32).map(move |ring| (f64::from(a), f64::from(ring))))
            .map(|(a, ring)| query((a - 900.0) * 0.00349, (ring - 16.0) * 0.02, 20.0))
            .collect();
        let mut order = Order::default();
        order.by_direction(&queries);
        let (mut start, mut packets, mut narrow) = (0, 0, 0);
        while start < order.len() {
            let packet = order.packet(start);
            let first = &queries[packet[0] as u32 as usize].direction_in_world;
            let apart = |&entry: &u64| {
                let d = &queries[entry as u32 as usize].direction_in_world;
                (0..3).map(|k| (d[k] - first[k]).powi(2)).sum::<f64>().sqrt()
            };
            narrow += usize::from(packet.iter().map(apart).fold(0.0, f64::max) < 0.08);
            start += packet.len();
            packets += 1;
        }
        // Where a band ends, and a sector, what is left of it goes with what comes next.
        assert!(packets <= queries.len() / RAYS + 300 && narrow * 10 > packets * 9, "{narrow} of {packets}");
    }
}
