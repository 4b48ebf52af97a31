//! Scan logs as a folder of depth images: TUM RGB-D, ICL-NUIM, Redwood.

mod camera;
mod found;
mod image;
mod list;
mod log;

pub(crate) use camera::is_scale;
pub(crate) use found::FoundImages;
pub(crate) use list::NAMES as IMAGE_LISTS;
pub(crate) use log::DepthFolder;
