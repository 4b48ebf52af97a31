//! PCD, the format of the Point Cloud Library: what clouds and scans in it have in common. Version 0.7 of
//! <https://pointclouds.org/documentation/tutorials/pcd_file_format.html>, and its forerunners.

pub(crate) mod header;
pub(crate) mod header_lines;
pub(crate) mod lzf;
