//! Lines of text with numbers in columns: poses, stamps and their units.

mod numbers;
mod stamp_unit;
mod times;

pub(crate) use numbers::{numbers, pose_of, pose_of_rows, values};
pub(crate) use stamp_unit::{found_or, unit_of_large_numbers, unit_of_lines, unit_since_1970};
pub use times::write_times;
