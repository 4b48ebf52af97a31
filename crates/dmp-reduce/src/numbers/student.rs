//! Student's distribution: how sure an interval is, and how long it must be for that.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, SQRT_2};

/// Up to here the distribution function is summed; beyond, the expansion in 1/ν is as good.
const SUMMED: u64 = 400;
/// The normal quantile that 99 % lie within, to both sides.
const NORMAL_99: f64 = 2.575_829_303_548_900_4;
/// No Student quantile at 99 % is larger: that of one degree of freedom is 63.66.
const LARGEST: f64 = 64.0;

/// How sure an interval is: the share of the cases in which what is true lies inside.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Confidence {
    level: f64,
    /// The normal quantile that `level` lies within, to both sides.
    normal: f64,
    /// No Student quantile at this level is larger.
    largest: f64,
}

impl From<Confidence> for f64 {
    fn from(confidence: Confidence) -> Self {
        confidence.level
    }
}

impl TryFrom<f64> for Confidence {
    type Error = String;

    fn try_from(level: f64) -> Result<Self, String> {
        Self::new(level).ok_or_else(|| format!("{level} is no share from a half to below 1"))
    }
}

impl Confidence {
    /// 99 %: what every interval has that does not say otherwise.
    pub const P99: Self = Self { level: 0.99, normal: NORMAL_99, largest: LARGEST };

    /// A share from a half to below 1; `None` for anything else.
    pub fn new(level: f64) -> Option<Self> {
        // Closer to 1, neighbouring levels are equal numerically.
        (0.5..=1.0 - 1e-9).contains(&level).then(|| Self::of(level))
    }

    fn of(level: f64) -> Self {
        if level == Self::P99.level {
            return Self::P99;
        }
        let beyond = |z: f64| libm::erfc(z / SQRT_2);
        let normal = bisect((0.0, 9.0), |z| beyond(z) > 1.0 - level);
        // That of one degree of freedom, and a little more for rounding.
        let largest = libm::tan(FRAC_PI_2 * level) * 1.001;
        Self { level, normal, largest }
    }

    /// The share of the cases.
    pub fn level(self) -> f64 {
        self.level
    }

    /// What each of several looks must be sure of, so that all of them together are as sure as this: the error is
    /// split evenly (Bonferroni's inequality).
    #[must_use]
    pub fn of_each_look(self, looks: u32) -> Self {
        if looks <= 1 { self } else { Self::of(1.0 - (1.0 - self.level) / f64::from(looks)) }
    }

    /// How likely |t| is to be at least so long by chance, t of Student's distribution with `degrees` degrees of freedom.
    /// More than 400 degrees count as 400; chances below 1e-15 are rounded.
    pub fn chance(t: f64, degrees: u64) -> f64 {
        if t.is_infinite() { 0.0 } else { (1.0 - probability_within(t, degrees.clamp(1, SUMMED))).max(0.0) }
    }

    /// The length that |t| stays below with this probability, t of Student's distribution with `degrees`
    /// degrees of freedom, to a relative 1e-10. Infinite for 0 degrees.
    pub fn student_t(self, degrees: u64) -> f64 {
        match degrees {
            0 => f64::INFINITY,
            1..=SUMMED => {
                bisect((self.normal, self.largest), |t| probability_within(t, degrees) < self.level)
            }
            _ => expand(self.normal, 1.0 / degrees as f64),
        }
    }
}

/// Halves the bracket until no `f64` lies inside: where `below` turns from true to false.
fn bisect((mut low, mut high): (f64, f64), below: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// P(|T| < t): the finite sums for whole degrees of freedom, Abramowitz & Stegun 26.7.3–4.
fn probability_within(t: f64, degrees: u64) -> f64 {
    let nu = degrees as f64;
    let cos_square = nu / (nu + t * t);
    let (cos, sin) = (cos_square.sqrt(), t / (nu + t * t).sqrt());
    let odd = degrees % 2 == 1;
    // Odd: cos θ (1 + 2/3 cos² + 2·4/(3·5) cos⁴ + …); even: 1 + 1/2 cos² + 1·3/(2·4) cos⁴ + …
    let mut term = if odd { cos } else { 1.0 };
    let mut sum = if degrees == 1 { 0.0 } else { term };
    let mut k = if odd { 2.0 } else { 1.0 };
    while k + 2.0 < nu {
        term *= cos_square * k / (k + 1.0);
        sum += term;
        k += 2.0;
    }
    if odd { FRAC_2_PI * (libm::atan2(sin, cos) + sin * sum) } else { sin * sum }
}

/// The expansion of the quantile in 1/ν from the normal one, Abramowitz & Stegun 26.7.5.
fn expand(normal: f64, inverse: f64) -> f64 {
    let z = normal;
    let s = z * z;
    let g1 = z * (s + 1.0) / 4.0;
    let g2 = z * ((5.0 * s + 16.0) * s + 3.0) / 96.0;
    let g3 = z * (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0;
    let g4 = z * ((((79.0 * s + 776.0) * s + 1482.0) * s - 1920.0) * s - 945.0) / 92160.0;
    z + inverse * (g1 + inverse * (g2 + inverse * (g3 + inverse * g4)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_meets_the_tables() {
        let table = [
            (0.99, 1, 63.656_741_162_871_58),
            (0.99, 2, 9.924_843_200_918_293),
            (0.99, 3, 5.840_909_309_733_357),
            (0.99, 4, 4.604_094_871_349_993),
            (0.99, 6, 3.707_428_021_324_78),
            (0.99, 9, 3.249_835_541_592_126_3),
            (0.99, 20, 2.845_339_709_786_108_5),
            (0.99, 99, 2.626_405_457_280_827_5),
            (0.99, 400, 2.588_176_080_034_74),
            (0.99, 401, 2.588_145_151_766_536_4),
            (0.99, 402, 2.588_114_378_059_019_8),
            (0.99, 10_000, 2.576_321_046_668_529),
            (0.99, u64::MAX, NORMAL_99),
            (0.95, 1, 12.706_204_736_432_095),
            (0.95, 10, 2.228_138_851_964_939),
            (0.999, 3, 12.923_978_636_687_485),
            (0.999, 27, 3.689_591_713_459_278_4),
            (0.998, 111, 3.165_281_940_019_111_2),
            (0.999, 1000, 3.300_282_648_423_944),
        ];
        for (level, degrees, expected) in table {
            let got = Confidence::new(level).unwrap().student_t(degrees);
            assert!((got / expected - 1.0).abs() < 1e-10, "{level} {degrees}: {got} {expected}");
        }
        assert_eq!(Confidence::P99.student_t(0), f64::INFINITY);
        assert_eq!(Confidence::new(0.99), Some(Confidence::P99));
        assert!([0.4, 1.0, f64::NAN].into_iter().all(|level| Confidence::new(level).is_none()));
    }

    #[test]
    fn looks_share_the_error() {
        assert_eq!(Confidence::P99.of_each_look(1), Confidence::P99);
        let each = Confidence::P99.of_each_look(5);
        assert!((each.level() - 0.998).abs() < 1e-15);
        assert!((each.student_t(u64::MAX) - 3.090_232_306_167_813).abs() < 1e-9);
    }
}
