//! Scored returns in every format.

use std::path::Path;

use dmp_log::{ResidualFormat, ResidualHead, ResidualWriter, ScoredPoint, ScoredScan};
use dmp_sensor::{Isometry3, Point3, Scan, Vector3};
use serde_json::{Map, Value, json};

/// What stands beside places, with how it is written in the manifest: null for what is not predicted.
type Field = (&'static str, fn(&ScoredPoint) -> Value);

const FIELDS: [Field; 10] = [
    ("residual_m", |point| json!(point.signed_residual_m.abs())),
    ("signed_residual_m", |point| json!(point.signed_residual_m)),
    ("map_range_m", |point| json!(point.map_range_m)),
    ("range_m", |point| json!(point.range_m)),
    ("first_residual_m", |point| json!(point.first_residual_m)),
    ("nearest_residual_m", |point| json!(point.nearest_residual_m)),
    ("time_s", |point| json!(point.time_s)),
    ("frame", |point| json!(point.frame)),
    ("kind", |point| json!(point.kind)),
    ("revisited", |point| json!(u8::from(point.revisited))),
];

/// A drive far from the origin, as in UTM coordinates.
fn world_from_sensor(scan: usize) -> Isometry3<f64> {
    let step = scan as f64;
    let place = Vector3::new(500_000.0 + 3.0 * step, 4_000_000.0 - step, 20.5);
    Isometry3::new(place, Vector3::new(0.01, -0.02, 0.7 * step))
}

/// Returns of a scan with residuals that differ; every fifth is not predicted.
fn scored(number: usize, scan: &Scan, start_ns: i64) -> Vec<ScoredPoint> {
    let stamp_s = (scan.stamp_ns.unwrap_or_default() - start_ns) as f64 / 1e9;
    let point = |(k, place): (usize, &[f32; 3])| {
        let place = Point3::from(place.map(f64::from));
        let residual_m = if k.is_multiple_of(5) { f32::NAN } else { 0.37 * (k % 17) as f32 - 3.1 };
        ScoredPoint {
            point_in_world_m: (world_from_sensor(number) * place).coords.into(),
            signed_residual_m: residual_m,
            map_range_m: place.coords.norm() as f32 - residual_m,
            range_m: place.coords.norm() as f32,
            first_residual_m: 1.25 * residual_m,
            nearest_residual_m: 0.1 * residual_m,
            time_s: stamp_s + scan.time_offsets_ns.get(k).copied().unwrap_or_default() as f64 / 1e9,
            frame: 70_000 + number as i32,
            kind: (k % 4) as u8,
            revisited: k.is_multiple_of(3),
        }
    };
    scan.points_in_sensor_m.iter().enumerate().map(point).collect()
}

fn fields_of(points: &[ScoredPoint], prefix: &str) -> Map<String, Value> {
    let column = |(name, value): &Field| {
        (format!("{prefix}{name}"), points.iter().map(value).collect::<Vec<_>>().into())
    };
    FIELDS.iter().map(column).collect()
}

/// Writes the returns in every format; what is in the files, for the manifest.
pub(super) fn write(folder: &Path, scans: &[Scan]) -> anyhow::Result<Vec<Value>> {
    let start_ns = scans.first().and_then(|scan| scan.stamp_ns).unwrap_or_default();
    let of_scans: Vec<Vec<ScoredPoint>> =
        scans.iter().enumerate().map(|(number, scan)| scored(number, scan, start_ns)).collect();
    let all = of_scans.concat();
    let near_m = all.first().map_or([0.0; 3], |point| point.point_in_world_m);
    let head = ResidualHead { run: "slam", points: all.len() as u64, near_m, start_ns: Some(start_ns) };
    let mut files = Vec::new();
    for (extension, prefix, tolerance_m) in [
        ("ply", "scalar_", 0.0),
        ("pcd", "", 0.0),
        ("las", "", 0.501e-4),
        ("laz", "", 0.501e-4),
        ("mcap", "", 2e-5),
    ] {
        let name = format!("residuals.{extension}");
        let format = ResidualFormat::of_extension(extension)
            .ok_or_else(|| anyhow::anyhow!("{extension} is a format of scored returns"))?;
        let mut writer = ResidualWriter::create(&folder.join(&name), format, &head)?;
        for (number, (scan, points)) in scans.iter().zip(&of_scans).enumerate() {
            let head = ScoredScan { stamp_ns: scan.stamp_ns, world_from_sensor: world_from_sensor(number) };
            writer.write_scan(&head, points)?;
        }
        writer.finish()?;
        if format == ResidualFormat::Mcap {
            files.extend(played(&name, scans, &of_scans, tolerance_m));
            continue;
        }
        let places: Vec<[f64; 3]> = all.iter().map(|point| point.point_in_world_m).collect();
        let clock_s: Vec<f64> = all.iter().map(|point| start_ns as f64 / 1e9 + point.time_s).collect();
        let time = extension.starts_with("la").then(|| json!({ "name": "gps_time", "values": clock_s }));
        files.push(json!({ "path": name, "kind": extension, "points": places, "time": time,
                           "tolerance_m": tolerance_m, "fields": fields_of(&all, prefix) }));
    }
    Ok(files)
}

/// The topics of an MCAP file: scans in the frame of the sensor, and its poses.
fn played(name: &str, scans: &[Scan], of_scans: &[Vec<ScoredPoint>], tolerance_m: f64) -> [Value; 2] {
    let scan = |(scan, points): (&Scan, &Vec<ScoredPoint>)| {
        let mut fields = fields_of(points, "");
        fields.remove("time_s");
        let after_s = scan.time_offsets_ns.iter().map(|&ns| (ns as f64 / 1e9) as f32);
        fields.insert("after_stamp_s".into(), after_s.collect::<Vec<_>>().into());
        json!({ "stamp_ns": scan.stamp_ns, "points": scan.points_in_sensor_m, "fields": fields })
    };
    let clouds: Vec<Value> = scans.iter().zip(of_scans).map(scan).collect();
    let pose = |number: usize| {
        let pose = world_from_sensor(number);
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
    };
    let poses: Vec<[f64; 7]> = (0..scans.len()).map(pose).collect();
    let stamps_ns: Vec<Option<i64>> = scans.iter().map(|scan| scan.stamp_ns).collect();
    [
        json!({ "path": name, "kind": "mcap", "topic": "/slam/residuals", "time_field": null, "scans": clouds,
                "tolerance_m": tolerance_m }),
        json!({ "path": name, "kind": "mcap", "topic": "/tf", "poses": poses, "stamps_ns": stamps_ns }),
    ]
}
