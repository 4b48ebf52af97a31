//! Writing logs in any of the formats that are written.

use std::path::Path;

use dmp_log::{FolderFormat, FolderScanWriter, LogError, McapCompression, McapScanWriter, McapWriterOptions};
use dmp_sensor::Scan;

use crate::console::Usage;

/// The formats of logs that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OutputFormat {
    /// MCAP with `PointCloud2`
    Mcap,
    /// A folder of KITTI .bin, with times.txt and times/*.f32
    Bin,
    /// A folder of PCD
    Pcd,
    /// A folder of PLY
    Ply,
    /// A folder of LAZ, coordinates to 0.1 mm
    Laz,
    /// A folder of LAS, coordinates to 0.1 mm
    Las,
}

/// How the chunks of an MCAP file are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Compression {
    /// The smallest file
    Zstd,
    /// Nearly as small, in half the time
    ZstdFast,
    /// Faster to write
    Lz4,
    /// Fastest to read
    None,
}

impl OutputFormat {
    /// By the name of the output: `FILE.mcap`, or a folder of `.bin` where there is no extension.
    pub(crate) fn of_name(path: &Path) -> Result<Self, Usage> {
        match path.extension() {
            Some(extension) if extension == "mcap" => Ok(Self::Mcap),
            None => Ok(Self::Bin),
            Some(_) => {
                let problem = "a log to write is FILE.mcap, or a folder: a name without extension";
                Err(Usage(format!("{}: {problem}", path.display())))
            }
        }
    }

    fn folder(self) -> Option<FolderFormat> {
        match self {
            Self::Mcap => None,
            Self::Bin => Some(FolderFormat::Bin),
            Self::Pcd => Some(FolderFormat::Pcd),
            Self::Ply => Some(FolderFormat::Ply),
            Self::Laz => Some(FolderFormat::Laz),
            Self::Las => Some(FolderFormat::Las),
        }
    }

    /// What the format does not keep; `None` where it keeps all.
    pub(crate) fn precision(self) -> Option<&'static str> {
        self.folder().and_then(FolderFormat::precision)
    }
}

/// Writes a log in one of the formats.
pub(crate) enum LogWriter {
    Mcap(Box<McapScanWriter>),
    Folder(FolderScanWriter),
}

impl LogWriter {
    pub(crate) fn create(
        path: &Path,
        format: OutputFormat,
        compression: Compression,
    ) -> Result<Self, LogError> {
        let Some(format) = format.folder() else {
            let compression = match compression {
                Compression::Zstd => McapCompression::Zstd,
                Compression::ZstdFast => McapCompression::ZstdFast,
                Compression::Lz4 => McapCompression::Lz4,
                Compression::None => McapCompression::None,
            };
            let options = McapWriterOptions { compression, ..McapWriterOptions::default() };
            return Ok(Self::Mcap(Box::new(McapScanWriter::create(path, &options)?)));
        };
        Ok(Self::Folder(FolderScanWriter::create(path, format)?))
    }

    pub(crate) fn write(&mut self, scan: &Scan) -> Result<(), LogError> {
        match self {
            Self::Mcap(writer) => writer.write_scan(scan),
            Self::Folder(writer) => writer.write_scan(scan),
        }
    }

    pub(crate) fn finish(self) -> Result<(), LogError> {
        match self {
            Self::Mcap(writer) => writer.finish(),
            Self::Folder(writer) => writer.finish(),
        }
    }
}
