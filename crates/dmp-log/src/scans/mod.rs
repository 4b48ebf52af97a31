//! What every log of scans has: its traits, its summary, its frames.

mod field_info;
mod frame_info;
mod log;
mod memory_log;
mod options;
mod part_log;
mod setting;
mod stamp_jumps;
mod summary;

pub use field_info::{FieldInfo, FieldMeaning};
pub use frame_info::{FrameInfo, OutlinedScan};
pub(crate) use frame_info::{median_step_ns, of_frame, runs_of_eight};
pub use log::{LogSurvey, ScanLog, ScanReader, ScanStream};
pub use memory_log::{MemoryLog, MemoryLogFault};
pub use options::LogOptions;
pub(crate) use part_log::PartLog;
pub use setting::LogSetting;
pub use stamp_jumps::{StampJump, stamp_jumps};
pub use summary::{LogFormat, LogSummary, NO_CHECKSUMS, TopicInfo};
