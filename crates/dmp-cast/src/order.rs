//! Groups rays into packets.

use crate::bands::{AZIMUTH_BITS, Bands};
use crate::query::Query;
use crate::within::RAYS;

/// Packets are cut at gaps only if they have this many rays: with fewer, the overhead of a packet is worse than
/// unrelated rays.
const LEAST_RAYS: usize = 8;
/// Rays with origins farther apart are of different scans and not grouped, metres.
const ORIGINS_M: f64 = 0.5;

/// Bits per pass of the radix sort.
const DIGIT_BITS: u32 = 12;
const DIGITS: usize = 1 << DIGIT_BITS;

/// The casting order of rays, and their packets.
#[derive(Debug, Default)]
pub(crate) struct Order {
    /// Key in the high bits, index of the query in the low ones.
    sorted: Vec<u64>,
    other: Vec<u64>,
    counts: Vec<u32>,
    bands: Bands,
    /// The radius of the discs for which it was made, metres; NaN for the order of the queries.
    radius_m: f32,
}

impl Order {
    /// Keeps the order of the queries.
    pub(crate) fn as_given(&mut self, queries: &[Query]) {
        self.sorted.clear();
        self.sorted.extend(0..queries.len() as u64);
        self.radius_m = f32::NAN;
    }

    /// Keeps the existing order, made for the same returns in other poses; makes one if there is none for this many
    /// rays and this radius.
    #[inline(always)]
    pub(crate) fn of_last(&mut self, queries: &[Query], radius_m: f32) {
        if self.len() != queries.len() || self.radius_m != radius_m {
            self.by_direction(queries, radius_m);
        }
    }

    /// Sorts rays by direction and range, among consecutive rays of one segment with almost the same origin.
    ///
    /// Rays are divided into eight sectors, so that consecutive ones meet the same part of the map. A sector is divided
    /// into shells by the octave of the measured range, a shell into bands of elevation, and a band is ordered by
    /// azimuth. So the rings of a spinning sensor are separated without their numbers. Near rings, which are closer
    /// than a disc, are joined, and so are the pixels of an image in squares. `radius_m` is that of the discs.
    #[inline(always)]
    pub(crate) fn by_direction(&mut self, queries: &[Query], radius_m: f32) {
        self.sorted.clear();
        (self.bands, self.radius_m) = (Bands::of(queries, radius_m), radius_m);
        self.sorted.reserve(queries.len());
        self.other.resize(queries.len(), 0);
        let mut start = 0;
        let Some(first) = queries.first() else { return };
        let (mut place, mut segment) = (first.ray.origin_in_world, first.segment);
        for (index, query) in queries.iter().enumerate() {
            let origin = query.ray.origin_in_world;
            let is_near = |k: usize| (origin[k] - place[k]).abs() <= ORIGINS_M;
            let same_segment = query.segment == segment;
            if !(is_near(0) & is_near(1) & is_near(2) & same_segment) {
                self.sort(start, index);
                (start, place, segment) = (index, origin, query.segment);
            }
            self.sorted.push(u64::from(self.bands.key_of(query)) << 32 | index as u64);
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

    /// Approximately the packet after the one that begins at `start`.
    #[inline(always)]
    pub(crate) fn after_packet(&self, start: usize) -> &[u64] {
        let at = |index: usize| self.len().min(index);
        &self.sorted[at(start + RAYS)..at(start + 2 * RAYS)]
    }

    /// The packet that begins at `start`: up to sixteen rays, if possible of one band and without a gap.
    #[inline(always)]
    pub(crate) fn packet(&self, start: usize) -> &[u64] {
        let rest = &self.sorted[start..self.len().min(start + RAYS)];
        let key = |entry: u64| (entry >> 32) as u32;
        let (first, last) = (key(rest[0]), key(rest[rest.len() - 1]));
        // Keys of the next run may be smaller again.
        let goes_on = |a: u32, b: u32| {
            a >> AZIMUTH_BITS == b >> AZIMUTH_BITS && b.wrapping_sub(a) <= self.bands.largest_gap(a)
        };
        if goes_on(first, last) {
            return rest;
        }
        let mut ends = (LEAST_RAYS..rest.len()).filter(|&at| !goes_on(key(rest[at - 1]), key(rest[at])));
        let end = ends.next().unwrap_or(rest.len());
        &rest[..end]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dmp_sensor::Ray;
    use proptest::prelude::*;

    fn query(azimuth: f64, elevation: f64, measured_m: f64) -> Query {
        let d = [azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin()];
        Query {
            ray: Ray { origin_in_world: [0.0; 3], direction_in_world: d, range_m: measured_m },
            segment: None,
        }
    }

    const RADIUS_M: f32 = 0.16;

    proptest! {
        #[test]
        fn every_ray_is_in_one_packet_with_its_neighbours(
            rays in prop::collection::vec((-3.2..3.2f64, -1.5..1.5f64, 0.0..300.0f64), 1..300),
        ) {
            let queries: Vec<Query> = rays.iter().map(|&(a, e, r)| query(a, e, r)).collect();
            let mut order = Order::default();
            order.by_direction(&queries, RADIUS_M);
            let bands = Bands::of(&queries, RADIUS_M);
            let mut expected: Vec<(u32, u32)> = queries.iter().map(|query| bands.key_of(query)).zip(0..).collect();
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
    fn an_order_is_kept_for_as_many_rays_into_discs_of_the_same_radius() {
        let scan = |turn: f64, rays: u32| -> Vec<Query> {
            (0..rays).map(|k| query(f64::from(k * 37 % 100) * 0.06 + turn - 3.0, 0.0, 9.0)).collect()
        };
        let in_order = |order: &Order| -> Vec<u32> { order.sorted.iter().map(|&e| e as u32).collect() };
        let of_its_own = |queries: &[Query], radius_m| {
            let mut order = Order::default();
            order.by_direction(queries, radius_m);
            in_order(&order)
        };
        let (first, turned, fewer) = (scan(0.0, 100), scan(1.0, 100), scan(1.0, 90));
        let kept = of_its_own(&first, RADIUS_M);
        assert_ne!(kept, of_its_own(&turned, RADIUS_M));
        let mut order = Order::default();
        order.of_last(&first, RADIUS_M);
        order.of_last(&turned, RADIUS_M);
        assert_eq!(in_order(&order), kept);
        for (queries, radius_m) in [(&fewer, RADIUS_M), (&turned, RADIUS_M), (&first, 2.0 * RADIUS_M)] {
            order.of_last(queries, radius_m);
            assert_eq!(in_order(&order), of_its_own(queries, radius_m));
        }
        order.as_given(&turned);
        order.of_last(&turned, RADIUS_M);
        assert_eq!(in_order(&order), of_its_own(&turned, RADIUS_M));
    }

    /// Width and height of each packet, radians, and its rays.
    fn packets_of(queries: &[Query]) -> Vec<([f64; 2], usize)> {
        let mut order = Order::default();
        order.by_direction(queries, RADIUS_M);
        let (mut start, mut packets) = (0, Vec::new());
        while start < order.len() {
            let packet = order.packet(start);
            let of = |index: u64| queries[index as u32 as usize].ray.direction_in_world;
            let extent = |angle: fn([f64; 3]) -> f64| {
                let angles = packet.iter().map(|&entry| angle(of(entry)));
                let (least, most) =
                    angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
                most - least
            };
            packets.push(([extent(|[x, y, _]| y.atan2(x)), extent(|[_, _, z]| z.asin())], packet.len()));
            start += packet.len();
        }
        packets
    }

    fn median(mut values: Vec<f64>) -> f64 {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    }

    #[test]
    fn rings_of_a_scan_come_out_as_packets_of_neighbours() {
        // 32 rings of 1800 rays, column by column, all 20 m away.
        let queries: Vec<Query> = (0..1800)
            .flat_map(|a| (0..32).map(move |ring| (f64::from(a), f64::from(ring))))
            .map(|(a, ring)| query((a - 900.0) * 0.00349, (ring - 16.0) * 0.02, 20.0))
            .collect();
        let packets = packets_of(&queries);
        let narrow = packets.iter().filter(|([width, height], _)| width.hypot(*height) < 0.08).count();
        // At the end of a band or sector, its remainder joins the next packet.
        assert!(
            packets.len() <= queries.len() / RAYS + 300 && narrow * 10 > packets.len() * 9,
            "{narrow} of {}",
            packets.len()
        );
    }

    #[test]
    fn rings_that_lie_far_apart_stay_apart() {
        // 16 rings two degrees apart: at this distance, more than three metres.
        let queries: Vec<Query> = (0..1800)
            .flat_map(|a| (0..16).map(move |ring| (f64::from(a), f64::from(ring))))
            .map(|(a, ring)| query((a - 900.0) * 0.00349, (ring - 8.0) * 0.035, 90.0))
            .collect();
        let packets = packets_of(&queries);
        let flat = packets.iter().filter(|([_, height], _)| *height < 1e-3).count();
        assert!(flat * 10 > packets.len() * 9, "{flat} of {}", packets.len());
    }

    #[test]
    fn the_pixels_of_an_image_come_out_in_squares() {
        // 320 × 50 pixels, row by row, 2.5 m away; and near, where a band could be as high as the image.
        for range_m in [2.5, 0.6] {
            let queries: Vec<Query> = (0..50)
                .flat_map(|row| (0..320).map(move |column| (f64::from(column), f64::from(row))))
                .map(|(column, row)| query((160.0 - column) * 0.0019, (25.0 - row) * 0.0019, range_m))
                .collect();
            let packets = packets_of(&queries);
            let [width, height] =
                [0, 1].map(|k| median(packets.iter().map(|(extents, _)| extents[k]).collect()));
            assert!(width < 6.0 * 0.0019 && height < 6.0 * 0.0019, "{width} x {height} at {range_m} m");
            let full = packets.iter().filter(|(_, rays)| *rays == RAYS).count();
            assert!(full * 10 > packets.len() * 9, "{full} of {}", packets.len());
        }
    }
}
