//! Map metrics without ground truth that others use, as baselines: MME, MPV and MOM.
//!
//! # Brief overview
//! [`map_sharpness`] has the mean map entropy (MME; Droeschel & Behnke 2018, Razlaw et al. 2015) and the
//! mean plane variance (MPV; Razlaw et al. 2015) of a cloud in world coordinates. The mutually orthogonal
//! metric (MOM; Kornilova & Ferrer, "Be your own benchmark", 2021) comes in two steps:
//! [`orthogonal_subset`] picks points of one scan on three mutually orthogonal groups of planes, and
//! [`mutually_orthogonal`] says how thick the map is around them.
//!
//! Lower is better for all three. MPV and MOM are m²; MME is nats.
//!
//! Definitions and defaults are those of the Python package map-metrics 0.0.4. What differs:
//!
//! - It answers 0 where no neighbourhood is large enough; here that is `None`.
//! - Normals have no sign. It keeps whichever its eigensolver gives; here the largest component is positive.
//! - It clusters all planar points of the scan, in memory that grows with their square; here at most
//!   [`PeerOptions::max_clustered`], every n-th, in memory that grows with their number.
//! - It lists the cliques of the graph of orthogonal clusters. With |cosines| below 0.1 no four directions
//!   of space are mutually orthogonal, so here the largest triangle is looked for. Which of two equally
//!   large ones is taken may differ.
//! - Its queries are all points of the map; here every [`PeerOptions::query_step`]-th, the neighbours
//!   being those of the whole cloud.
//!
//! The same cloud gives the same bits for any number of threads: neighbours are added up in the order of
//! a sorted grid.
//!
//! ```
//! use dmp_study::peers::{PeerOptions, map_sharpness};
//!
//! let wall = |thick_m: f64| -> Vec<[f64; 3]> {
//!     (0..900).map(|k| [f64::from(k % 30) * 0.1, f64::from(k / 30) * 0.1, f64::from(k % 7) * thick_m]).collect()
//! };
//! let [thin, thick] = [0.001, 0.01].map(|thick_m| map_sharpness(&wall(thick_m), &PeerOptions::default()));
//! assert!(thin.mme < thick.mme && thin.mpv_m2 < thick.mpv_m2);
//! ```

mod grid;
mod mom;
mod options;
mod orthogonal;
mod sharpness;
mod ward;

pub use mom::mutually_orthogonal;
pub use options::PeerOptions;
pub use orthogonal::{NoOrthogonalSubset, OrthogonalSubset, orthogonal_subset};
pub use sharpness::{MapSharpness, map_sharpness};
