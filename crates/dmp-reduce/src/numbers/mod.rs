//! Numbers that every machine has alike: exact sums, Student's distribution, signs.

mod fixed;
mod likelihood;
mod mixed;
mod signs;
mod student;
mod units;
mod wide;

pub use fixed::FixedSum;
pub(crate) use fixed::{rounded, short_square_units, square_units, units_of, units_to_m2, unrounded_units};
pub use likelihood::log_likelihood_raw;
pub use mixed::mixed;
pub use signs::{Holm, Median, sign_test, signs_needed};
pub use student::Confidence;
pub(crate) use units::{Scatter, Total, Units};
pub(crate) use wide::Wide;
