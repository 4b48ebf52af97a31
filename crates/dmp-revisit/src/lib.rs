//! Two visits of one place: how they register to each other, what that says of a run's drift, and of its clock and extrinsic.
//! And two runs: how far apart they are.
//!
//! - [`visits`] finds which visits of a run see one place.
//! - [`mod@align`] registers the surfaces of one visit to those of another, with covariance and refusals.
//! - [`drift`] turns registrations into displacements of a run in metres, and sums them up.
//! - [`mod@apart`] measures how far apart two runs put the same points, by their poses.
//! - [`mod@calibrate`] estimates the clock and the extrinsic with which surfaces that several scans see become thinnest.
//!
//! Nothing here reads a file. The bits of every result are the same for any number of threads.

pub mod align;
pub mod apart;
pub mod calibrate;
pub mod drift;
pub mod visits;
