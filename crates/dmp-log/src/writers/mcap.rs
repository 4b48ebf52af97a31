//! Writing a scan log as MCAP.

use crate::LogError;
use crate::messages::{
    CdrWriter, FLOAT32, INT32, McapCompression, McapFile, POINT_CLOUD2_SCHEMA, PointField, RosStamp, UINT32,
    start_cloud,
};
use dmp_sensor::Scan;
use std::path::Path;

/// The fields of a point; the last where scans have times.
const FIELDS: [PointField; 4] = [("x", FLOAT32), ("y", FLOAT32), ("z", FLOAT32), ("t", UINT32)];
/// The same where points may be measured before the stamp.
const SIGNED_FIELDS: [PointField; 4] = [FIELDS[0], FIELDS[1], FIELDS[2], ("t", INT32)];

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
    /// Times may lie before the stamp: `t` is int32, which reaches 2.14 s to both sides. Not all who read clouds take that.
    pub signed_times: bool,
}

impl Default for McapWriterOptions {
    fn default() -> Self {
        Self {
            topic: "/points".into(),
            frame_id: "lidar".into(),
            compression: McapCompression::Zstd,
            chunk_bytes: 1 << 20,
            signed_times: false,
        }
    }
}

/// Writes scans as `sensor_msgs/msg/PointCloud2` in ROS 2 CDR: fields `x`, `y`, `z` (float32, metres)
/// and, where scans have times, `t` (uint32 or int32, nanoseconds after the stamp). The same scans give the same
/// bytes. The file gets its name in [`McapScanWriter::finish`]; without it nothing is left behind.
#[derive(Debug)]
pub struct McapScanWriter {
    file: McapFile,
    topic: u16,
    frame_id: String,
    frames: u64,
    with_times: Option<bool>,
    signed_times: bool,
    message: CdrWriter,
}

impl McapScanWriter {
    /// Starts a log that will be at `path`, in place of what may be there.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(path: &Path, options: &McapWriterOptions) -> Result<Self, LogError> {
        let mut file = McapFile::create(path, options.compression, options.chunk_bytes)?;
        let topic = file.topic(&options.topic, "sensor_msgs/msg/PointCloud2", POINT_CLOUD2_SCHEMA)?;
        let (frame_id, message) = (options.frame_id.clone(), CdrWriter::default());
        let signed_times = options.signed_times;
        Ok(Self { file, topic, frame_id, frames: 0, with_times: None, signed_times, message })
    }

    /// Appends a scan.
    ///
    /// # Errors
    /// When the scan has no stamp, a stamp beyond what ROS 2 can say, times beside some of its points or
    /// beyond what `t` can say of the stamp (4.29 s after it, or 2.14 s to both sides), or no times where those before had them; and when
    /// the disk is full.
    pub fn write_scan(&mut self, scan: &Scan) -> Result<(), LogError> {
        let (stamp_ns, stamp) = self.check(scan)?;
        let unwritable =
            |problem| LogError::Unwritable { path: self.file.target().into(), frame: self.frames, problem };
        let with_times = self.with_times.unwrap_or(false);
        let message = &mut self.message;
        let fields = if self.signed_times { &SIGNED_FIELDS } else { &FIELDS };
        let fields = &fields[..if with_times { 4 } else { 3 }];
        let shape = (4 * fields.len(), scan.len());
        let cloud = start_cloud(message, stamp, &self.frame_id, fields, shape).map_err(unwritable)?;
        let bytes = message.message();
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
        cloud.close(message, dense).map_err(unwritable)?;
        self.file.write(self.topic, self.frames, stamp_ns, message.message())?;
        self.frames += 1;
        Ok(())
    }

    /// Writes the end, makes the file safe on disk and gives it its name.
    ///
    /// # Errors
    /// When the disk is full or the file cannot be renamed; what was at the path is then untouched.
    pub fn finish(self) -> Result<(), LogError> {
        self.file.finish()
    }

    /// Checks what the format can say of the scan; its stamp in both forms.
    fn check(&mut self, scan: &Scan) -> Result<(i64, RosStamp), LogError> {
        let unwritable = |problem: String| LogError::Unwritable {
            path: self.file.target().into(),
            frame: self.frames,
            problem,
        };
        let stamp_ns = scan.stamp_ns.ok_or_else(|| unwritable("a PointCloud2 needs a stamp".into()))?;
        let stamp = RosStamp::of_ns(stamp_ns).map_err(unwritable)?;
        let (points, times) = (scan.len(), scan.time_offsets_ns.len());
        if times != 0 && times != points {
            return Err(unwritable(format!("{points} points and {times} times")));
        }
        let most = if self.signed_times { i64::from(i32::MAX) } else { i64::from(u32::MAX) };
        let least = if self.signed_times { i64::from(i32::MIN) } else { 0 };
        let fits = |offset_ns: i64| (least..=most).contains(&offset_ns);
        if let Some(beyond) = scan.time_offsets_ns.iter().find(|&&offset_ns| !fits(offset_ns)) {
            return Err(unwritable(format!("a point {beyond} ns after the stamp is beyond 32 bits")));
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
        Ok((stamp_ns, stamp))
    }
}
