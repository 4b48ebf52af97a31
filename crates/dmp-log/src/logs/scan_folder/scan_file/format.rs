//! The formats of files with one scan.

use crate::LogFormat;
use std::path::Path;

/// The formats of files with one scan each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ScanFormat {
    /// KITTI: float32 x, y, z, intensity and nothing else.
    Bin,
    Pcd,
    Ply,
    /// LAS or LAZ.
    Las,
}

impl ScanFormat {
    /// By the file's extension, in letters of either size.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "bin" => Self::Bin,
            "pcd" => Self::Pcd,
            "ply" => Self::Ply,
            "las" | "laz" => Self::Las,
            _ => return None,
        })
    }

    /// The extensions in words, and the format of the log.
    fn table(self) -> (&'static str, LogFormat) {
        match self {
            Self::Bin => (".bin", LogFormat::BinFolder),
            Self::Pcd => (".pcd", LogFormat::PcdFolder),
            Self::Ply => (".ply", LogFormat::PlyFolder),
            Self::Las => (".las or .laz", LogFormat::LasFolder),
        }
    }

    pub(crate) fn extensions(self) -> &'static str {
        self.table().0
    }

    pub(crate) fn of_log(self) -> LogFormat {
        self.table().1
    }
}
