//! How the times of points are read: in which unit, and counted from where.

use super::{PointTime, TimeUnit};

/// A time as it stands in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum RawTime {
    Integer(i64),
    Float(f64),
}

impl RawTime {
    /// A time beyond 63 bits keeps what a double keeps of it.
    #[inline]
    pub(super) fn of_u64(value: u64) -> Self {
        i64::try_from(value).map_or(Self::Float(value as f64), Self::Integer)
    }

    #[inline]
    fn minus(self, other: Self) -> Option<Self> {
        match (self, other) {
            (Self::Integer(a), Self::Integer(b)) => a.checked_sub(b).map(Self::Integer),
            (a, b) => Some(Self::Float(a.as_f64() - b.as_f64())),
        }
    }

    pub(crate) fn as_f64(self) -> f64 {
        match self {
            Self::Integer(value) => value as f64,
            Self::Float(value) => value,
        }
    }
}

/// From where the times of a log's points count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Origin {
    /// The scan's stamp, or the instant that the shift puts it at.
    Stamp,
    /// Where the stamps count from.
    Clock,
    /// The scan's first point.
    FirstPoint,
}

/// How the times of a log's points are turned into nanoseconds after the stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct TimeRule {
    pub(crate) unit: TimeUnit,
    pub(crate) origin: Origin,
    /// Added to every offset, nanoseconds: where the stamp is not where the times count from.
    pub(crate) shift_ns: i64,
}

impl TimeRule {
    pub(crate) fn new(unit: TimeUnit, origin: Origin) -> Self {
        Self { unit, origin, shift_ns: 0 }
    }

    /// What the user has said; `None` for `auto` and `ignore`.
    pub(crate) fn given(point_time: PointTime) -> Option<Self> {
        match point_time {
            PointTime::Auto | PointTime::Ignore => None,
            PointTime::Relative(unit) => Some(Self::new(unit, Origin::Stamp)),
            PointTime::Absolute(unit) => Some(Self::new(unit, Origin::Clock)),
            PointTime::FromFirst(unit) => Some(Self::new(unit, Origin::FirstPoint)),
        }
    }

    /// Whether it counts from the first point of the scan.
    pub(crate) fn needs_first(self) -> bool {
        self.origin == Origin::FirstPoint
    }

    /// Nanoseconds after `stamp_ns`; `None` for what is not a number or beyond all dates. `first` is the
    /// scan's first point, for a rule that counts from it.
    #[inline]
    pub(crate) fn offset_ns(self, raw: RawTime, stamp_ns: i64, first: Option<RawTime>) -> Option<i64> {
        let ns = match (self.origin, raw) {
            // Differences first: a double of seconds since 1970 resolves 240 ns, its differences are exact.
            (Origin::FirstPoint, raw) => self.ns(raw.minus(first?)?)?,
            (Origin::Clock, raw) => self.ns(raw)?.checked_sub(stamp_ns)?,
            (Origin::Stamp, raw) => self.ns(raw)?,
        };
        ns.checked_add(self.shift_ns)
    }

    /// The offset of a 32-bit number of the most common kind, counted from the stamp: it fits in 64 bits in
    /// every unit, so nothing has to be checked.
    pub(super) fn of_u32(self) -> Option<impl Fn(u32) -> i64> {
        let (unit_ns, shift_ns) = (self.unit.in_ns(), self.shift_ns);
        let fits = shift_ns.abs() < 1 << 40;
        (self.origin == Origin::Stamp && fits).then_some(move |value| i64::from(value) * unit_ns + shift_ns)
    }

    /// The offset of a float32, counted from the stamp: a product of 24 and 21 bits is exact as a double, so
    /// nothing has to be taken apart. As [`TimeRule::offset_ns`], in half the time.
    pub(crate) fn of_f32(self) -> Option<impl Fn(f32) -> Option<i64>> {
        const LARGEST_NS: f64 = (1_i64 << 61) as f64;
        let (unit_ns, shift_ns) = (self.unit.in_ns() as f64, self.shift_ns);
        let fits = shift_ns.abs() < 1 << 40;
        (self.origin == Origin::Stamp && fits).then_some(move |value| {
            let ns = f64::from(value) * unit_ns;
            // Compares as false for NaN.
            (ns.abs() < LARGEST_NS).then(|| nearest(ns) + shift_ns)
        })
    }

    #[inline]
    fn ns(self, raw: RawTime) -> Option<i64> {
        match raw {
            RawTime::Integer(value) => value.checked_mul(self.unit.in_ns()),
            RawTime::Float(value) => {
                let unit_ns = self.unit.in_ns();
                // Compares as false for NaN. The limit is 2^63, which `i64::MAX as f64` rounds to.
                let whole = (value.abs() < i64::MAX as f64).then_some(value as i64)?;
                // Whole units apart: as a double, nanoseconds since 1970 resolve 256 ns, coarser than seconds do.
                let part_ns = nearest((value - whole as f64) * unit_ns as f64);
                whole.checked_mul(unit_ns)?.checked_add(part_ns)
            }
        }
    }

    pub(crate) fn words(self) -> String {
        let origin = match self.origin {
            Origin::Stamp if self.shift_ns == 0 => "after the scan's stamp",
            Origin::Stamp => "after the scan's start",
            Origin::Clock => "on the clock of the stamps",
            Origin::FirstPoint => "after the scan's first point",
        };
        format!("{} {origin}", self.unit.name())
    }
}

/// As `round`, halves away from zero, for what is far from the limits: that one is a call on most processors.
#[inline]
fn nearest(value: f64) -> i64 {
    let whole = value as i64;
    let rest = value - whole as f64;
    whole + i64::from(rest >= 0.5) - i64::from(rest <= -0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STAMP_NS: i64 = 1_690_309_709_285_305_500;

    #[test]
    fn offsets_are_exact_and_never_overflow() {
        let absolute = TimeRule::new(TimeUnit::Nanoseconds, Origin::Clock);
        assert_eq!(absolute.offset_ns(RawTime::Integer(STAMP_NS + 3), STAMP_NS, None), Some(3));
        assert_eq!(absolute.offset_ns(RawTime::Integer(i64::MAX), i64::MIN, None), None);
        let seconds = TimeRule::new(TimeUnit::Seconds, Origin::Stamp);
        assert_eq!(seconds.offset_ns(RawTime::Float(0.0123), 5, None), Some(12_300_000));
        for none in [f64::NAN, f64::INFINITY, 1e30, -1e30] {
            assert_eq!(seconds.offset_ns(RawTime::Float(none), 0, None), None);
        }
        assert_eq!(seconds.offset_ns(RawTime::Integer(i64::MAX), 0, None), None);
    }

    #[test]
    fn float32_takes_the_short_way_to_the_same_times() {
        let values = [0.0, -0.0, 0.1, 0.099_999_9, -0.05, 1.5e-9, 2.5e-9, 123.456, 1e9, f32::MIN_POSITIVE];
        for unit in TimeUnit::ALL {
            let rule = TimeRule { shift_ns: -17, ..TimeRule::new(unit, Origin::Stamp) };
            let short = rule.of_f32().unwrap();
            for value in values {
                let long = rule.offset_ns(RawTime::Float(value.into()), 5, None);
                assert_eq!(short(value), long, "{unit:?} {value}");
            }
            for none in [f32::NAN, f32::INFINITY, f32::MIN] {
                assert_eq!(short(none), None);
            }
        }
        assert!(TimeRule::new(TimeUnit::Seconds, Origin::Clock).of_f32().is_none());
    }

    #[test]
    fn the_nearest_integer_is_that_of_round() {
        let halves = [0.499_999_999_999_999_94, 0.5, 1.5, 2.5, 1e9 - 0.5, 1e9 + 0.25];
        let many = (0..10_000).map(|k| f64::from(k) * 0.137_531 - 600.0);
        for value in halves.into_iter().flat_map(|half: f64| [half, -half]).chain(many) {
            assert_eq!(nearest(value), value.round() as i64, "{value}");
        }
    }
}
