//! Files on the command line that are written, and those that are read back.

mod clash;
mod log_writer;
mod save;
mod saved_result;

pub(crate) use clash::{is_same_place, refuse_clashes, refuse_printed, refuse_same};
pub(crate) use log_writer::{Compression, LogWriter, OutputFormat};
pub(crate) use save::{
    OutputsFolder, SavedTogether, is_missing, may_be_file, refuse_other, refuse_unnamed, save, save_text,
    save_trajectory, take_folder, write_trajectory,
};
pub(crate) use saved_result::{read_result, read_with_returns};
