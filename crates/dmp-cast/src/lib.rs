//! The tiled BVH caster: rays in; first, nearest and first-independent surfel ranges out.
//!
//! # Brief overview
//! A [`Caster`] stands on a [`Store`](dmp_map::Store) and answers blocks of [`Query`]s with
//! [`Answer`]s: where a ray crosses the map first (the z' of Zhang & Chen 2021, eq. 7), where nearest to
//! the measured range, and where first among the surfels that owe nothing to the ray's own part of the
//! drive. The three come from one walk. Rays go through the map's tiles nearest first; a block's rays
//! are taken tile by tile, so each tile is loaded once for a block however little memory there is.
//!
//! A miss is `None`, never a range. World coordinates are `f64`; inside a tile, `f32` from the place
//! where the ray enters it.
//!
//! ```no_run
//! use dmp_cast::{CastBuffers, CastSettings, Caster, Query};
//! use dmp_map::Store;
//!
//! let store = Store::open("town.dmpmap".as_ref())?;
//! let caster = Caster::new(store, CastSettings::default(), 256 << 20);
//! let ray = Query {
//!     origin_in_world_m: [0.0, 0.0, 1.8],
//!     direction_in_world: [1.0, 0.0, 0.0],
//!     measured_m: 12.3,
//!     segment: None,
//! };
//! let mut answers = Vec::new();
//! caster.cast(&[ray], &mut answers, &mut CastBuffers::default())?;
//! println!("first surface after {:?} m", answers[0].first_m);
//! # Ok::<(), dmp_map::MapError>(())
//! ```

mod caster;
mod counter;
mod kernel;
mod query;
mod tree;
mod walk;

pub use caster::{CastBuffers, Caster};
pub use counter::{CountBuffers, CrossingCounter};
pub use query::{Answer, CastSettings, Query};
