//! What a report was made with: the log, the runs as they were read, the settings, the sample, the time and the memory.

mod conventions;
mod effort;
mod ego;
mod inputs;
mod pairing;
mod pose_at;
mod sampling;
mod segment_length;
mod settings;

pub use conventions::{ConventionsReport, EstimateReport, LeftOutReport};
pub use effort::{MemoryReport, PassTimes, TileReport};
pub use ego::{Ego, EgoReport};
pub use inputs::{DropReport, InputReport, RunInputReport};
pub use pairing::Pairing;
pub use pose_at::PoseAt;
pub use sampling::{QuickReport, SamplingReport};
pub use segment_length::SegmentLength;
pub use settings::{ConfigReport, DepthNoiseReport, PromiseReport, SegmentReport};
