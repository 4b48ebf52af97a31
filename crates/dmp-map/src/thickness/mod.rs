//! How thick a map's flat places are, from exact sums of a sample of its cells.

mod flat;
mod layers;
mod sampled;
mod summary;

pub use layers::LayerSearch;
pub use sampled::SampledCells;
pub(crate) use sampled::{CellSampler, Sampled};
pub use summary::{DoubledPlace, Layers, Thickness};
