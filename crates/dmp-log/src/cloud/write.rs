//! Point clouds with normals, written.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use las::point::Format;
use las::{Builder, Point, Transform, Vector, Vlr};

use super::CloudFormat;
use crate::LogError;
use crate::atomic::Pending;

/// Metres of a step in LAS and LAZ. 32 bits of it reach 214 km from the first point.
const STEP_M: f64 = 1e-4;
/// The smallest of LAS 1.4 that LAZ keeps in layers.
const POINT_FORMAT: u8 = 6;
/// "float" among the types of extra bytes (LAS 1.4 R15, table 24).
const EXTRA_FLOAT: u8 = 9;
const NORMAL_BYTES: usize = 12;

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedPoint {
    /// Its place, metres.
    pub point_m: [f64; 3],
    /// Unit normal.
    pub normal: [f32; 3],
}

/// Writes a cloud with normals, point by point: binary PLY and PCD with float64 places, LAS and LAZ 1.4 with steps of
/// 0.1 mm and the normals as extra bytes. The file gets its name in [`CloudWriter::finish`]; without it nothing is left
/// behind.
#[derive(Debug)]
pub struct CloudWriter {
    pending: Pending,
    out: Kind,
    told: u64,
    written: u64,
}

enum Kind {
    Rows(BufWriter<File>),
    Las { writer: Box<las::Writer<Recording>>, failure: Failure, offset_m: [f64; 3] },
}

impl std::fmt::Debug for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Rows(_) => "Rows",
            Self::Las { .. } => "Las",
        })
    }
}

impl CloudWriter {
    /// A cloud of `points` points, the first of them near `near_m`.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn create(path: &Path, format: CloudFormat, points: u64, near_m: [f64; 3]) -> Result<Self, LogError> {
        let (pending, file) = Pending::file(path)?;
        let mut file = BufWriter::new(file);
        let write = |e| LogError::io(path, "write", e);
        let out = match format {
            CloudFormat::Ply => {
                write!(
                    file,
                    "ply\nformat binary_little_endian 1.0\ncomment dmp\nelement vertex {points}\n\
                     property double x\nproperty double y\nproperty double z\n\
                     property float nx\nproperty float ny\nproperty float nz\nend_header\n"
                )
                .map_err(write)?;
                Kind::Rows(file)
            }
            CloudFormat::Pcd => {
                write!(
                    file,
                    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z normal_x normal_y normal_z\nSIZE 8 8 8 4 4 4\n\
                     TYPE F F F F F F\nCOUNT 1 1 1 1 1 1\nWIDTH {points}\nHEIGHT 1\n\
                     VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary\n"
                )
                .map_err(write)?;
                Kind::Rows(file)
            }
            CloudFormat::Las | CloudFormat::Laz => {
                let failure = Failure::default();
                let offset_m = near_m.map(f64::floor);
                let recording = Recording { file, failure: Arc::clone(&failure) };
                let made = las_writer(recording, format == CloudFormat::Laz, offset_m);
                let writer =
                    made.map_err(|e| LogError::io(path, "write", io::Error::other(e.to_string())))?;
                Kind::Las { writer: Box::new(writer), failure, offset_m }
            }
        };
        Ok(Self { pending, out, told: points, written: 0 })
    }

    /// Writes the next point.
    ///
    /// # Errors
    /// When it cannot be written, or lies too far from the first for a LAS file.
    pub fn write(&mut self, point: &OrientedPoint) -> Result<(), LogError> {
        let OrientedPoint { point_m, normal } = point;
        self.written += 1;
        let written = match &mut self.out {
            Kind::Rows(file) => {
                let mut row = [0; 24 + NORMAL_BYTES];
                for (place, number) in row.chunks_exact_mut(8).zip(point_m) {
                    place.copy_from_slice(&number.to_le_bytes());
                }
                row[24..].copy_from_slice(&normal_bytes(*normal));
                file.write_all(&row)
            }
            Kind::Las { writer, failure, offset_m } => {
                let [x, y, z] = *point_m;
                let reach_m = STEP_M * f64::from(i32::MAX);
                if let Some(k) = (0..3).find(|&k| (point_m[k] - offset_m[k]).abs() > reach_m) {
                    let problem =
                        format!("a coordinate of {} m is too far from the first point for LAS", point_m[k]);
                    return Err(LogError::Option { path: self.pending.target().into(), problem });
                }
                let extra_bytes = normal_bytes(*normal).to_vec();
                let place = Point {
                    x,
                    y,
                    z,
                    return_number: 1,
                    number_of_returns: 1,
                    gps_time: Some(0.0),
                    extra_bytes,
                    ..Point::default()
                };
                writer.write_point(place).map_err(|e| io::Error::other(e.to_string())).and(first(failure))
            }
        };
        written.map_err(|e| LogError::io(self.pending.target(), "write", e))
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// When the end cannot be written, or there were not as many points as told.
    pub fn finish(self) -> Result<(), LogError> {
        let Self { pending, out, told, written } = self;
        let io = |e| LogError::io(pending.target(), "write", e);
        if told != written {
            return Err(io(io::Error::other(format!("{written} points were given, {told} were told"))));
        }
        let file = match out {
            Kind::Rows(file) => file,
            Kind::Las { mut writer, failure, .. } => {
                let closed = writer.close().map_err(|e| io::Error::other(e.to_string()));
                closed.and(first(&failure)).map_err(io)?;
                let inner = writer.into_inner().map_err(|e| io(io::Error::other(e.to_string())))?;
                inner.file
            }
        };
        let file = file.into_inner().map_err(|e| io(e.into_error()))?;
        file.sync_all().map_err(io)?;
        pending.commit()
    }
}

fn normal_bytes(normal: [f32; 3]) -> [u8; NORMAL_BYTES] {
    let mut bytes = [0; NORMAL_BYTES];
    for (place, number) in bytes.chunks_exact_mut(4).zip(normal) {
        place.copy_from_slice(&number.to_le_bytes());
    }
    bytes
}

fn las_writer(
    out: Recording,
    is_compressed: bool,
    offset_m: [f64; 3],
) -> las::Result<las::Writer<Recording>> {
    let mut builder = Builder::from((1, 4));
    builder.point_format = Format::new(POINT_FORMAT)?;
    builder.point_format.is_compressed = is_compressed;
    builder.point_format.extra_bytes = NORMAL_BYTES as u16;
    builder.generating_software = "dmp".into();
    // Files that are made again are the same.
    builder.date = None;
    let axis = |offset: f64| Transform { scale: STEP_M, offset };
    builder.transforms = Vector { x: axis(offset_m[0]), y: axis(offset_m[1]), z: axis(offset_m[2]) };
    // Extra bytes (LAS 1.4 R15, section 2.7.6): 192 bytes each, type at 2, name at 4, description at 160.
    let mut data = Vec::new();
    for name in ["NormalX", "NormalY", "NormalZ"] {
        let mut record = [0; 192];
        record[2] = EXTRA_FLOAT;
        record[4..4 + name.len()].copy_from_slice(name.as_bytes());
        record[160..160 + 11].copy_from_slice(b"unit normal");
        data.extend(record);
    }
    builder.vlrs.push(Vlr { user_id: "LASF_Spec".into(), record_id: 4, description: "normals".into(), data });
    las::Writer::new(out, builder.into_header()?)
}

type Failure = Arc<Mutex<Option<io::Error>>>;

fn first(failure: &Failure) -> io::Result<()> {
    failure.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
}

/// A file whose failures are remembered instead of told: the LAS writer panics over those that it meets on its way out.
struct Recording {
    file: BufWriter<File>,
    failure: Failure,
}

impl Recording {
    fn record<T>(&self, result: io::Result<T>, instead: T) -> T {
        result.unwrap_or_else(|error| {
            self.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            instead
        })
    }
}

impl Write for Recording {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let result = self.file.write_all(bytes).map(|()| bytes.len());
        Ok(self.record(result, bytes.len()))
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.file.flush();
        self.record(result, ());
        Ok(())
    }
}

impl Seek for Recording {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let result = self.file.seek(to);
        Ok(self.record(result, 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_cloud;

    fn points() -> Vec<OrientedPoint> {
        let place = |k: f64| [500_000.0 + k * 0.25, 4_000_000.0 - k, 100.0 + 0.5 * k];
        (0..1000).map(|k| OrientedPoint { point_m: place(f64::from(k)), normal: [0.0, 0.6, 0.8] }).collect()
    }

    #[test]
    fn every_format_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        for (name, format) in [
            ("a.ply", CloudFormat::Ply),
            ("a.pcd", CloudFormat::Pcd),
            ("a.las", CloudFormat::Las),
            ("a.laz", CloudFormat::Laz),
        ] {
            let path = folder.path().join(name);
            let points = points();
            let mut writer = CloudWriter::create(&path, format, 1000, points[0].point_m).unwrap();
            points.iter().for_each(|point| writer.write(point).unwrap());
            writer.finish().unwrap();
            let mut read = Vec::new();
            let sink = |batch: &[[f64; 3]]| {
                read.extend_from_slice(batch);
                Ok::<(), LogError>(())
            };
            let summary = read_cloud(&path, None, sink).unwrap();
            assert_eq!((summary.format, summary.points), (format, 1000));
            for (read, written) in read.iter().zip(&points) {
                let apart = (0..3).map(|k| (read[k] - written.point_m[k]).abs()).fold(0.0, f64::max);
                assert!(apart < 1e-6, "{name}: {apart}");
            }
        }
        let mut las = las::Reader::from_path(folder.path().join("a.laz")).unwrap();
        let read = las.read_points(1).unwrap();
        let point: Point = read.points().next().unwrap().unwrap();
        assert_eq!(point.extra_bytes, normal_bytes([0.0, 0.6, 0.8]));
    }

    #[test]
    fn what_was_told_wrong_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.laz");
        let mut writer = CloudWriter::create(&path, CloudFormat::Laz, 2, [0.0; 3]).unwrap();
        let point = OrientedPoint { point_m: [0.0; 3], normal: [0.0, 0.0, 1.0] };
        writer.write(&point).unwrap();
        let far = OrientedPoint { point_m: [0.0, 300_000.0, 0.0], ..point };
        assert!(writer.write(&far).unwrap_err().to_string().contains("300000 m is too far"));
        assert!(CloudWriter::create(&path, CloudFormat::Ply, 2, [0.0; 3]).unwrap().finish().is_err());
        drop(writer);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
