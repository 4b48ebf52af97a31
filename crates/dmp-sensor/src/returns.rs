//! Which returns are used, and why the others are not.

use crate::EgoMask;

/// Why a return was not used. Every return of a log is either used or counted under one of these.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum DropReason {
    /// A coordinate is NaN or infinite.
    NonFinite,
    /// Exactly (0, 0, 0): the sensor's way to say that nothing came back.
    NoReturn,
    /// Nearer than the smallest range used.
    TooNear,
    /// Farther than the largest range used.
    TooFar,
    /// On the vehicle that carries the sensor.
    Vehicle,
    /// Its time lies outside a trajectory, or in a gap of one.
    NoPose,
    /// Its scan as a whole has no pose in some trajectory.
    ScanWithoutPose,
    /// Its scan was not asked for: only every n-th was.
    ScanNotSelected,
    /// It is in the map, but only one of a few consecutive returns was cast, and it was not drawn.
    NotDrawn,
}

impl DropReason {
    /// Every reason, in the order of the report.
    pub const ALL: [Self; 9] = [
        Self::NonFinite,
        Self::NoReturn,
        Self::TooNear,
        Self::TooFar,
        Self::Vehicle,
        Self::NoPose,
        Self::ScanWithoutPose,
        Self::ScanNotSelected,
        Self::NotDrawn,
    ];

    /// Its name in machine output: `non_finite`, `no_return`, …
    pub fn name(self) -> &'static str {
        match self {
            Self::NonFinite => "non_finite",
            Self::NoReturn => "no_return",
            Self::TooNear => "too_near",
            Self::TooFar => "too_far",
            Self::Vehicle => "vehicle",
            Self::NoPose => "no_pose",
            Self::ScanWithoutPose => "scan_without_pose",
            Self::ScanNotSelected => "scan_not_selected",
            Self::NotDrawn => "not_drawn",
        }
    }
}

/// Where the returns of a log went: used, or dropped for one reason. Sums of counts are counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ReturnCounts {
    used: u64,
    dropped: [u64; DropReason::ALL.len()],
    implausible: u64,
}

impl ReturnCounts {
    /// Counts one return that is used.
    #[inline]
    pub fn add_used(&mut self) {
        self.used += 1;
    }

    /// Counts `count` returns dropped for `reason`.
    #[inline]
    pub fn add_dropped(&mut self, reason: DropReason, count: u64) {
        self.dropped[reason as usize] += count;
    }

    /// Counts `count` of the used returns as dropped for `reason`.
    pub fn drop_used(&mut self, reason: DropReason, count: u64) {
        self.used -= count;
        self.add_dropped(reason, count);
    }

    /// Notes that one of the dropped returns has a range that no LiDAR measures: see [`is_implausible`].
    pub fn add_implausible(&mut self) {
        self.implausible += 1;
    }

    /// Adds the counts of another part of the log.
    pub fn merge(&mut self, other: &Self) {
        self.used += other.used;
        for (mine, theirs) in self.dropped.iter_mut().zip(other.dropped) {
            *mine += theirs;
        }
        self.implausible += other.implausible;
    }

    /// Returns used.
    pub fn used(&self) -> u64 {
        self.used
    }

    /// Returns dropped for `reason`.
    pub fn dropped(&self, reason: DropReason) -> u64 {
        self.dropped[reason as usize]
    }

    /// Those among the dropped returns that no LiDAR measures.
    pub fn implausible(&self) -> u64 {
        self.implausible
    }

    /// All returns: used and dropped.
    pub fn total(&self) -> u64 {
        self.used + self.dropped.iter().sum::<u64>()
    }
}

/// Ranges outside these, metres, are of no LiDAR: what is read was never a coordinate in metres.
const PLAUSIBLE_M: std::ops::RangeInclusive<f64> = 1e-3..=1e5;

/// Whether the range of a point is so small or large that its bytes were probably misread, such as
/// numbers read in the wrong order of bytes. Points that are not finite or exactly (0, 0, 0) are not: sensors
/// send those where nothing came back.
pub fn is_implausible(point_in_sensor_m: [f32; 3]) -> bool {
    let [x, y, z] = point_in_sensor_m.map(f64::from);
    let range_m = (x * x + y * y + z * z).sqrt();
    range_m.is_finite() && range_m > 0.0 && !PLAUSIBLE_M.contains(&range_m)
}

/// Which returns are used, by what can be seen in the sensor frame alone.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ReturnFilter {
    /// Smallest range used, metres, inclusive.
    pub min_range_m: f64,
    /// Largest range used, metres, inclusive.
    pub max_range_m: f64,
    /// The vehicle that carries the sensor; empty where nothing is known of it.
    pub ego: EgoMask,
}

impl ReturnFilter {
    /// Whether a return at `point_in_sensor_m` is used, or why not.
    ///
    /// # Errors
    /// The reason for which the return is to be dropped.
    #[inline]
    pub fn check(&self, point_in_sensor_m: [f32; 3]) -> Result<(), DropReason> {
        let [x, y, z] = point_in_sensor_m.map(f64::from);
        let square = x * x + y * y + z * z;
        if !square.is_finite() {
            return Err(DropReason::NonFinite);
        }
        if square == 0.0 {
            return Err(DropReason::NoReturn);
        }
        if square < self.min_range_m * self.min_range_m {
            return Err(DropReason::TooNear);
        }
        if square > self.max_range_m * self.max_range_m {
            return Err(DropReason::TooFar);
        }
        if self.ego.contains(point_in_sensor_m) {
            return Err(DropReason::Vehicle);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_return_gets_one_reason() {
        let filter = ReturnFilter { min_range_m: 1.5, max_range_m: 100.0, ego: EgoMask::default() };
        let cases = [
            ([f32::NAN, 0.0, 0.0], Err(DropReason::NonFinite)),
            ([f32::INFINITY, 0.0, 0.0], Err(DropReason::NonFinite)),
            ([0.0, f32::NEG_INFINITY, f32::INFINITY], Err(DropReason::NonFinite)),
            ([0.0, -0.0, 0.0], Err(DropReason::NoReturn)),
            ([1.0, 0.0, 0.0], Err(DropReason::TooNear)),
            ([0.0, 1.5, 0.0], Ok(())),
            ([0.0, 0.0, 100.0], Ok(())),
            ([80.0, 80.0, 0.0], Err(DropReason::TooFar)),
            ([f32::MAX, 0.0, 0.0], Err(DropReason::TooFar)),
        ];
        for (point, expected) in cases {
            assert_eq!(filter.check(point), expected, "{point:?}");
        }
    }

    #[test]
    fn numbers_in_the_wrong_order_of_bytes_are_implausible() {
        for point in [[0.0; 3], [f32::NAN, 1.0, 1.0], [0.001, 0.001, 0.0], [0.0, 99_000.0, 0.0]] {
            assert!(!is_implausible(point), "{point:?}");
        }
        for point in [[10.5_f32, -3.25, 1.0], [0.5, 70.0, -0.125]] {
            let swapped = point.map(|c| f32::from_bits(c.to_bits().swap_bytes()));
            assert!(is_implausible(swapped) && !is_implausible(point), "{swapped:?}");
        }
    }

    #[test]
    fn counts_add_up_beyond_32_bits() {
        let mut counts = ReturnCounts::default();
        counts.add_dropped(DropReason::TooFar, 5_000_000_000);
        counts.add_used();
        let mut twice = counts;
        twice.merge(&counts);
        assert_eq!((twice.total(), twice.used()), (10_000_000_002, 2));
        assert_eq!(twice.dropped(DropReason::TooFar), 10_000_000_000);
    }
}
