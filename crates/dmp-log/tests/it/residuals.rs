//! Scored returns, read back.

use std::path::Path;

use dmp_log::{
    LogError, LogOptions, PoseTopic, ResidualFormat, ResidualHead, ResidualWriter, ScoredPoint, ScoredScan,
    open_log, read_cloud, read_topic_trajectory,
};
use dmp_sensor::{Isometry3, Point3, Scan, Vector3};

const START_NS: i64 = 1_700_000_000_123_456_789;
const SCANS: u32 = 3;

fn pose(scan: u32) -> Isometry3<f64> {
    let step = f64::from(scan);
    Isometry3::new(
        Vector3::new(500_000.0 + 3.0 * step, 4e6 - step, 20.5),
        Vector3::new(0.02, -0.1, 0.7 * step),
    )
}

/// The returns of a scan: some are not predicted.
fn points(scan: u32) -> Vec<ScoredPoint> {
    let point = |k: u32| {
        let place = Point3::new(5.0 + f64::from(k), -0.25 * f64::from(k), 0.125);
        let predicted = !k.is_multiple_of(5);
        let residual_m = if predicted { 0.01 * k as f32 - 1.0 } else { f32::NAN };
        ScoredPoint {
            point_in_world_m: (pose(scan) * place).coords.into(),
            signed_residual_m: residual_m,
            map_range_m: place.coords.norm() as f32 - residual_m,
            range_m: place.coords.norm() as f32,
            first_residual_m: 2.0,
            nearest_residual_m: residual_m,
            time_s: 0.1 * f64::from(scan) + 1e-4 * f64::from(k),
            frame: 100_000 + scan as i32,
            kind: (k % 4) as u8,
            revisited: k.is_multiple_of(7),
        }
    };
    (0..20 * scan + 40).map(point).collect()
}

fn stamp_ns(scan: u32) -> i64 {
    START_NS + 100_000_000 * i64::from(scan)
}

fn write(path: &Path, promised: u64) -> Result<(), LogError> {
    let format = ResidualFormat::of_extension(path.extension().unwrap().to_str().unwrap()).unwrap();
    let near_m = points(0)[0].point_in_world_m;
    let head = ResidualHead { run: "slam", points: promised, near_m, start_ns: Some(START_NS) };
    let mut writer = ResidualWriter::create(path, format, &head)?;
    for scan in 0..SCANS {
        let head = ScoredScan { stamp_ns: Some(stamp_ns(scan)), world_from_sensor: pose(scan) };
        writer.write_scan(&head, &points(scan))?;
    }
    writer.finish()
}

fn all_points() -> Vec<ScoredPoint> {
    (0..SCANS).flat_map(points).collect()
}

#[test]
fn clouds_hold_every_place() {
    let folder = tempfile::tempdir().unwrap();
    let expected = all_points();
    for (extension, step_m) in [("ply", 0.0), ("pcd", 0.0), ("las", 0.501e-4), ("LAZ", 0.501e-4)] {
        let path = folder.path().join("residuals").with_extension(extension);
        write(&path, expected.len() as u64).unwrap();
        let mut read = Vec::new();
        let sink = |batch: &[[f64; 3]]| {
            read.extend_from_slice(batch);
            Ok::<(), LogError>(())
        };
        read_cloud(&path, None, sink).unwrap();
        assert_eq!(read.len(), expected.len(), "{extension}");
        for (read, point) in read.iter().zip(&expected) {
            let apart = (0..3).map(|k| (read[k] - point.point_in_world_m[k]).abs()).fold(0.0, f64::max);
            assert!(apart <= step_m, "{extension}: {apart}");
        }
    }
}

#[test]
fn las_has_every_column_as_extra_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for extension in ["las", "laz"] {
        let path = folder.path().join("residuals").with_extension(extension);
        write(&path, all_points().len() as u64).unwrap();
        let mut reader = las::Reader::from_path(&path).unwrap();
        let records = reader.read_all().unwrap();
        let records: Vec<las::Point> = records.points().map(Result::unwrap).collect();
        assert_eq!(records.len(), all_points().len());
        for (record, point) in records.iter().zip(all_points()) {
            assert_eq!(record.extra_bytes, point.to_bytes()[24..]);
            let gps_time_s = record.gps_time.unwrap();
            assert!((gps_time_s - (START_NS as f64 / 1e9 + point.time_s)).abs() < 1e-6);
            assert_eq!((record.return_number, record.number_of_returns), (1, 1));
        }
        let vlrs = reader.header().vlrs();
        let described = vlrs.iter().find(|vlr| vlr.user_id == "LASF_Spec" && vlr.record_id == 4).unwrap();
        let names: Vec<String> = described
            .data
            .chunks(192)
            .map(|record| String::from_utf8_lossy(&record[4..36]).trim_end_matches('\0').to_owned())
            .collect();
        let expected = "residual_m signed_residual_m map_range_m range_m first_residual_m nearest_residual_m time_s \
                        frame kind revisited";
        assert_eq!(names.join(" "), expected);
    }
}

#[test]
fn mcap_plays_scans_in_the_frame_of_a_sensor_that_moves() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("residuals.mcap");
    // A log of scans need not know how many points there will be.
    write(&path, 0).unwrap();
    let log = open_log(&path, &LogOptions::default()).unwrap();
    assert_eq!(log.summary().topic.as_deref(), Some("/slam/residuals"));
    assert_eq!(log.summary().point_times, None, "brought to the stamp, a scan is one instant");
    assert_eq!(log.frames().len(), SCANS as usize);
    let topic = PoseTopic { topic: Some("/tf".into()), world: Some("map".into()), body: Some("slam".into()) };
    let run = read_topic_trajectory(&path, &topic, None).unwrap().trajectory;
    let mut reader = log.reader().unwrap();
    let mut scan = Scan::default();
    for number in 0..SCANS {
        reader.read(number as usize, &mut scan).unwrap();
        assert_eq!(scan.stamp_ns, Some(stamp_ns(number)));
        assert_eq!(scan.len(), points(number).len());
        let world_from_sensor = run.world_from_body_at(stamp_ns(number), 1).unwrap();
        for (place, point) in scan.points_in_sensor_m.iter().zip(points(number)) {
            let in_world = world_from_sensor * Point3::from(place.map(f64::from));
            let apart_m = (in_world.coords - Vector3::from(point.point_in_world_m)).norm();
            assert!(apart_m < 1e-5, "{apart_m}");
        }
    }
}

#[test]
fn what_cannot_be_said_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["wrong.ply", "wrong.laz"] {
        assert!(write(&folder.path().join(name), 7).unwrap_err().to_string().contains("7 were promised"));
    }
    let head = ResidualHead { run: "slam", points: 1, near_m: [0.0; 3], start_ns: None };
    let scan = ScoredScan { stamp_ns: None, world_from_sensor: Isometry3::identity() };
    for (name, words) in [("a.mcap", "needs a stamp"), ("a.las", "too far from the first point")] {
        let format = ResidualFormat::of_extension(&name[2..]).unwrap();
        let mut writer = ResidualWriter::create(&folder.path().join(name), format, &head).unwrap();
        let error = writer.write_scan(&scan, &points(0)[..1]).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
