//! Scored returns to be played scan by scan.

use super::point::{ScoredPoint, ScoredScan};
use crate::LogError;
use crate::messages::{
    CdrWriter, FLOAT32, INT32, McapCompression, McapFile, POINT_CLOUD2_SCHEMA, PointField, RosStamp,
    TF_MESSAGE_SCHEMA, UINT8, start_cloud, write_transform,
};
use dmp_sensor::Point3;
use std::path::Path;

/// The frame of the world, as REP 105 has it.
const WORLD: &str = "map";
/// Size from which a chunk is closed, not packed.
const CHUNK_BYTES: u64 = 1 << 20;
const FIELDS: [PointField; 13] = [
    ("x", FLOAT32),
    ("y", FLOAT32),
    ("z", FLOAT32),
    ("residual_m", FLOAT32),
    ("signed_residual_m", FLOAT32),
    ("map_range_m", FLOAT32),
    ("range_m", FLOAT32),
    ("first_residual_m", FLOAT32),
    ("nearest_residual_m", FLOAT32),
    ("after_stamp_s", FLOAT32),
    ("frame", INT32),
    ("kind", UINT8),
    ("revisited", UINT8),
];
/// Two more than the fields take, so that numbers are aligned in every point.
const POINT_BYTES: usize = 48;

/// Writes each scan in the frame of the sensor at its stamp, brought there from where each return was measured, and that
/// frame's pose in the world: float32 is exact enough wherever in the world the drive was.
#[derive(Debug)]
pub(super) struct ScanPlayer {
    file: McapFile,
    clouds: u16,
    poses: u16,
    sensor: String,
    scans: u64,
    message: CdrWriter,
}

impl ScanPlayer {
    pub(super) fn create(path: &Path, run: &str) -> Result<Self, LogError> {
        let mut file = McapFile::create(path, McapCompression::ZstdFast, CHUNK_BYTES)?;
        let clouds =
            file.topic(&format!("/{run}/residuals"), "sensor_msgs/msg/PointCloud2", POINT_CLOUD2_SCHEMA)?;
        let poses = file.topic("/tf", "tf2_msgs/msg/TFMessage", TF_MESSAGE_SCHEMA)?;
        Ok(Self { file, clouds, poses, sensor: run.to_owned(), scans: 0, message: CdrWriter::default() })
    }

    pub(super) fn write(
        &mut self,
        scan: &ScoredScan,
        start_ns: i64,
        points: &[ScoredPoint],
    ) -> Result<(), LogError> {
        let (file, message) = (&mut self.file, &mut self.message);
        let (path, frame) = (file.target().to_path_buf(), self.scans);
        let unwritable = |problem: String| LogError::Unwritable { path: path.clone(), frame, problem };
        let stamp_ns = scan.stamp_ns.ok_or_else(|| unwritable("a PointCloud2 needs a stamp".into()))?;
        let stamp = RosStamp::of_ns(stamp_ns).map_err(unwritable)?;
        write_transform(message, stamp, [WORLD, &self.sensor], &scan.world_from_sensor);
        file.write(self.poses, self.scans, stamp_ns, message.message())?;
        let shape = (POINT_BYTES, points.len());
        let cloud = start_cloud(message, stamp, &self.sensor, &FIELDS, shape).map_err(unwritable)?;
        let sensor_from_world = scan.world_from_sensor.inverse();
        let stamp_s = stamp_ns.saturating_sub(start_ns) as f64 / 1e9;
        let bytes = message.message();
        for point in points {
            let place = sensor_from_world * Point3::from(point.point_in_world_m);
            let lengths = [
                place.x as f32,
                place.y as f32,
                place.z as f32,
                point.signed_residual_m.abs(),
                point.signed_residual_m,
                point.map_range_m,
                point.range_m,
                point.first_residual_m,
                point.nearest_residual_m,
                (point.time_s - stamp_s) as f32,
            ];
            bytes.extend_from_slice(lengths.map(f32::to_le_bytes).as_flattened());
            bytes.extend_from_slice(&point.frame.to_le_bytes());
            bytes.extend_from_slice(&[point.kind, u8::from(point.revisited), 0, 0]);
        }
        // What is not predicted is NaN, but every point has its place.
        cloud.close(message, true).map_err(unwritable)?;
        file.write(self.clouds, self.scans, stamp_ns, message.message())?;
        self.scans += 1;
        Ok(())
    }

    pub(super) fn finish(self) -> Result<(), LogError> {
        self.file.finish()
    }
}
