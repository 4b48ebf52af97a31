//! How far a map lies from a reference surface, out of core.
//!
//! # Brief overview
//! [`EvaluatedPoints`] takes the points of a map, moved into the reference's frame; it becomes a
//! [`Reference`], which takes triangles or points, and [`Reference::measure`] gives a [`SurfaceReport`]:
//! the distances from the map to the reference (accuracy, the *surface mean distance* among them) and
//! from the reference to the map (completeness), each capped.
//!
//! Both sides are sorted into tiles on disk; a tile has all that lies within the cap of it, so tiles are
//! measured alone and in parallel, each with an index of its own. Distances are rounded to 2⁻²⁰ m and
//! summed as integers: the numbers do not depend on threads, budget or tiles. `docs/surface.md` has every
//! definition.
//!
//! ```
//! use dmp_sensor::Isometry3;
//! use dmp_truth::surface::{EvaluatedPoints, SurfaceSettings};
//!
//! let settings = SurfaceSettings { work_folder: std::env::temp_dir(), ..SurfaceSettings::default() };
//! let mut map = EvaluatedPoints::new(&settings, Isometry3::identity())?;
//! map.add(&[[0.2, 0.2, 0.07], [0.4, 0.1, -0.07]])?;
//! let mut floor = map.against_reference()?;
//! floor.add_triangles(&[[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])?;
//! let report = floor.measure(&())?;
//! assert!((report.accuracy.mean_m - 0.07).abs() < 1e-6);
//! # Ok::<(), dmp_truth::surface::SurfaceError>(())
//! ```

mod error;
mod gather;
mod grid;
mod measure;
mod report;
mod settings;
mod store;
mod tally;
mod targets;
mod triangle;

pub use error::{Extent, SurfaceError};
pub use gather::{EvaluatedPoints, Reference};
pub use measure::SurfaceWatch;
pub use report::{AtThreshold, Distances, EvaluatedCounts, ReferenceCounts, SurfaceReport};
pub use settings::SurfaceSettings;
pub use store::surfel_centres;
pub use triangle::Triangle;

pub use dmp_map::{MapError, Store};
