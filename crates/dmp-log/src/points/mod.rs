//! Points as rows of named numbers: what messages, PCD and PLY files have in common, and how such rows
//! become a scan.

mod find_rule;
mod layout;
mod number;
mod rows;
mod time;
mod time_choice;
mod time_fields;
mod time_rule;

pub(crate) use find_rule::{ENOUGH, FieldExtremes, USUAL_PERIOD_NS, counts_from_stamp};
pub(crate) use layout::{Field, Layout, TimeField};
pub(crate) use number::{NumberType, with_number};
pub(crate) use rows::Rows;
pub use time::{PointTime, StampAt, TimeUnit};
pub(crate) use time_choice::{TimeChoice, choose_time, frames_to_look_at, no_field, odd_times, place_stamp};
pub(crate) use time_fields::TimeFields;
pub(crate) use time_rule::{Origin, RawTime, TimeRule};
