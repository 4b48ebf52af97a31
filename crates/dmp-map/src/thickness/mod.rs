//! How thick a map's flat places are, from exact sums of a sample of its cells.

mod cell_sums;
mod flat;
mod layers;
mod sampled;
mod summary;

pub use layers::LayerSearch;
pub(crate) use sampled::CellSampler;
pub use sampled::{SampledCells, ScanSample};
pub use summary::{DoubledPlace, Layers, Thickness};
