//! A city without end, made where the sensor is.
//!
//! `plan`, `terrain` and `block` say what stands where; `tour`, `course` and `drive` lead through it; `form`,
//! `column`, `beams`, `view`, `profile` and `firing` find what beams meet, and `scanner` makes scans of it.

mod beams;
mod block;
mod blocks;
mod column;
mod firing;
mod form;
mod noise;
mod plan;
mod profile;
mod recording;
mod scanner;
mod terrain;
mod view;
mod way;

pub use recording::{CityOptions, CityRecording};
