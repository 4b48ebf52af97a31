//! A sample of the rays of each keyframe, by where they end.

use std::collections::BTreeMap;

use dmp::Scales;
use dmp_sensor::{Isometry3, Ray};
use nalgebra::Point3;

/// A sample of the rays of a keyframe's scans, in the frame of the keyframe: by the columns that they end in.
#[derive(Debug, Clone, Default)]
pub(super) struct KeyframeRays {
    rays: Vec<RayInPatch>,
    groups: Vec<Group>,
}

/// A ray from where the sensor was to what it met, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RayInPatch {
    from_m: [f32; 3],
    to_m: [f32; 3],
}

/// Rays that end in one column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Group {
    pub(super) first: usize,
    pub(super) count: usize,
    /// Bounds of where they end.
    pub(super) bounds_m: [[f64; 3]; 2],
}

impl RayInPatch {
    pub(super) fn of(body_from_world: &Isometry3<f64>, ray: &Ray) -> Self {
        let in_patch = |place: [f64; 3]| {
            let place = body_from_world * Point3::from(place);
            [place.x as f32, place.y as f32, place.z as f32]
        };
        Self { from_m: in_patch(ray.origin_in_world), to_m: in_patch(ray.endpoint_in_world()) }
    }

    /// The ray where the keyframe is at `world_from_body`.
    pub(super) fn placed(&self, world_from_body: &Isometry3<f64>) -> Ray {
        let [from, to] = [self.from_m, self.to_m].map(|place| Point3::from(place.map(f64::from)));
        let (along, origin) = (to - from, world_from_body * from);
        let range_m = along.norm();
        let direction = world_from_body.rotation * (along / range_m);
        Ray { origin_in_world: origin.coords.into(), direction_in_world: direction.into(), range_m }
    }
}

impl KeyframeRays {
    /// Groups rays. They are in one order whatever order they come in.
    pub(super) fn new(rays: Vec<RayInPatch>, scales: Scales) -> Self {
        let column_m = scales.lengths().loop_map.column_m;
        let mut columns: BTreeMap<[i64; 2], Vec<RayInPatch>> = BTreeMap::new();
        for ray in rays {
            let column = [ray.to_m[0], ray.to_m[1]].map(|c| (f64::from(c) / column_m).floor() as i64);
            columns.entry(column).or_default().push(ray);
        }
        let mut grouped = Self::default();
        for mut rays in columns.into_values() {
            rays.sort_unstable_by_key(|ray| [ray.to_m, ray.from_m].map(|place| place.map(f32::to_bits)));
            let bound = |of: fn(f64, f64) -> f64| {
                let ends = rays.iter().map(|ray| ray.to_m.map(f64::from));
                ends.reduce(|a, b| std::array::from_fn(|k| of(a[k], b[k]))).unwrap_or_default()
            };
            let bounds_m = [bound(f64::min), bound(f64::max)];
            grouped.groups.push(Group { first: grouped.rays.len(), count: rays.len(), bounds_m });
            grouped.rays.append(&mut rays);
        }
        grouped
    }

    pub(super) fn all(&self) -> &[RayInPatch] {
        &self.rays
    }

    pub(super) fn groups(&self) -> &[Group] {
        &self.groups
    }
}

/// Whether a return is in a sample of `share` of all: by its number, so that no pattern of the sensor's beams meets one
/// of ours.
pub(super) fn is_drawn(scan: usize, index: usize, share: f64) -> bool {
    // SplitMix64, Steele, Lea and Flood 2014.
    let mut bits = (scan as u64) << 32 ^ index as u64;
    bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    ((bits >> 11) as f64) < share * (1u64 << 53) as f64
}
