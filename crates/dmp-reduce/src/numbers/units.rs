//! Totals of units of independence, and the error that their scatter shows.

use super::fixed::FixedSum;
use super::wide::Wide;

/// The sum of a quantity in units of 2^-40 m², and over how many returns.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Total {
    pub(crate) sum: i128,
    pub(crate) returns: u64,
}

impl Total {
    pub(crate) fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.returns += other.returns;
    }

    /// Square metres; `None` over nothing.
    pub(crate) fn mean_m2(self) -> Option<f64> {
        FixedSum::from_units(self.sum).mean_m2(self.returns)
    }
}

/// The totals of a quantity in a fixed number of units of independence: stretches of time, or groups of surface.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub(crate) struct Units(Vec<Total>);

/// The error of a ratio D = ΣΔ / ΣN as the scatter of some units shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scatter {
    /// Variance of ΣΔ − D ΣN in squared units of 2^-40 m²: that of D times (ΣN)².
    pub(crate) variance: f64,
    /// How well it is known, in degrees of freedom.
    pub(crate) degrees: f64,
    /// Units with returns.
    pub(crate) units: u64,
}

impl Scatter {
    /// The linearised scatter of `units` units with the errors e = Δ − D N: U/(U−1) Σe².
    pub(crate) fn of(units: u64, errors_square: f64) -> Self {
        let more = units as f64 / (units as f64 - 1.0);
        Self { variance: more * errors_square, degrees: units as f64 - 1.0, units }
    }

    /// The sum of two independent errors; what it is worth in degrees of freedom is Satterthwaite's (1946).
    pub(crate) fn and(self, other: Self) -> Self {
        let variance = self.variance + other.variance;
        let part = |scatter: Self| {
            if scatter.variance > 0.0 { scatter.variance * scatter.variance / scatter.degrees } else { 0.0 }
        };
        let parts = part(self) + part(other);
        let least = self.degrees.min(other.degrees);
        let degrees = if parts > 0.0 { variance * variance / parts } else { least };
        Self { variance, degrees, units: self.units.min(other.units) }
    }
}

impl Units {
    pub(crate) fn new(units: usize) -> Self {
        Self(vec![Total::default(); units])
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// As many units as have returns.
    pub(crate) fn occupied(&self) -> u64 {
        self.0.iter().filter(|unit| unit.returns > 0).count() as u64
    }

    pub(crate) fn add(&mut self, unit: usize, total: Total) {
        self.0[unit].add(total);
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        for (mine, theirs) in self.0.iter_mut().zip(&other.0) {
            mine.add(*theirs);
        }
    }

    /// What the units with returns scatter about the ratio of the `whole`, their sum. Units without returns do not
    /// count: their e is 0 whatever is true.
    ///
    /// Units that carry most of the scatter alone leave few degrees of freedom: for n normal errors of one size
    /// Σe⁴ / (Σe²)² is 3 / (n + 2) in the mean, and of unequal ones what their number is worth.
    pub(crate) fn scatter(&self, whole: Total) -> Scatter {
        let all = i128::from(whole.returns);
        let (mut units, mut squares, mut fourths) = (0, 0.0, 0.0);
        for unit in self.0.iter().filter(|unit| unit.returns > 0) {
            // Exact, so that each e is rounded once.
            let scaled = Wide::product(unit.sum, all) - Wide::product(whole.sum, unit.returns.into());
            let error = scaled.to_f64() / all as f64;
            let square = error * error;
            units += 1;
            squares += square;
            fourths += square * square;
        }
        let scatter = Scatter::of(units, squares);
        let worth = if fourths > 0.0 { 3.0 * squares * squares / fourths - 3.0 } else { f64::INFINITY };
        Scatter { degrees: worth.clamp(1.0, scatter.degrees.max(1.0)), ..scatter }
    }
}
