//! Tests of the optimisation on whole graphs.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;
mod faults;
mod oracle;
mod real_data;
mod shapes;
