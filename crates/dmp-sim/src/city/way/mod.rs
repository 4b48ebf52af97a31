//! The way of a drive through a city.

mod course;
mod drive;
mod tour;

pub(crate) use drive::CityDrive;
