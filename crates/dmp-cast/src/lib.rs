//! The tiled BVH caster: rays in; first, nearest and first-independent surfel ranges out.
//!
//! # Brief overview
//! A [`Caster`] casts into a map (a [`Store`](dmp_map::Store) on disk, or any [`TileSource`](dmp_map::TileSource)) and
//! answers blocks of [`Query`]s with [`Answer`]s. An answer has three ranges: the first crossing with the map (the z'
//! of Zhang & Chen 2021, eq. 7), the crossing nearest to the measured range, and the first one with a surfel
//! independent of the ray's own part of the drive. One traversal finds all three, and optionally the surfel at one of
//! them. [`Caster::hold`] holds that surfel for each return of posed scans: residuals and their derivatives follow
//! ([`dmp_sensor::PosedReturn::against`]).
//!
//! Rays traverse the map's tiles nearest first, together with their neighbours: in packets of sixteen where that is
//! faster, else one by one. Every tile has its own tree, eight wide, with leaves of sixteen discs that are tested at
//! once, with AVX-512, AVX2 or the baseline instructions ([`Path`]). None of this changes a bit of an answer.
//! `docs/casting.md` explains the method, `docs/performance.md` has the speed.
//!
//! A miss is `None`, never a range. World coordinates are `f64`; inside a tile, `f32` relative to the place where the
//! ray enters it.
//!
//! ```
//! use dmp_cast::{CastBuffers, CastSettings, Caster, Query};
//! use dmp_sensor::Ray;
//! use dmp_map::{Durability, FuseBuffers, Lattice, MapFuser, Origin, Store};
//!
//! // A wall at x = 5.02 m, fused into a map.
//! let folder = tempfile::tempdir()?;
//! let fuser = MapFuser::new(Lattice::new(0.2)?, 64 << 20, folder.path())?;
//! let wall: Vec<[f64; 3]> = (0..9000).map(|i| [5.02, f64::from(i % 100) * 0.05, f64::from(i / 100) * 0.05]).collect();
//! fuser.add(&wall, Some(0), &mut FuseBuffers::default())?;
//! let path = folder.path().join("wall.dmpmap");
//! fuser.finish(&path, &Origin::of("a wall"), Durability::Temporary, &|_, _| ())?;
//!
//! // A ray along x, and one that looks away.
//! let caster = Caster::new(Store::open(&path)?, CastSettings::default(), 256 << 20);
//! let towards = Ray { origin_in_world: [0.0, 2.5, 2.0], direction_in_world: [1.0, 0.0, 0.0], range_m: 5.3 };
//! let away = Ray { direction_in_world: [-1.0, 0.0, 0.0], ..towards };
//! let mut answers = Vec::new();
//! caster.cast(&[towards, away].map(|ray| Query { ray, segment: None }), &mut answers, &mut CastBuffers::default())?;
//! assert!((answers[0].first_m.unwrap_or_default() - 5.02).abs() < 1e-3);
//! assert_eq!(answers[1].first_m, None);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![expect(
    clippy::inline_always,
    reason = "what holds vectors must be compiled for their instructions: see `lanes`"
)]
#![expect(
    clippy::needless_bitwise_bool,
    reason = "what is decided for sixteen rays at once must not jump for one"
)]
#![expect(clippy::needless_range_loop, reason = "columns of sixteen are gone through side by side, by lane")]

mod answers;
mod bands;
mod caster;
mod casting;
mod counter;
mod discs;
mod held;
mod journey;
mod lanes;
mod order;
mod path;
mod query;
mod rays;
mod within;

pub use caster::{Caster, TileCache};
pub use casting::CastBuffers;
#[doc(hidden)]
pub use casting::Grouping;
pub use counter::{CountBuffers, CrossingCounter};
pub use held::{Held, HoldBuffers, HoldSettings, Points, PosedScans};
pub use path::Path;
pub use query::{Answer, CastSettings, Hit, HitDisc, Query, Wanted};
#[doc(hidden)]
pub use within::CastTile;
