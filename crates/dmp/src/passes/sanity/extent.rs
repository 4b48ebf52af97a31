//! Bounding boxes of drives and maps, and the gap between them.

use dmp_map::Store;

/// A box with its edges along the axes of a run's own frame, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    low_m: [f64; 3],
    high_m: [f64; 3],
}

impl Extent {
    /// The smallest box around some points; `None` without points.
    pub(super) fn of_points(points: impl Iterator<Item = [f64; 3]>) -> Option<Self> {
        points.map(|point| Self { low_m: point, high_m: point }).reduce(Self::with)
    }

    /// A box around a map, up to a tile larger; `None` for an empty map.
    pub(super) fn of_store(store: &Store) -> Option<Self> {
        let tile = |entry: &dmp_map::TileEntry| {
            let [low_m, high_m] = store.box_in_own_m(entry);
            Self { low_m, high_m }
        };
        store
            .entries()
            .filter(|entry| entry.extent.z_range_m[0] <= entry.extent.z_range_m[1])
            .map(tile)
            .reduce(Self::with)
    }

    fn with(self, other: Self) -> Self {
        Self {
            low_m: std::array::from_fn(|k| self.low_m[k].min(other.low_m[k])),
            high_m: std::array::from_fn(|k| self.high_m[k].max(other.high_m[k])),
        }
    }

    /// The gap between two boxes; 0 if they touch.
    pub(super) fn gap_m(&self, other: &Self) -> f64 {
        let gap = |k: usize| (other.low_m[k] - self.high_m[k]).max(self.low_m[k] - other.high_m[k]).max(0.0);
        (0..3).map(|k| gap(k) * gap(k)).sum::<f64>().sqrt()
    }

    /// Its centre for display: whole metres.
    pub(super) fn centre_in_words(&self) -> String {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|k| 0.5 * (self.low_m[k] + self.high_m[k]));
        format!("({x:.0}, {y:.0}, {z:.0}) m")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gap_between_boxes_is_that_of_their_nearest_corners() {
        let of = |points: &[[f64; 3]]| Extent::of_points(points.iter().copied());
        assert_eq!(of(&[]), None);
        let a = Extent { low_m: [0.0; 3], high_m: [1.0; 3] };
        let b = Extent { low_m: [4.0, -5.0, 0.5], high_m: [5.0, -4.0, 9.0] };
        assert_eq!((a.gap_m(&b), b.gap_m(&a)), (5.0, 5.0));
        assert_eq!(a.gap_m(&Extent { low_m: [0.5; 3], high_m: [9.0; 3] }), 0.0);
        assert_eq!(b.centre_in_words(), "(4, -4, 5) m");
    }
}
