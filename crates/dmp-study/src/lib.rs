//! The scores of one log's runs beside ground truth and other metrics.
//!
//! # Brief overview
//! [`study`] scores the runs of a log as [`dmp::evaluate`] does, and measures each against a reference
//! trajectory, perhaps a reference surface, and by the map metrics of others ([`peers`]: MME, MPV, MOM).
//! The answer is a [`Study`]: a [`StudyTable`] with one [`Column`] for each quantity, and for every pair of
//! columns a [`Correlation`]. [`plots_of`] draws it as pictures of [`dmp_draw::plot`]. `docs/study.md` has the meaning of
//! every column.
//!
//! The points that surface distance and the peers look at are the same returns in every run, thinned. Nothing here opens a
//! file.

mod clouds;
mod columns;
mod error;
mod maps;
mod options;
pub mod peers;
mod plots;
mod study;
mod table;
mod truth;

pub use error::StudyError;
pub use options::StudyOptions;
pub use plots::{Picture, plots_of};
pub use study::{PeerReport, Study, SurfaceReport, TruthReport, study};
pub use table::{Column, Correlation, StudyTable, correlation};
pub use truth::{ReferenceSurface, TruthOptions};
