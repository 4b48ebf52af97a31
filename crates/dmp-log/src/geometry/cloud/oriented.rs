//! Point clouds with normals, written.

use std::path::Path;

use super::format::CloudFormat;
use super::table::{Column, Number, Table, TableWriter};
use super::wkt::MetricCrs;
use crate::LogError;

const NORMAL: [Column; 3] = [
    Column { names: ["nx", "normal_x", "NormalX"], number: Number::F32, about: "unit normal" },
    Column { names: ["ny", "normal_y", "NormalY"], number: Number::F32, about: "unit normal" },
    Column { names: ["nz", "normal_z", "NormalZ"], number: Number::F32, about: "unit normal" },
];

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
pub struct CloudWriter(TableWriter);

impl CloudWriter {
    /// A cloud of `points` points, the first of them near `near_m`; LAS and LAZ name the coordinate system.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn create(
        path: &Path,
        format: CloudFormat,
        points: u64,
        near_m: [f64; 3],
        crs: Option<&MetricCrs>,
    ) -> Result<Self, LogError> {
        let table = Table { format, columns: &NORMAL, points, near_m, comment: "dmp", crs };
        TableWriter::create(path, &table).map(Self)
    }

    /// Writes the next point.
    ///
    /// # Errors
    /// When it cannot be written, or lies too far from the first for a LAS file.
    pub fn write(&mut self, point: &OrientedPoint) -> Result<(), LogError> {
        self.0.write(point.point_m, 0.0, point.normal.map(f32::to_le_bytes).as_flattened())
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// When the end cannot be written, or there were not as many points as promised.
    pub fn finish(self) -> Result<(), LogError> {
        self.0.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_cloud;
    use las::Point;

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
            let mut writer = CloudWriter::create(&path, format, 1000, points[0].point_m, None).unwrap();
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
        assert_eq!(point.extra_bytes, [0.0_f32, 0.6, 0.8].map(f32::to_le_bytes).as_flattened());
    }

    #[test]
    fn a_wrong_count_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.laz");
        let mut writer = CloudWriter::create(&path, CloudFormat::Laz, 2, [0.0; 3], None).unwrap();
        let point = OrientedPoint { point_m: [0.0; 3], normal: [0.0, 0.0, 1.0] };
        writer.write(&point).unwrap();
        let far = OrientedPoint { point_m: [0.0, 300_000.0, 0.0], ..point };
        assert!(writer.write(&far).unwrap_err().to_string().contains("300000 m is too far"));
        assert!(CloudWriter::create(&path, CloudFormat::Ply, 2, [0.0; 3], None).unwrap().finish().is_err());
        drop(writer);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
