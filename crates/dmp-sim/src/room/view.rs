//! What every pixel of a depth camera sees of a room, exactly.

use std::ops::Range;

use dmp_sensor::{Isometry3, PinholeCamera, PixelBearings, Vector3};

use super::fitting::Solid;
use super::furnished::Room;

/// Pixels of a tile, either way. The solids that its rays may meet are found for all of them together.
const TILE_PX: usize = 16;

/// What a pixel sees without any noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    /// Depth along the optical axis, metres; infinite where nothing is seen.
    pub(super) depth_m: f64,
    /// Cosine of the angle between the ray and the surface's normal.
    pub(super) cos_incidence: f64,
    /// Share of the readings that a camera loses on the surface.
    pub(super) lost: f64,
}

impl Seen {
    pub(super) const NOTHING: Self = Self { depth_m: f64::INFINITY, cos_incidence: 1.0, lost: 0.0 };
}

/// A camera's bearings, and what of them holds for whole tiles of the image.
#[derive(Debug, Clone)]
pub(super) struct View {
    size_px: [usize; 2],
    bearings: PixelBearings,
    tiles: Vec<Tile>,
}

#[derive(Debug, Clone)]
struct Tile {
    columns: Range<usize>,
    rows: Range<usize>,
    /// Least and largest x / z and y / z of its pixels.
    slopes: [[f64; 2]; 2],
}

impl View {
    pub(super) fn new(camera: &PinholeCamera) -> Self {
        let [width, height] = camera.size_px().map(|px| px as usize);
        let bearings = camera.bearings();
        let tile = |column: usize, row: usize| {
            let columns = column..(column + TILE_PX).min(width);
            let rows = row..(row + TILE_PX).min(height);
            let mut slopes = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
            for pixel in rows.clone().flat_map(|row| columns.clone().map(move |column| row * width + column))
            {
                for (bounds, slope) in slopes.iter_mut().zip(bearings.slopes(pixel)) {
                    // A pixel without a bearing has NaN, which neither function takes.
                    *bounds = [bounds[0].min(slope), bounds[1].max(slope)];
                }
            }
            Tile { columns, rows, slopes }
        };
        let rows = (0..height).step_by(TILE_PX);
        let corners = rows.flat_map(|row| (0..width).step_by(TILE_PX).map(move |column| (column, row)));
        let tiles = corners.map(|(column, row)| tile(column, row)).collect();
        Self { size_px: [width, height], bearings, tiles }
    }

    /// What all pixels see from a pose, row by row.
    pub(super) fn seen(&self, room: &Room, world_from_camera: &Isometry3<f64>) -> Vec<Seen> {
        let [width, height] = self.size_px;
        let mut image = vec![Seen::NOTHING; width * height];
        let origin = world_from_camera.translation.vector;
        let axes = world_from_camera.rotation.to_rotation_matrix();
        let [right, down, ahead] = [0, 1, 2].map(|k| axes.matrix().column(k).into_owned());
        let mut near = Vec::new();
        for tile in &self.tiles {
            let [[left, right_most], [top, bottom]] = tile.slopes;
            let sides =
                [right - ahead * left, ahead * right_most - right, down - ahead * top, ahead * bottom - down];
            within(room, origin, &sides, ahead, &mut near);
            for row in tile.rows.clone() {
                for pixel in tile.columns.clone().map(|column| row * width + column) {
                    let [x, y] = self.bearings.slopes(pixel);
                    if x.is_finite() && y.is_finite() {
                        // Its length along the optical axis is 1: a "range" in such lengths is the depth.
                        image[pixel] = first(origin, right * x + down * y + ahead, &near);
                    }
                }
            }
        }
        image
    }
}

/// A solid that rays of a tile may meet, and the least depth at which they do.
type Near<'a> = (f64, &'a Solid);

/// The solids whose bounds reach within all four `sides` (normals inwards, planes through the origin) and in front
/// of the camera, nearest first.
fn within<'a>(
    room: &'a Room,
    origin: Vector3<f64>,
    sides: &[Vector3<f64>; 4],
    ahead: Vector3<f64>,
    near: &mut Vec<Near<'a>>,
) {
    near.clear();
    for (solid, (low, high)) in room.solids.iter().zip(&room.bounds) {
        let (low, high) = (low - origin, high - origin);
        // The largest of n · corner over the corners of the bounds.
        let most = |n: &Vector3<f64>| (0..3).map(|k| (n[k] * low[k]).max(n[k] * high[k])).sum::<f64>();
        if most(&ahead) > 0.0 && sides.iter().all(|side| most(side) >= -1e-9) {
            let least: f64 = (0..3).map(|k| (ahead[k] * low[k]).min(ahead[k] * high[k])).sum();
            near.push((least, solid));
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
}

/// The first surface along a direction that is one long along the optical axis.
fn first(origin: Vector3<f64>, direction: Vector3<f64>, near: &[Near]) -> Seen {
    let mut best = None;
    let mut depth_m = f64::INFINITY;
    for (least_m, solid) in near {
        if *least_m >= depth_m {
            break;
        }
        if let Some(entry) = solid.shape.entry(origin, direction).filter(|entry| entry.range_m < depth_m) {
            depth_m = entry.range_m;
            best = Some((entry.normal, solid.lost));
        }
    }
    best.map_or(Seen::NOTHING, |(normal, lost)| {
        let cos_incidence = (-normal.dot(&direction) / direction.norm()).clamp(0.0, 1.0);
        Seen { depth_m, cos_incidence, lost }
    })
}
