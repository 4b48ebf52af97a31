//! Logs of each format: found, opened, outlined.

mod bag_log;
mod companions;
mod depth_folder;
mod find;
mod las_log;
mod log_index;
mod open;
mod outline;
mod scan_folder;

pub use companions::{Companions, is_of_log};
pub(crate) use depth_folder::is_scale;
pub use find::has_bag_name;
pub(crate) use find::{ROS1_ADVICE, ROS1_MAGIC, bag_at};
pub use las_log::MadeWith;
pub use log_index::{FileRanges, LogIndex};
pub use open::{open_log, survey_log};
pub use outline::{LogOutline, outline_log};
pub use scan_folder::{BinLayout, BinLayoutError};
pub(crate) use scan_folder::{MAX_STAMPS_BYTES, parse_times};
