//! Caches the poses at a scan's point times.

use std::collections::HashMap;

use dmp_sensor::Isometry3;

/// Most point times of a scan whose poses are cached: more than sensors have directions in a turn.
pub const KNOWN_TIMES: usize = 4 << 10;

/// Poses of some runs at the times of a scan seen so far: a log stored ring by ring repeats each time once
/// per ring.
#[derive(Debug, Default)]
pub(crate) struct KnownPoses {
    /// Nanoseconds after the scan's stamp, in order of arrival, and the index of each.
    offsets_ns: Vec<i64>,
    places: HashMap<i64, usize>,
    /// The current index: mostly the next one follows.
    at: usize,
    /// For one time after the other, run by run; `None` where a run has none.
    poses: Vec<Option<Isometry3<f64>>>,
}

impl KnownPoses {
    /// Clears it for another scan.
    pub(crate) fn clear(&mut self) {
        self.offsets_ns.clear();
        self.places.clear();
        self.poses.clear();
    }

    /// The runs' poses at this time after the scan's stamp, if cached.
    #[inline]
    pub(crate) fn of(&mut self, offset_ns: i64) -> Option<&[Option<Isometry3<f64>>]> {
        let is_next = self.offsets_ns.get(self.at + 1) == Some(&offset_ns);
        self.at = if is_next { self.at + 1 } else { *self.places.get(&offset_ns)? };
        let runs = self.poses.len() / self.offsets_ns.len();
        self.poses.get(self.at * runs..(self.at + 1) * runs)
    }

    /// Caches the runs' poses at a new time, unless there are already [`KNOWN_TIMES`].
    pub(crate) fn keep(
        &mut self,
        offset_ns: i64,
        poses: impl ExactSizeIterator<Item = Option<Isometry3<f64>>>,
    ) {
        if self.offsets_ns.len() == KNOWN_TIMES {
            return;
        }
        self.at = self.offsets_ns.len();
        self.offsets_ns.push(offset_ns);
        self.places.insert(offset_ns, self.at);
        // Reserves room for all at once: unused pages take no memory.
        self.poses.reserve_exact(KNOWN_TIMES * poses.len() - self.poses.len());
        self.poses.extend(poses);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_found_in_any_order_up_to_a_number_of_times() {
        let pose = |ns: i64, run: i32| Some(Isometry3::translation(ns as f64, f64::from(run), 0.0));
        let mut known = KnownPoses::default();
        assert_eq!(known.of(0), None);
        for round in 1..3_i32 {
            known.clear();
            assert_eq!(known.of(7), None);
            let times = KNOWN_TIMES as i64 + 100;
            for ns in 0..times {
                assert_eq!(known.of(ns), None);
                known.keep(ns, (0..3).map(|run| pose(ns, round * run)));
            }
            let shuffled = (0..times).map(|k| k * 1009 % times);
            for ns in (0..times).chain(shuffled) {
                let expected = [0, 1, 2].map(|run| pose(ns, round * run));
                assert_eq!(known.of(ns), (ns < KNOWN_TIMES as i64).then_some(&expected[..]), "{ns}");
            }
        }
    }
}
