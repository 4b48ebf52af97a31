//! How far apart two runs are within a visit.

use super::spread::{Distances, Spread};
use super::way::{OnWay, PLACE_M, Ruler, place_of};

/// Every scan against those 1, 2, 4, … scans later, up to 20 m of travel.
pub(super) fn spread(scans: &[OnWay<'_>], ruler: &Ruler) -> Option<Spread> {
    let mut distances = Distances::new();
    for (k, first) in scans.iter().enumerate() {
        if k > 0 && place_of(first, ruler) != place_of(&scans[k - 1], ruler) {
            distances.end_place();
        }
        let later = (0..usize::BITS).map_while(|doublings| scans.get(k + (1 << doublings)));
        let near = |(step, second): &(usize, &OnWay<'_>)| {
            // Neighbours always: a gap in the poses must not hide a jump.
            *step == 0 || second.along_m - first.along_m <= PLACE_M * ruler.metre_m
        };
        for (_, second) in later.enumerate().take_while(near) {
            distances.add(ruler.distance_m(first, second), [first.scan.scan, second.scan.scan]);
        }
    }
    distances.spread()
}
