//! Absolute and relative errors of a trajectory against a reference (APE, RPE).
//!
//! # Brief overview
//! A [`PosePath`] holds poses as a file has them. [`Preparation`] cuts, associates and aligns two of
//! them into [`Prepared`]; [`absolute`] and [`relative`] take the [`Errors`] of what comes out, and
//! [`Statistics`] sums them up. Conventions, and so the numbers, are those of `evo` 1.38.1.
//!
//! ```
//! use dmp_truth::trajectory::{Pose, PosePath, Preparation, Relation, Statistics, absolute};
//! use nalgebra::Vector3;
//!
//! let path = |y: f64| {
//!     let pose = |x: f64| Pose { position_m: Vector3::new(x, y, 0.0), ..Pose::identity() };
//!     PosePath::new([0.0, 1.0, 2.0].map(pose).to_vec(), Some(vec![0.0, 0.1, 0.2]))
//! };
//! let prepared = Preparation::default().apply(path(0.0)?, &path(0.5)?)?;
//! let errors = absolute(&prepared.reference, &prepared.estimate, Relation::TranslationPart)?;
//! assert_eq!(Statistics::of(&errors.values).map(|s| s.rmse), Some(0.5));
//! # Ok::<(), dmp_truth::trajectory::CompareError>(())
//! ```

mod align;
mod associate;
mod error;
mod metric;
mod pairs;
mod path;
mod prepare;
mod rigid;
mod rotation;
mod statistics;
mod sum;
mod units;

pub use align::{Similarity, umeyama};
pub use associate::{Matching, associate, match_stamps};
pub use error::CompareError;
pub use metric::{Errors, Relation, absolute, relative};
pub use pairs::{DELTA_TOLERANCE, PairOptions, pairs};
pub use path::{Pose, PosePath};
pub use prepare::{Alignment, Preparation, Prepared};
pub use rigid::{quaternion_xyzw, rigid_alignment};
pub use statistics::Statistics;
pub use units::{DeltaUnit, ErrorUnit};
