use crate::LogError;
use crate::atomic::Pending;
use crate::ros::{CdrWriter, POINT_CLOUD2_SCHEMA};
use dmp_sensor::Scan;
use mcap::records::MessageHeader;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// `FLOAT32` and `UINT32` of `sensor_msgs/msg/PointField`.
const FLOAT32: u8 = 7;
const UINT32: u8 = 6;

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

/// How an MCAP log is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct McapWriterOptions {
    /// The topic of the scans.
    pub topic: String,
    /// The name of the sensor's frame.
    pub frame_id: String,
    /// How chunks are packed.
    pub compression: McapCompression,
    /// Size from which a chunk is closed, uncompressed.
    pub chunk_bytes: u64,
}

impl Default for McapWriterOptions {
    fn default() -> Self {
        Self {
            topic: "/points".into(),
            frame_id: "lidar".into(),
            compression: McapCompression::Zstd,
            chunk_bytes: 1 << 20,
        }
    }
}

/// Writes scans as `sensor_msgs/msg/PointCloud2` in ROS 2 CDR: fields `x`, `y`, `z` (float32, metres)
/// and, where scans have times, `t` (uint32, nanoseconds after the stamp). The same scans give the same
/// bytes. The file gets its name in [`McapScanWriter::finish`]; without it nothing is left behind.
pub struct McapScanWriter {
    // Dropped first: the writer may still write while it is dropped.
    writer: mcap::Writer<BufWriter<File>>,
    pending: Pending,
    channel_id: u16,
    frame_id: String,
    frames: u64,
    with_times: Option<bool>,
    message: CdrWriter,
}

impl fmt::Debug for McapScanWriter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("McapScanWriter")
            .field("pending", &self.pending)
            .field("frames", &self.frames)
            .finish_non_exhaustive()
    }
}

impl McapScanWriter {
    /// Starts a log that will be at `path`, in place of what may be there.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(path: &Path, options: &McapWriterOptions) -> Result<Self, LogError> {
        let (pending, file) = Pending::file(path)?;
        let mcap_error = |error| mcap_error(path, error);
        // Level 0 is that which the library has for its default.
        let level = u32::from(options.compression == McapCompression::ZstdFast);
        let compression = match options.compression {
            McapCompression::Zstd | McapCompression::ZstdFast => Some(mcap::Compression::Zstd),
            McapCompression::Lz4 => Some(mcap::Compression::Lz4),
            McapCompression::None => None,
        };
        let mut writer = mcap::WriteOptions::new()
            .profile("ros2")
            .library("dmp-log")
            .compression(compression)
            .compression_level(level)
            // More threads would cut the data at places that depend on them.
            .compression_threads(0)
            .chunk_size(Some(options.chunk_bytes))
            .create(BufWriter::new(file))
            .map_err(mcap_error)?;
        let schema =
            writer.add_schema("sensor_msgs/msg/PointCloud2", "ros2msg", POINT_CLOUD2_SCHEMA.as_bytes());
        let schema_id = schema.map_err(mcap_error)?;
        let channel = writer.add_channel(schema_id, &options.topic, "cdr", &BTreeMap::new());
        let channel_id = channel.map_err(mcap_error)?;
        Ok(Self {
            writer,
            pending,
            channel_id,
            frame_id: options.frame_id.clone(),
            frames: 0,
            with_times: None,
            message: CdrWriter::default(),
        })
    }

    /// Appends a scan.
    ///
    /// # Errors
    /// When the scan has no stamp, a stamp beyond what ROS 2 can say, times beside some of its points or
    /// more than 4.29 s after the stamp or before it, or no times where those before had them; and when
    /// the disk is full.
    pub fn write_scan(&mut self, scan: &Scan) -> Result<(), LogError> {
        let (seconds, nanoseconds) = self.check(scan)?;
        let with_times = self.with_times.unwrap_or(false);
        let message = &mut self.message;
        message.start();
        message.u32(seconds.cast_unsigned());
        message.u32(nanoseconds);
        message.string(&self.frame_id);
        message.u32(1);
        message.u32(scan.len() as u32);
        let fields = [("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32), ("t", 12, UINT32)];
        let count = if with_times { 4 } else { 3 };
        message.u32(count);
        for (name, offset, datatype) in fields.into_iter().take(count as usize) {
            message.string(name);
            message.u32(offset);
            message.u8(datatype);
            message.u32(1);
        }
        let point_step = 4 * count;
        message.u8(0);
        message.u32(point_step);
        message.u32(point_step * scan.len() as u32);
        message.u32(point_step * scan.len() as u32);
        let bytes = message.message();
        bytes.reserve(point_step as usize * scan.len());
        if with_times {
            for (point, &offset_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
                let [x, y, z] = point.map(f32::to_le_bytes);
                bytes.extend_from_slice([x, y, z, (offset_ns as u32).to_le_bytes()].as_flattened());
            }
        } else {
            for point in &scan.points_in_sensor_m {
                bytes.extend_from_slice(point.map(f32::to_le_bytes).as_flattened());
            }
        }
        let dense = scan.points_in_sensor_m.as_flattened().iter().all(|c| c.is_finite());
        message.u8(u8::from(dense));
        // MCAP counts from 1970 without a sign; the header above keeps the stamp as it is.
        let log_time = scan.stamp_ns.unwrap_or(0).max(0).cast_unsigned();
        let header = MessageHeader {
            channel_id: self.channel_id,
            sequence: self.frames as u32,
            log_time,
            publish_time: log_time,
        };
        let written = self.writer.write_to_known_channel(&header, message.message());
        written.map_err(|error| mcap_error(self.pending.target(), error))?;
        self.frames += 1;
        Ok(())
    }

    /// Writes the end, makes the file safe on disk and gives it its name.
    ///
    /// # Errors
    /// When the disk is full or the file cannot be renamed; what was at the path is then untouched.
    pub fn finish(mut self) -> Result<(), LogError> {
        let target = self.pending.target();
        self.writer.finish().map_err(|error| mcap_error(target, error))?;
        let file = self.writer.into_inner().into_inner();
        let file = file.map_err(|error| LogError::io(target, "write", error.into_error()))?;
        file.sync_all().map_err(|error| LogError::io(target, "write", error))?;
        self.pending.commit()
    }

    /// Checks what the format can say of the scan; its stamp in whole seconds and the rest.
    fn check(&mut self, scan: &Scan) -> Result<(i32, u32), LogError> {
        let unwritable = |problem: String| LogError::Unwritable {
            path: self.pending.target().into(),
            frame: self.frames,
            problem,
        };
        let stamp_ns = scan.stamp_ns.ok_or_else(|| unwritable("a PointCloud2 needs a stamp".into()))?;
        let seconds = i32::try_from(stamp_ns.div_euclid(1_000_000_000))
            .map_err(|_| unwritable(format!("the stamp {stamp_ns} ns is beyond 32 bits of seconds")))?;
        let nanoseconds = stamp_ns.rem_euclid(1_000_000_000) as u32;
        let (points, times) = (scan.len(), scan.time_offsets_ns.len());
        if times != 0 && times != points {
            return Err(unwritable(format!("{points} points and {times} times")));
        }
        if let Some(beyond) = scan.time_offsets_ns.iter().find(|&&offset| u32::try_from(offset).is_err()) {
            return Err(unwritable(format!("a point {beyond} ns after the stamp is beyond 32 bits")));
        }
        if u32::try_from(points as u64 * 16).is_err() {
            return Err(unwritable(format!("{points} points are more than 32 bits of bytes")));
        }
        match self.with_times {
            _ if points == 0 => {}
            Some(before) if before != (times > 0) => {
                return Err(unwritable(format!(
                    "it has {times} times for {points} points, unlike those before it"
                )));
            }
            _ => self.with_times = Some(times > 0),
        }
        Ok((seconds, nanoseconds))
    }
}

fn mcap_error(path: &Path, error: mcap::McapError) -> LogError {
    let source = match error {
        mcap::McapError::Io(source) => source,
        other => std::io::Error::other(other),
    };
    LogError::io(path, "write", source)
}
