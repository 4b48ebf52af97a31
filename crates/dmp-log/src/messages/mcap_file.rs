//! MCAP files, written.

use crate::LogError;
use dmp_disk::OutputFile;
use mcap::records::MessageHeader;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// How the chunks of an MCAP file are packed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum McapCompression {
    /// The smallest file.
    #[default]
    Zstd,
    /// Zstd at its lowest level.
    ZstdFast,
    /// Larger, and faster to write.
    Lz4,
    /// The fastest to read, by several times.
    None,
}

/// An MCAP file that gets its name in [`McapFile::finish`]; without it nothing is left behind. The same messages give the
/// same bytes.
pub(crate) struct McapFile {
    // Dropped first: the writer may still write while it is dropped.
    writer: mcap::Writer<BufWriter<File>>,
    output: OutputFile,
}

impl fmt::Debug for McapFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("McapFile").field("output", &self.output).finish_non_exhaustive()
    }
}

impl McapFile {
    /// A file of ROS 2, whose chunks are closed from this many bytes on, not packed.
    pub(crate) fn create(
        path: &Path,
        compression: McapCompression,
        chunk_bytes: u64,
    ) -> Result<Self, LogError> {
        Self::with_profile("ros2", path, compression, chunk_bytes)
    }

    /// The same of another profile of MCAP, which is a name or nothing.
    pub(crate) fn with_profile(
        profile: &str,
        path: &Path,
        compression: McapCompression,
        chunk_bytes: u64,
    ) -> Result<Self, LogError> {
        let output = OutputFile::create(path).map_err(|error| LogError::io(path, "write", error))?;
        let file = output.file().map_err(|error| LogError::io(path, "write", error))?;
        // Level 0 is that which the library has for its default.
        let level = u32::from(compression == McapCompression::ZstdFast);
        let compression = match compression {
            McapCompression::Zstd | McapCompression::ZstdFast => Some(mcap::Compression::Zstd),
            McapCompression::Lz4 => Some(mcap::Compression::Lz4),
            McapCompression::None => None,
        };
        let writer = mcap::WriteOptions::new()
            .profile(profile)
            .library("dmp-log")
            .compression(compression)
            .compression_level(level)
            // More threads would cut the data at places that depend on them.
            .compression_threads(0)
            .chunk_size(Some(chunk_bytes))
            .create(BufWriter::new(file))
            .map_err(|error| mcap_error(path, error))?;
        Ok(Self { writer, output })
    }

    pub(crate) fn target(&self) -> &Path {
        self.output.target()
    }

    /// Adds a topic with messages of one type, in CDR; answers its number.
    pub(crate) fn topic(&mut self, topic: &str, message_type: &str, schema: &str) -> Result<u16, LogError> {
        let mut add = || {
            let schema = self.writer.add_schema(message_type, "ros2msg", schema.as_bytes())?;
            self.writer.add_channel(schema, topic, "cdr", &BTreeMap::new())
        };
        add().map_err(|error| mcap_error(self.output.target(), error))
    }

    /// Adds a topic with messages in an encoding of this name, which need no schema.
    pub(crate) fn plain_topic(&mut self, topic: &str, encoding: &str) -> Result<u16, LogError> {
        let added = self.writer.add_channel(0, topic, encoding, &BTreeMap::new());
        added.map_err(|error| mcap_error(self.output.target(), error))
    }

    /// Appends a message to a topic.
    pub(crate) fn write(
        &mut self,
        topic: u16,
        number: u64,
        stamp_ns: i64,
        message: &[u8],
    ) -> Result<(), LogError> {
        // MCAP counts from 1970 without a sign; the message's header keeps the stamp as it is.
        let log_time = stamp_ns.max(0).cast_unsigned();
        let header =
            MessageHeader { channel_id: topic, sequence: number as u32, log_time, publish_time: log_time };
        let written = self.writer.write_to_known_channel(&header, message);
        written.map_err(|error| mcap_error(self.output.target(), error))
    }

    /// Adds what is to be known of the file, by a name.
    pub(crate) fn about(&mut self, name: &str, known: BTreeMap<String, String>) -> Result<(), LogError> {
        let record = mcap::records::Metadata { name: name.to_owned(), metadata: known };
        self.writer.write_metadata(&record).map_err(|error| mcap_error(self.output.target(), error))
    }

    /// Writes the end, makes the file safe on disk and gives it its name.
    pub(crate) fn finish(mut self) -> Result<(), LogError> {
        let target = self.output.target().to_path_buf();
        self.writer.finish().map_err(|error| mcap_error(&target, error))?;
        let file = self.writer.into_inner().into_inner();
        file.map_err(|error| LogError::io(&target, "write", error.into_error()))?;
        self.output.commit().map_err(|error| LogError::io(&target, "write", error))
    }
}

fn mcap_error(path: &Path, error: mcap::McapError) -> LogError {
    let source = match error {
        mcap::McapError::Io(source) => source,
        other => std::io::Error::other(other),
    };
    LogError::io(path, "write", source)
}
