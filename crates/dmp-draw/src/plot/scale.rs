//! From values to pixels, with ticks at round numbers.

use dmp_lengths::thousands;

/// Ticks aimed for.
const TICKS: f64 = 6.0;

/// An axis: values from `low` to `high` between two pixels.
#[derive(Debug, Clone)]
pub(super) struct Scale {
    /// In the logarithm's units where `log`.
    low: f64,
    high: f64,
    log: bool,
    from_px: f64,
    to_px: f64,
}

impl Scale {
    /// Space for all finite (and, if `log`, positive) values, with some air.
    pub(super) fn new(values: impl Iterator<Item = f64>, log: bool, from_px: f64, to_px: f64) -> Self {
        let usable = values.filter(|v| v.is_finite() && (!log || *v > 0.0));
        let (low, high) = usable
            .map(|v| if log { libm::log10(v) } else { v })
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        let (mut low, mut high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        // A linear axis begins at 0 where that is not far away.
        let from_zero = !log && low >= 0.0 && low <= 0.4 * high;
        if high - low <= 1e-9 * high.abs().max(low.abs()) {
            let air = if log || high == 0.0 { 0.5 } else { 0.1 * high.abs() };
            (low, high) = (low - air, high + air);
        }
        let air = 0.06 * (high - low);
        let low = if from_zero { low.min(0.0) } else { low - air };
        Self { low, high: high + air, log, from_px, to_px }
    }

    /// Gives two scales as much space that a metre is as long on both.
    pub(super) fn equal(x: &mut Self, y: &mut Self) {
        let per_px = |scale: &Self| (scale.high - scale.low) / (scale.to_px - scale.from_px).abs();
        let most = per_px(x).max(per_px(y));
        for scale in [x, y] {
            let more = most * (scale.to_px - scale.from_px).abs() - (scale.high - scale.low);
            scale.low -= 0.5 * more;
            scale.high += 0.5 * more;
        }
    }

    /// Space for the places 0, 1, 2 …
    pub(super) fn places(count: usize, from_px: f64, to_px: f64) -> Self {
        Self { low: -0.5, high: count as f64 - 0.5, log: false, from_px, to_px }
    }

    /// The values and pixels of both ends, and whether the values are logarithms.
    pub(super) fn ends(&self) -> String {
        let Self { low, high, log, from_px, to_px } = *self;
        format!("{low} {high} {from_px:.1} {to_px:.1} {}", u8::from(log))
    }

    /// The pixel of a value; `None` where it has none.
    pub(super) fn at(&self, value: f64) -> Option<f64> {
        if !value.is_finite() || (self.log && value <= 0.0) {
            return None;
        }
        let value = if self.log { libm::log10(value) } else { value };
        Some(self.from_px + (value - self.low) / (self.high - self.low) * (self.to_px - self.from_px))
    }

    /// Pixels and numbers of the ticks.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        let values = if self.log { self.log_ticks() } else { self.even_ticks() };
        values.into_iter().filter_map(|(value, text)| Some((self.at(value)?, text))).collect()
    }

    /// Multiples of 1, 2 or 5 times a power of ten.
    fn even_ticks(&self) -> Vec<(f64, String)> {
        let rough = (self.high - self.low) / TICKS;
        let exponent = libm::floor(libm::log10(rough)) as i32;
        let power = libm::pow(10.0, f64::from(exponent));
        let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= rough).unwrap_or(10.0);
        let step = factor * power;
        let (first, last) = ((self.low / step).ceil() as i64, (self.high / step).floor() as i64);
        let largest = self.low.abs().max(self.high.abs());
        let exponent = if factor == 10.0 { exponent + 1 } else { exponent };
        let show = |value: f64| {
            if value == 0.0 {
                "0".to_owned()
            } else if !(1e-3..1e7).contains(&largest) {
                // As many digits as tell one step from the next.
                let digits = (libm::floor(libm::log10(value.abs())) as i32 - exponent).max(0);
                format!("{value:.*e}", digits as usize)
            } else {
                thousands(&format!("{value:.*}", (-exponent).max(0) as usize))
            }
        };
        (first..=last).map(|k| k as f64 * step).map(|value| (value, show(value))).collect()
    }

    /// Powers of ten, with 2 and 5 between them where there are few, or all digits where there are fewer.
    fn log_ticks(&self) -> Vec<(f64, String)> {
        let decades = self.high - self.low;
        let factors: &[f64] = match decades {
            d if d < 0.6 => return self.plain_ticks_between(),
            d if d < 2.5 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let (first, last) = (self.low.floor() as i32, self.high.ceil() as i32);
        let every = ((f64::from(last - first) / (1.5 * TICKS)).ceil() as i32).max(1);
        let powers = (first..=last).filter(|exponent| exponent.rem_euclid(every) == 0);
        let values = powers.flat_map(|exponent| factors.iter().map(move |&factor| (factor, exponent)));
        let inside = values.filter(|&(factor, exponent)| {
            let at = libm::log10(factor) + f64::from(exponent);
            self.low <= at && at <= self.high
        });
        let show = |(factor, exponent): (f64, i32)| {
            let value = factor * libm::pow(10.0, f64::from(exponent));
            let text = match exponent {
                0..=4 => format!("{value:.0}"),
                -3..0 => format!("{value:.*}", (-exponent) as usize),
                _ => format!("{factor}e{exponent}"),
            };
            (value, text)
        };
        inside.map(show).collect()
    }

    /// The ticks of a linear axis: so short a piece of a logarithmic one is nearly even.
    fn plain_ticks_between(&self) -> Vec<(f64, String)> {
        let [low, high] = [self.low, self.high].map(|exponent| libm::pow(10.0, exponent));
        Self { low, high, log: false, ..*self }.even_ticks()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(values: &[f64], log: bool) -> Vec<String> {
        let scale = Scale::new(values.iter().copied(), log, 0.0, 100.0);
        let ticks = scale.ticks();
        assert!(ticks.is_sorted_by(|a, b| a.0 < b.0), "{ticks:?}");
        assert!(ticks.iter().all(|(at, _)| (-1e-9..=100.0 + 1e-9).contains(at)), "{ticks:?}");
        ticks.into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(
            numbers(&[0.1, 1.0], false),
            ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"].map(|t| t.replace("0.0", "0"))
        );
        assert_eq!(numbers(&[12.0, 14.0], false), ["12.0", "12.5", "13.0", "13.5", "14.0"]);
        assert_eq!(numbers(&[0.0, 3e7], false), ["0", "1e7", "2e7", "3e7"]);
        assert_eq!(numbers(&[-1e4, 2e4], false), ["-10,000", "0", "10,000", "20,000"]);
        assert_eq!(numbers(&[-1.0, 1.0], false), ["-1.0", "-0.5", "0", "0.5", "1.0"]);
        assert_eq!(numbers(&[2e-4, 5e-4], false), ["0", "1e-4", "2e-4", "3e-4", "4e-4", "5e-4"]);
        assert_eq!(numbers(&[0.01, 100.0], true), ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(numbers(&[0.5, 20.0], true), ["0.5", "1", "2", "5", "10", "20"]);
        assert_eq!(numbers(&[1e-12, 1e12], true), ["1e-12", "1e-8", "1e-4", "1", "10000", "1e8", "1e12"]);
        assert_eq!(numbers(&[5.0, 7.0], true), ["5.0", "5.5", "6.0", "6.5", "7.0"]);
    }

    #[test]
    fn odd_values_have_an_axis_all_the_same() {
        for values in [&[][..], &[f64::NAN], &[0.0], &[3.0], &[-5.0, -5.0], &[1e300, -1e300], &[1e-300]] {
            for log in [false, true] {
                let texts = numbers(values, log);
                assert!(!texts.is_empty() && texts.len() < 20, "{values:?} {texts:?}");
            }
        }
    }

    #[test]
    fn values_are_where_they_belong() {
        let scale = Scale::new([1.0, 100.0].into_iter(), true, 10.0, 110.0);
        assert!((scale.at(10.0).unwrap() - 60.0).abs() < 1e-9);
        assert_eq!(scale.at(0.0), None);
        let mut x = Scale::new([0.0, 100.0].into_iter(), false, 0.0, 100.0);
        let mut y = Scale::new([5.0, 6.0].into_iter(), false, 200.0, 0.0);
        Scale::equal(&mut x, &mut y);
        let px = |scale: &Scale, value: f64| scale.at(value).unwrap();
        assert!((px(&x, 10.0) - px(&x, 0.0) + px(&y, 10.0) - px(&y, 0.0)).abs() < 1e-9);
        assert!((px(&y, 5.5) - 100.0).abs() < 1e-9, "in the middle");
        let places = Scale::places(4, 0.0, 400.0);
        assert_eq!([0.0, 3.0].map(|k| places.at(k).unwrap()), [50.0, 350.0]);
    }
}
