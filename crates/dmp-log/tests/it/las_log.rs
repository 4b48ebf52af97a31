//! One LAS or LAZ file in world coordinates, with the trajectory it was made with.

use crate::common::{assert_says, open, read_all};
use dmp_log::{
    LogError, LogFormat, LogOptions, MadeWith, PointTime, ScanLog, StampAt, open_log, read_trajectory,
};
use dmp_sensor::{Isometry3, Point3, Scan, Track, Trajectory, Vector3};
use std::path::{Path, PathBuf};

/// UTC less the time of LAS, seconds: 1980-01-06, 18 leap seconds, and what LAS takes off.
const UTC_FROM_STANDARD_S: i64 = 1_315_964_782;

/// A point of the world: time after the drive's clock, nanoseconds, and place.
pub(crate) type WorldPoint = (i64, Point3<f64>);

/// A LAS file: point format, version's minor number, scale of coordinates in metres and what is written.
pub(crate) struct WorldFile<'a> {
    pub(crate) format: u8,
    pub(crate) standard_time: bool,
    /// Metres of a unit of the file.
    pub(crate) unit_m: f64,
    pub(crate) points: &'a [(f64, Point3<f64>)],
}

pub(crate) const SCALE_M: f64 = 0.001;

impl WorldFile<'_> {
    pub(crate) fn write(&self, path: &Path) {
        let mut builder = las::Builder::from((1, 4));
        builder.point_format = las::point::Format::new(self.format).unwrap();
        if self.standard_time {
            builder.gps_time_type = las::GpsTimeType::Standard;
        }
        if self.unit_m != 1.0 {
            // GeoTIFF keys: key 3076, the unit of a projection, is EPSG 9002.
            let keys: [u16; 8] = [1, 1, 0, 1, 3076, 0, 1, 9002];
            builder.vlrs.push(las::Vlr {
                user_id: "LASF_Projection".into(),
                record_id: 34_735,
                description: String::new(),
                data: keys.iter().flat_map(|word| word.to_le_bytes()).collect(),
            });
        }
        let transform =
            |offset_m: f64| las::Transform { scale: SCALE_M, offset: (offset_m / self.unit_m).round() };
        builder.transforms =
            las::Vector { x: transform(500_000.0), y: transform(4_000_000.0), z: transform(0.0) };
        let mut writer = las::Writer::from_path(path, builder.into_header().unwrap()).unwrap();
        for (time_s, place) in self.points {
            let [x, y, z] = [place.x, place.y, place.z].map(|c| c / self.unit_m);
            let gps_time = writer.header().point_format().has_gps_time.then_some(*time_s);
            writer.write_point(las::Point { x, y, z, gps_time, ..las::Point::default() }).unwrap();
        }
        writer.close().unwrap();
    }
}

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data-samples").join(name)
}

/// Far from the world's origin, as maps are.
fn utm_from_town() -> Isometry3<f64> {
    Isometry3::translation(500_000.0, 4_000_000.0, 100.0)
}

fn body_from_sensor() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.5, -0.25, 1.5), Vector3::new(0.1, -0.2, 0.7))
}

/// The drive of the samples: its returns with their times, in the sensor's frame, and the body's way.
pub(crate) struct Drive {
    /// Nanoseconds of the log's clock, in order.
    returns: Vec<(i64, [f32; 3])>,
    trajectory: Trajectory,
}

impl Drive {
    pub(crate) fn new(scans: usize) -> Self {
        let log = open(&sample("town.mcap"));
        let truth = read_trajectory(&sample("truth.tum")).unwrap().trajectory;
        let stamps = truth.stamps_ns().unwrap().iter();
        // The samples' poses are the sensor's.
        let poses = truth.poses().iter().map(|pose| utm_from_town() * pose * body_from_sensor().inverse());
        let trajectory = Trajectory::stamped(stamps.copied().zip(poses).collect()).unwrap().trajectory;
        let mut returns = Vec::new();
        for scan in read_all(&*log).into_iter().take(scans) {
            let stamp_ns = scan.stamp_ns.unwrap();
            for (point, offset_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
                if point.iter().all(|c| c.is_finite()) && *point != [0.0; 3] {
                    returns.push((stamp_ns + offset_ns, *point));
                }
            }
        }
        returns.sort_by_key(|r| r.0);
        Self { returns, trajectory }
    }

    pub(crate) fn in_world(&self) -> Vec<WorldPoint> {
        let track = Track::new(&self.trajectory, body_from_sensor(), 1_000_000_000);
        let place = |&(time_ns, point): &(i64, [f32; 3])| {
            let pose = track.world_from_sensor_at(time_ns)?;
            Some((time_ns, pose * Point3::from(point.map(f64::from))))
        };
        self.returns.iter().filter_map(place).collect()
    }

    pub(crate) fn made_with(&self) -> MadeWith {
        MadeWith { body_from_sensor: body_from_sensor(), ..MadeWith::new(self.trajectory.clone()) }
    }
}

fn open_with(path: &Path, made_with: MadeWith) -> Result<Box<dyn ScanLog>, LogError> {
    open_log(path, &LogOptions { made_with: Some(made_with), ..LogOptions::default() })
}

/// Seconds on a clock that is `ahead_s` behind the log's.
pub(crate) fn seconds(points: &[WorldPoint], ahead_s: i64) -> Vec<(f64, Point3<f64>)> {
    points.iter().map(|&(ns, place)| ((ns - ahead_s * 1_000_000_000) as f64 / 1e9, place)).collect()
}

fn flat(scans: &[Scan]) -> Vec<(i64, [f32; 3])> {
    let of_scan = |scan: &Scan| {
        let times = scan.time_offsets_ns.iter().map(|ns| scan.stamp_ns.unwrap() + ns).collect::<Vec<_>>();
        times.into_iter().zip(scan.points_in_sensor_m.clone()).collect::<Vec<_>>()
    };
    scans.iter().flat_map(of_scan).collect()
}

#[test]
fn bearings_and_ranges_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let drive = Drive::new(60);
    let in_world = drive.in_world();
    assert!(in_world.len() > 100_000 && in_world.len() == drive.returns.len());
    for (name, format, unit_m) in [("a.las", 1, 1.0), ("b.laz", 1, 1.0), ("c.laz", 6, 0.3048)] {
        let path = folder.path().join(name);
        let points = seconds(&in_world, UTC_FROM_STANDARD_S);
        WorldFile { format, standard_time: true, unit_m, points: &points }.write(&path);
        let made_with = MadeWith { time_offset_ns: UTC_FROM_STANDARD_S * 1_000_000_000, ..drive.made_with() };
        let log = open_with(&path, made_with).unwrap();
        let summary = log.summary();
        assert_eq!(
            (summary.format, summary.returns, &summary.damage),
            (LogFormat::Las, in_world.len() as u64, &vec![])
        );
        assert_eq!(summary.period_ns, Some(100_000_000));
        assert!(summary.has_point_times());
        let notes = summary.notes.join("; ");
        assert_says(&notes, &["scans of 0.1 s", "GPS seconds less 1e9"]);
        assert_eq!(notes.contains("feet"), unit_m != 1.0, "{notes}");
        let scans = read_all(&*log);
        assert!(scans.iter().flat_map(|scan| &scan.time_offsets_ns).all(|ns| (0..100_000_000).contains(ns)));
        let read = flat(&scans);
        assert_eq!(read.len(), drive.returns.len());
        let mut worst_m = 0.0_f64;
        for ((read_ns, read), (ns, written)) in read.iter().zip(&drive.returns) {
            // A double of seconds keeps 60 ns there.
            assert!((read_ns + UTC_FROM_STANDARD_S * 1_000_000_000 - ns).abs() < 200);
            let apart = (Point3::from(*read) - Point3::from(*written)).norm();
            worst_m = worst_m.max(apart.into());
        }
        println!("{name}: {worst_m} m apart at most");
        // Half a step along each axis, and what a float32 keeps of 100 m.
        assert!(worst_m < SCALE_M * unit_m * 3.0_f64.sqrt() / 2.0 + 5e-5, "{worst_m}");
    }
}

#[test]
fn scans_are_read_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let drive = Drive::new(30);
    let path = folder.path().join("a.laz");
    WorldFile { format: 6, standard_time: true, unit_m: 1.0, points: &seconds(&drive.in_world(), 0) }
        .write(&path);
    let log = open_with(&path, drive.made_with()).unwrap();
    let expected = read_all(&*log);
    let mut reader = log.reader().unwrap();
    let mut scan = Scan::default();
    for k in 0..expected.len() {
        let frame = k * 7 % expected.len();
        reader.read(frame, &mut scan).unwrap();
        assert_eq!(scan, expected[frame]);
    }
    let error = reader.read(expected.len(), &mut scan).unwrap_err().to_string();
    assert_says(&error, &["a.laz", &format!("frame {}", expected.len())]);
    // Longer scans, the same returns.
    let made_with = MadeWith { scan_period_ns: 1_000_000_000, ..drive.made_with() };
    let long = open_with(&path, made_with).unwrap();
    assert_eq!(long.frames().len(), expected.len().div_ceil(10));
    assert_eq!(flat(&read_all(&*long)), flat(&expected));
}

/// A straight drive of 20 s along x at 1 m/s from `start_s` on, and points 5 m beside it, 100 a second.
fn straight(start_s: i64) -> (Trajectory, Vec<WorldPoint>) {
    let at = |s: i64| (start_s + s) * 1_000_000_000;
    let pose = |s: i64| (at(s), Isometry3::translation(500_000.0 + s as f64, 4_000_000.0, 0.0));
    let run = Trajectory::stamped((0..=20).map(pose).collect()).unwrap().trajectory;
    let point = |k: i64| (at(0) + k * 10_000_000, Point3::new(500_000.0 + k as f64 * 0.01, 4_000_005.0, 1.0));
    (run, (0..2000).map(point).collect())
}

fn write(path: &Path, points: &[(f64, Point3<f64>)]) {
    WorldFile { format: 1, standard_time: true, unit_m: 1.0, points }.write(path);
}

#[test]
fn what_is_missing_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.laz");
    let (run, points) = straight(1000);
    write(&path, &seconds(&points, 0));
    let error = open_log(&path, &LogOptions::default()).unwrap_err();
    assert!(error.is_usage());
    assert_says(&error.to_string(), &["world.laz", "`made_with` TRAJECTORY"]);
    let made_with = MadeWith::new(run);
    for (options, what) in [
        (LogOptions { topic: Some("/a".into()), ..LogOptions::default() }, "`topic` /a"),
        (LogOptions { point_time: PointTime::Ignore, ..LogOptions::default() }, "`point_time` ignore"),
        (LogOptions { stamp_at: StampAt::End, ..LogOptions::default() }, "`stamp_at` end"),
    ] {
        let error =
            open_log(&path, &LogOptions { made_with: Some(made_with.clone()), ..options }).unwrap_err();
        assert!(error.is_usage());
        assert_says(&error.to_string(), &[what, "gps_time"]);
    }
    let unstamped = Trajectory::unstamped(vec![Isometry3::identity()]).unwrap();
    assert_says(&open_with(&path, MadeWith::new(unstamped)).unwrap_err().to_string(), &["with stamps"]);
    WorldFile { format: 0, standard_time: true, unit_m: 1.0, points: &seconds(&points, 0) }.write(&path);
    assert_says(&open_with(&path, made_with.clone()).unwrap_err().to_string(), &["no gps_time"]);
    let mcap = open_with(&sample("town.mcap"), made_with).unwrap_err();
    assert_says(&mcap.to_string(), &["`made_with`", "world coordinates"]);
}

#[test]
fn clocks_that_differ_are_recognised() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.laz");
    let utc_s = 1_690_309_709;
    let (run, points) = straight(utc_s);
    write(&path, &seconds(&points, UTC_FROM_STANDARD_S));
    let error = open_with(&path, MadeWith::new(run.clone())).unwrap_err();
    assert!(error.is_usage());
    assert_says(
        &error.to_string(),
        &[
            "374344927.000 to 374344946.990 s",
            "1690309709.000 to 1690309729.000 s",
            "1315964762.010 s apart",
            "UTC",
            "in seconds, `time_offset_ns` 1315964782",
        ],
    );
    let made_with =
        MadeWith { time_offset_ns: UTC_FROM_STANDARD_S * 1_000_000_000, ..MadeWith::new(run.clone()) };
    assert_eq!(open_with(&path, made_with).unwrap().frames().len(), 200);
    // Half an hour off is no clock's.
    write(&path, &seconds(&points, 1800));
    assert_says(
        &open_with(&path, MadeWith::new(run)).unwrap_err().to_string(),
        &["1780.010 s apart", "`time_offset_ns` 1800"],
    );
}

#[test]
fn row_08_points_without_a_pose_or_a_time_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.las");
    let (run, points) = straight(1000);
    // The drive ends at 1020 s; five points come later, two at no time.
    let mut late = seconds(&points, 0);
    late.extend((1..=5).map(|k| (1020.0 + f64::from(k) * 0.01, points[0].1)));
    late.extend([(f64::NAN, points[0].1), (1e300, points[0].1)]);
    write(&path, &late);
    let log = open_with(&path, MadeWith::new(run)).unwrap();
    assert_says(&log.summary().notes.join("; "), &["5 of 2,005 points are at times without a pose"]);
    let [damage] = log.summary().damage.as_slice() else { panic!("{:?}", log.summary().damage) };
    assert_says(&damage.what, &["2 points", "no number"]);
    let points: Vec<_> = flat(&read_all(&*log));
    let without = points.iter().filter(|(_, point)| point.iter().all(|c| c.is_nan())).count();
    assert_eq!((points.len(), without), (2005, 5));
    for (_, [x, y, z]) in &points[..2000] {
        assert!(x.abs() < 0.002 && (y - 5.0).abs() < 0.002 && (z - 1.0).abs() < 0.002);
    }
}

#[test]
fn points_out_of_order_are_read_where_they_nearly_are_and_refused_where_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.laz");
    let (run, points) = straight(1000);
    let sorted = seconds(&points, 0);
    // Two sensors, one after the other every second.
    let mut nearly = sorted.clone();
    for second in nearly.chunks_mut(100) {
        second.sort_by_key(|point| (point.0 * 1000.0).round() as i64 / 10 % 2);
    }
    write(&path, &nearly);
    let log = open_with(&path, MadeWith::new(run.clone())).unwrap();
    let mut read = flat(&read_all(&*log));
    read.sort_by_key(|point| point.0);
    write(&path, &sorted);
    let expected = flat(&read_all(&*open_with(&path, MadeWith::new(run.clone())).unwrap()));
    assert_eq!(read, expected);

    let mut random = crate::common::Random(1);
    let mut mixed: Vec<_> = sorted.iter().map(|point| (random.next(), *point)).collect();
    mixed.sort_by_key(|point| point.0);
    write(&path, &mixed.iter().map(|point| point.1).collect::<Vec<_>>());
    let error = open_with(&path, MadeWith::new(run)).unwrap_err().to_string();
    assert_says(&error, &["world.laz", "not in order of time", "sort the file by gps_time"]);
}

#[test]
fn row_02_a_broken_chunk_costs_its_own_points() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.laz");
    let (run, few) = straight(1000);
    // Three chunks of 50,000 points over 20 s; places that do not repeat, so that damage shows.
    let mut random = crate::common::Random(3);
    let mut noise = || (random.next() % 100_000) as f64 / 1000.0;
    let point = |k: usize| (1000.0 + k as f64 * 1e-4, few[0].1 + Vector3::new(noise(), noise(), noise()));
    let points: Vec<_> = (0..150_000).map(point).collect();
    WorldFile { format: 6, standard_time: true, unit_m: 1.0, points: &points }.write(&path);
    let whole = flat(&read_all(&*open_with(&path, MadeWith::new(run.clone())).unwrap()));
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    // Within the second chunk's first layers.
    let noise: Vec<u8> = bytes[middle - 100_000..middle].iter().map(|byte| byte ^ 0x5a).collect();
    bytes[middle - 100_000..middle].copy_from_slice(&noise);
    std::fs::write(&path, bytes).unwrap();
    let log = open_with(&path, MadeWith::new(run)).unwrap();
    let [damage] = log.summary().damage.as_slice() else { panic!("{:?}", log.summary().damage) };
    assert_says(&damage.place, &["point 50000"]);
    assert_says(&damage.what, &["50,000 points are lost"]);
    // A scan with points on both sides of the hole is read around it.
    let read = flat(&read_all(&*log));
    assert_eq!(read[..], [&whole[..50_000], &whole[100_000..]].concat());
}
