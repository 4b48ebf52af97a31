//! Triangle meshes given as maps: what is cast into the surfels of their samples, against the triangles.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use dmp::{Config, Ego, MapSource, Residuals, Run, ScoredReturns, Sink, Watch, evaluate};
use dmp_sensor::{Isometry3, Scan, Trajectory};
use nalgebra::Vector3;

use crate::common::{has, open, plain, small_town, write_mcap};

type Triangle = [[f64; 3]; 3];
const VOXEL_M: f64 = 0.2;

/// Two triangles for each face of a room or a house.
fn cuboid(low: [f64; 3], high: [f64; 3]) -> Vec<Triangle> {
    let corner =
        |k: usize| std::array::from_fn(|axis| if k >> axis & 1 == 0 { low[axis] } else { high[axis] });
    let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).map(|t| t.map(corner)).collect()
}

fn write_obj(path: &Path, triangles: &[Triangle]) {
    let mut text = String::new();
    for [x, y, z] in triangles.iter().flatten() {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for k in 0..triangles.len() {
        writeln!(text, "f {} {} {}", 3 * k + 1, 3 * k + 2, 3 * k + 3).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

fn small_log(folder: &Path) -> (PathBuf, Trajectory) {
    let path = folder.join("town.mcap");
    let (scans, truth) = small_town(10, 60);
    write_mcap(&path, &scans);
    (path, truth)
}

/// The first triangle along a ray: its range and the cosine of the incidence (Möller & Trumbore 1997).
fn first_triangle(
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    triangles: &[Triangle],
) -> Option<(f64, f64)> {
    let hit = |triangle: &Triangle| {
        let [a, b, c] = triangle.map(Vector3::from);
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(&ac);
        let determinant = ab.dot(&p);
        let (from, q) = (origin - a, (origin - a).cross(&ab));
        let (u, v) = (from.dot(&p) / determinant, direction.dot(&q) / determinant);
        let range_m = ac.dot(&q) / determinant;
        let inside = u >= -1e-12 && v >= -1e-12 && u + v <= 1.0 + 1e-12 && range_m > 0.0;
        let cos = ab.cross(&ac).normalize().dot(&direction).abs();
        (determinant.abs() > 1e-12 && inside).then_some((range_m, cos))
    };
    triangles.iter().filter_map(hit).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Directions spread over the sphere.
fn directions(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
        let (around, flat) = (2.399_963 * k as f64, (1.0 - z * z).sqrt());
        Vector3::new(flat * around.cos(), flat * around.sin(), z)
    })
}

/// Keeps the residuals of a scan in its order.
struct Seen(Mutex<Vec<Residuals>>);

impl Sink for Seen {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        self.0.lock().unwrap().extend_from_slice(returns.runs[0].unwrap().residuals);
    }
}

/// Off the plane of the mesh where the caster is, metres, for rays that meet it at `clear_m` or more of any
/// edge of the shape and not too flat; and the share of those rays that hit nothing.
fn errors_of(
    triangles: &[Triangle],
    origin: [f64; 3],
    clear: impl Fn(Vector3<f64>) -> bool,
) -> (Vec<f64>, f64) {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("room.obj");
    write_obj(&map, triangles);
    // A sensor that stands still and measures the triangles themselves.
    let origin = Vector3::from(origin);
    let (mut points, mut cosines) = (Vec::new(), Vec::new());
    for direction in directions(20_000) {
        let Some((range_m, cos)) = first_triangle(origin, direction, triangles) else { continue };
        if cos > 0.2 && clear(origin + direction * range_m) {
            points.push((direction * range_m).map(|c| c as f32).into());
            cosines.push(cos);
        }
    }
    let log = folder.path().join("still.mcap");
    let scan = Scan { stamp_ns: Some(0), points_in_sensor_m: points, time_offsets_ns: Vec::new() };
    write_mcap(&log, &[scan]);
    let pose = Isometry3::translation(origin.x, origin.y, origin.z);
    let still = Trajectory::stamped(vec![(-1, pose), (1, pose)]).unwrap().trajectory;
    let runs = [Run { map: MapSource::Given(map), ..Run::new("given", still) }];
    let config = Config { voxel_m: Some(VOXEL_M), ego: Ego::None, ..plain() };
    let residuals = Seen(Mutex::new(Vec::new()));
    evaluate(open(&log).as_ref(), &runs, &config, Watch::sink(&residuals)).unwrap();
    let residuals = residuals.0.into_inner().unwrap();
    assert_eq!(residuals.len(), cosines.len());
    let mut errors: Vec<f64> = residuals
        .iter()
        .zip(&cosines)
        .filter_map(|(residual, cos)| Some(residual.first_m?.abs() * cos))
        .collect();
    let missed = 1.0 - errors.len() as f64 / cosines.len() as f64;
    errors.sort_by(f64::total_cmp);
    (errors, missed)
}

/// Whether a place is a cell's edge or more from all planes of a box but the one it is on.
fn off_edges(place: Vector3<f64>, low: [f64; 3], high: [f64; 3], clear_m: f64) -> bool {
    let near = (0..3).filter(|&k| (place[k] - low[k]).min(high[k] - place[k]).abs() < clear_m);
    near.count() == 1
}

#[test]
fn rays_into_a_sampled_mesh_stop_where_its_triangles_are() {
    // A room whose walls are not on the voxels' borders.
    let (low, high) = ([-7.33, -4.71, -1.57], [8.13, 5.29, 3.41]);
    let (errors, missed) =
        errors_of(&cuboid(low, high), [0.3, 0.2, 0.1], |p| off_edges(p, low, high, 4.0 * VOXEL_M));
    assert!(missed == 0.0 && *errors.last().unwrap() < 1e-3);
    // Near an edge the map is what a fused one is there too: a voxel on the edge mixes both sides.
    let (errors, missed) =
        errors_of(&cuboid(low, high), [0.3, 0.2, 0.1], |p| !off_edges(p, low, high, 2.0 * VOXEL_M));
    let within = errors.iter().filter(|e| **e < 0.5 * VOXEL_M).count() as f64 / errors.len() as f64;
    assert!(missed < 0.01 && within > 0.95);
}

#[test]
fn row_03_a_triangle_beyond_reason_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (log, truth) = small_log(folder.path());
    let map = folder.path().join("huge.obj");
    let mut triangles = cuboid([-5.0; 3], [5.0; 3]);
    triangles.push([[0.0; 3], [1e7, 0.0, 0.0], [0.0, 1e7, 0.0]]);
    let fail = |triangles: &[Triangle]| {
        write_obj(&map, triangles);
        let runs = [Run { map: MapSource::Given(map.clone()), ..Run::new("given", truth.clone()) }];
        let error = evaluate(open(&log).as_ref(), &runs, &plain(), ()).unwrap_err();
        let chain = std::iter::successors(Some(&error as &dyn std::error::Error), |cause| cause.source());
        chain.map(ToString::to_string).collect::<Vec<_>>().join(": ")
    };
    has(&fail(&triangles), &["run `given`: triangle 12 (from 0)", "an edge of 1.414e7 m"]);
    // A sliver has hardly any area.
    let sliver = [[[0.0; 3], [1e9, 0.0, 0.0], [1e9, 1e-5, 0.0]]];
    has(&fail(&sliver), &["triangle 0 (from 0) has an edge of 1.000e9 m"]);
    has(&fail(&[[[1e9, 0.0, 0.0], [1e9, 1.0, 0.0], [1e9, 0.0, 1.0]]]), &["outside the world"]);
}
