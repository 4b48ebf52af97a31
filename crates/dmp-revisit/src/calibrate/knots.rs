//! Where the sensor is throughout a scan: at a few instants, and between them straight on.

/// How far the instants are apart, nanoseconds; farther where there would be more instants than returns. Where a vehicle turns by
/// 1 rad/s and brakes by 5 m/s², returns 50 m away are off by 0.2 mm.
const APART_NS: u64 = 5_000_000;

/// What is known at some instants of a scan.
#[derive(Debug)]
pub(crate) struct Knots<T> {
    from_ns: i64,
    apart_ns: f64,
    /// `None` where the run does not say.
    known: Vec<Option<T>>,
}

/// The part of a scan between two instants in which a return was measured.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Between<'a, T> {
    pub(crate) ends: [&'a T; 2],
    /// How far on, 0 to 1.
    pub(crate) share: f64,
    /// The number of the nearer end.
    pub(crate) nearer: u32,
}

impl<T> Knots<T> {
    /// For returns measured at these times after the scan's stamp, nanoseconds; `at` says what is known at such a time.
    pub(crate) fn of(times_ns: impl Iterator<Item = i64>, mut at: impl FnMut(i64) -> Option<T>) -> Self {
        let none = (i64::MAX, i64::MIN, 0);
        let (from_ns, to_ns, count) =
            times_ns.fold(none, |(from, to, count), time| (from.min(time), to.max(time), count + 1));
        let span_ns = to_ns.saturating_sub(from_ns).max(0);
        let parts = span_ns.unsigned_abs().div_ceil(APART_NS).min(count);
        let apart_ns = span_ns as f64 / parts.max(1) as f64;
        let time = |k: u64| if k == parts { to_ns } else { from_ns + (k as f64 * apart_ns) as i64 };
        let known = if from_ns > to_ns { Vec::new() } else { (0..=parts).map(|k| at(time(k))).collect() };
        Self { from_ns, apart_ns, known }
    }

    /// The part in which one of these times lies; `None` where an end of it is not known.
    pub(crate) fn between(&self, time_ns: i64) -> Option<Between<'_, T>> {
        let last = self.known.len().checked_sub(1)?;
        let on = if last == 0 { 0.0 } else { time_ns.saturating_sub(self.from_ns) as f64 / self.apart_ns };
        let first = (on as usize).min(last.saturating_sub(1));
        let share = (on - first as f64).clamp(0.0, 1.0);
        let ends = [self.get(first as u32)?, self.get((first + 1).min(last) as u32)?];
        Some(Between { ends, share, nearer: first as u32 + u32::from(share > 0.5) })
    }

    pub(crate) fn get(&self, number: u32) -> Option<&T> {
        self.known.get(number as usize)?.as_ref()
    }
}

impl<T> Between<'_, T> {
    /// The place in between of a return that has these places at both ends.
    pub(crate) fn place(&self, at_end: impl Fn(&T) -> dmp_sensor::Vector3<f64>) -> dmp_sensor::Vector3<f64> {
        let place = at_end(self.ends[0]);
        // A scan at one instant has one end.
        if self.share == 0.0 { place } else { place.lerp(&at_end(self.ends[1]), self.share) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_linear_is_found_at_every_time_and_only_where_it_is_known() {
        let times_ns: Vec<i64> =
            (0..13).map(|k| -20_000_000 + 5_000_000 * k).chain([33_333_333, 12_345_678]).collect();
        let knots = Knots::of(times_ns.iter().copied(), |ns| (ns < 35_000_000).then_some(ns as f64));
        for ns in times_ns {
            let between = knots.between(ns);
            let place = between.map(|b| b.place(|&x| dmp_sensor::Vector3::new(x, 0.0, 0.0)).x);
            match place {
                Some(x) => assert!((x - ns as f64).abs() < 1.0 && ns < 35_000_000, "{ns}: {x}"),
                None => assert!(ns >= 30_000_000, "{ns}"),
            }
        }
        let nearer = |ns| knots.between(ns).map(|between| between.nearer);
        assert_eq!(
            [nearer(-20_000_000), nearer(12_345_678), nearer(11_000_000)],
            [Some(0), Some(6), Some(6)]
        );
    }

    #[test]
    fn scans_at_an_instant_or_of_any_length_or_of_nothing_have_few() {
        let count = |times_ns: &[i64]| Knots::of(times_ns.iter().copied(), Some).known.len();
        let sweep: Vec<i64> = (0..100).map(|k| k * 1_000_000).collect();
        assert_eq!([count(&[]), count(&[7]), count(&[7, 7]), count(&sweep)], [0, 1, 1, 21]);
        assert_eq!(count(&[i64::MIN, 0, i64::MAX]), 4);
        let one = Knots::of([7].into_iter(), Some);
        assert_eq!(one.between(7).map(|b| (*b.ends[0], *b.ends[1], b.share)), Some((7, 7, 0.0)));
        assert!(Knots::of([].into_iter(), Some::<i64>).between(0).is_none());
    }
}
