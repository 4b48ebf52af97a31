//! The lengths that depend on what is measured, in one table: an entry for a drive, one for a room; and how amounts are written.
//!
//! A LiDAR on a road sees walls 30 m away, a camera in a room those 3 m away: what is a gross error, how fine a map is, how
//! far one looks are in proportion to that. [`Scales`] names the kind, [`Scales::lengths`] has all its numbers. A new kind is
//! a variant of [`Scales`] and an entry of its table, both in `scales.rs`.
//!
//! ```
//! use dmp_lengths::Scales;
//!
//! assert_eq!(Scales::named("room"), Some(Scales::Room));
//! assert_eq!(Scales::Room.lengths().near_m, [0.5, 0.2, 0.05]);
//! ```

mod lengths;
mod loops;
mod scales;
mod thousands;

pub use lengths::{Lengths, Reach};
pub use loops::{CameraViews, LoopLengths, LoopMapLengths, SimulatedLoopLengths};
pub use scales::Scales;
pub use thousands::thousands;
