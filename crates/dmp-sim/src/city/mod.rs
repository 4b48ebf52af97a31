//! A city without end, made where the sensor is.
//!
//! `plan`, `terrain` and `block` say what stands where; `tour`, `course` and `drive` lead through it; `form`,
//! `column`, `beams`, `view`, `profile` and `firing` find what beams meet, and `scanner` makes scans of it.

mod beams;
mod block;
mod blocks;
mod column;
mod course;
mod drive;
mod firing;
mod form;
mod noise;
mod plan;
mod profile;
mod recording;
mod scanner;
mod terrain;
mod tour;
mod view;

pub use recording::{CityOptions, CityRecording};
