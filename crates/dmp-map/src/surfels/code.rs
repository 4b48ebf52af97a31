//! A surfel as integers: rounding and decoding.

use super::surfel::Surfel;
use crate::grid::{DEPTH_STEPS, Lattice, UNITS_PER_M};

/// Steps of a slope in 1.
pub(crate) const SLOPE_STEPS: i32 = 1 << 18;
/// A surfel as integers: the form in which a store keeps it, and its only exact form.
///
/// The normal is largest along one axis and is given by its slopes relative to that axis. Along the other two axes the
/// centre is rounded to [`Lattice::across_steps`]. Along the first axis it is then on the disc's plane, rounded to
/// [`DEPTH_STEPS`]. Moving a centre within the plane changes no crossing except at the rim; moving it out of the plane
/// changes all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SurfelCode {
    /// x, y, z of the voxel: x and y from the tile's corner, outside the tile for the copy of a neighbour's
    /// disc; z from world zero.
    pub(crate) voxel: [i32; 3],
    pub(crate) normal: NormalCode,
    /// Along the other two axes, in their order, from the voxel's lowest corner.
    pub(crate) across_steps: [u32; 2],
    /// Along the normal's axis, from the voxel's lowest corner.
    pub(crate) depth_steps: u32,
    pub(crate) third_lowest: i32,
    pub(crate) third_highest: i32,
}

/// A normal as integers; its component along the axis is positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NormalCode {
    /// The axis of its largest component.
    pub(crate) axis: usize,
    /// Its components along the other two axes, in their order, divided by that along the axis: −1 to 1.
    pub(crate) slope_steps: [i32; 2],
}

/// The other two axes, in their order.
fn others(axis: usize) -> [usize; 2] {
    match axis {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}

impl NormalCode {
    /// The code nearest to a non-zero vector, of either sign.
    pub(crate) fn of(normal: [f64; 3]) -> Self {
        let longer = |axis: usize, k: usize| if normal[k].abs() > normal[axis].abs() { k } else { axis };
        let axis = (0..3).fold(0, longer);
        let steps = |k: usize| (normal[k] / normal[axis] * f64::from(SLOPE_STEPS)).round() as i32;
        Self { axis, slope_steps: others(axis).map(steps) }
    }

    fn slopes(self) -> [f64; 2] {
        self.slope_steps.map(|steps| f64::from(steps) / f64::from(SLOPE_STEPS))
    }

    /// The unit normal.
    pub(crate) fn normal(self) -> [f32; 3] {
        let [p, q] = self.slopes();
        let length = (1.0 + p * p + q * q).sqrt();
        let mut normal = [0.0; 3];
        let [i, j] = others(self.axis);
        (normal[self.axis], normal[i], normal[j]) = (1.0 / length, p / length, q / length);
        normal.map(|c: f64| c as f32)
    }
}

impl SurfelCode {
    /// The code of a disc around `mean_units`, lattice units from the voxel's lowest corner, each inside the voxel. The
    /// plane is accurate to half a step of depth; the centre stays in the voxel.
    pub(crate) fn of(lattice: &Lattice, voxel: [i32; 3], normal: NormalCode, mean_units: [f64; 3]) -> Self {
        let (most_units, steps) = (lattice.voxel_units() - 1, lattice.across_steps());
        let slopes = normal.slopes();
        let across = others(normal.axis).map(|k| mean_units[k] * f64::from(steps));
        // Depth of the plane through the mean at a position across.
        let depth = |rounded: [f64; 2]| {
            let moved = [0, 1].map(|k| slopes[k] * (across[k] - rounded[k]) / f64::from(steps));
            ((mean_units[normal.axis] + moved[0] + moved[1]) * f64::from(DEPTH_STEPS)).round()
        };
        let most_depth = most_units * DEPTH_STEPS;
        let mut rounded = across.map(f64::round);
        let first = depth(rounded);
        if first < 0.0 || first > f64::from(most_depth) {
            // The plane leaves the voxel next to the mean: move the position to the side where it is inside.
            let down = |slope: f64| (slope > 0.0) == (first < 0.0);
            rounded = [0, 1].map(|k| if down(slopes[k]) { across[k].floor() } else { across[k].ceil() });
        }
        Self {
            voxel,
            normal,
            across_steps: rounded.map(|c| c as u32),
            depth_steps: (depth(rounded) as u32).min(most_depth),
            third_lowest: i32::MAX,
            third_highest: i32::MIN,
        }
    }
}

/// Decodes codes into surfels, one after the other.
pub(crate) struct Decoder {
    /// A voxel's edge and a step across, in steps of depth.
    edge: i64,
    across: i64,
    /// z of the voxels on whose lower faces z is 0.
    base_voxel_z: i32,
    last: Option<(NormalCode, [f32; 3])>,
}

impl Decoder {
    pub(crate) fn new(lattice: &Lattice, base_voxel_z: i32) -> Self {
        let edge = i64::from(lattice.voxel_units() * DEPTH_STEPS);
        let across = i64::from(DEPTH_STEPS / lattice.across_steps());
        Self { edge, across, base_voxel_z, last: None }
    }

    #[inline]
    pub(crate) fn surfel(&mut self, code: &SurfelCode) -> Surfel {
        const STEPS_PER_M: f64 = UNITS_PER_M * DEPTH_STEPS as f64;
        // Surfels of a cell share one normal.
        let normal = match self.last {
            Some((last, normal)) if last == code.normal => normal,
            _ => code.normal.normal(),
        };
        self.last = Some((code.normal, normal));
        let [x, y, z] = code.voxel.map(i64::from);
        let mut steps = [x, y, z - i64::from(self.base_voxel_z)].map(|voxels| voxels * self.edge);
        let [i, j] = others(code.normal.axis);
        steps[code.normal.axis] += i64::from(code.depth_steps);
        steps[i] += i64::from(code.across_steps[0]) * self.across;
        steps[j] += i64::from(code.across_steps[1]) * self.across;
        Surfel {
            centre_in_tile_m: steps.map(|steps| (steps as f64 / STEPS_PER_M) as f32),
            normal,
            third_lowest: code.third_lowest,
            third_highest: code.third_highest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    /// Numbers from 0 to 1.
    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn direction(&mut self) -> Vector3<f64> {
            loop {
                let v = Vector3::from_fn(|_, _| 2.0 * self.unit() - 1.0);
                if (0.01..=1.0).contains(&v.norm_squared()) {
                    return v.normalize();
                }
            }
        }
    }

    /// A disc before and after rounding, metres from the tile's origin.
    struct Disc {
        exact: [Vector3<f64>; 2],
        kept: [Vector3<f64>; 2],
    }

    fn disc(lattice: &Lattice, random: &mut Random) -> Disc {
        let edge = f64::from(lattice.voxel_units());
        let mean_units: [f64; 3] = std::array::from_fn(|_| random.unit() * (edge - 1.0));
        // Often along an axis or a diagonal, as walls are.
        let normal = match random.unit() {
            u if u < 0.2 => Vector3::new(1.0, 0.0, 0.0),
            u if u < 0.4 => Vector3::new(1.0, 1.0, 1.0).normalize(),
            u if u < 0.6 => (Vector3::new(0.0, 0.0, 1.0) + 0.01 * random.direction()).normalize(),
            _ => random.direction(),
        };
        let voxel = [random.unit(), random.unit()].map(|u| (u * f64::from(lattice.tile_voxels())) as i32);
        let voxel = [voxel[0], voxel[1], (random.unit() * 20.0 - 10.0) as i32];
        let code = SurfelCode::of(lattice, voxel, NormalCode::of(normal.into()), mean_units);
        let surfel = Decoder::new(lattice, 0).surfel(&code);
        let centre = |k: usize| (f64::from(voxel[k]) * edge + mean_units[k]) / UNITS_PER_M;
        Disc {
            exact: [Vector3::from_fn(|k, _| centre(k)), normal],
            kept: [surfel.centre_in_tile_m, surfel.normal].map(|v| Vector3::from(v.map(f64::from))),
        }
    }

    /// The crossing of a ray with a disc, if any.
    fn crossing(
        origin: Vector3<f64>,
        direction: Vector3<f64>,
        disc: [Vector3<f64>; 2],
        radius: f64,
    ) -> Option<f64> {
        let [centre, normal] = disc;
        let cos = normal.dot(&direction);
        let range = normal.dot(&(centre - origin)) / cos;
        let off = (origin + range * direction - centre).norm();
        (cos.abs() >= 0.01 && off <= radius).then_some(range)
    }

    #[test]
    fn no_range_to_a_disc_moves_by_a_millimetre() {
        for voxel_m in [0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0] {
            let lattice = Lattice::new(voxel_m).unwrap();
            let (mut random, radius) = (Random(voxel_m.to_bits()), lattice.disc_radius_m());
            let (mut largest_m, mut both, mut one) = (0.0f64, 0, 0);
            for _ in 0..200_000 {
                let disc = disc(&lattice, &mut random);
                let [centre, normal] = disc.exact;
                // Half of the rays at the most grazing incidence of a hit, the rest at any.
                let cos =
                    if random.unit() < 0.5 { 0.010_01 } else { 0.01 + 0.99 * random.unit() * random.unit() };
                let along = normal.cross(&random.direction()).normalize();
                let to = normal.cross(&random.direction()).normalize();
                let hit = centre + to * (radius * random.unit().sqrt());
                let direction = normal * cos + along * (1.0 - cos * cos).sqrt();
                let origin = hit - direction * (0.5 + 100.0 * random.unit());
                let [exact, kept] = [disc.exact, disc.kept].map(|d| crossing(origin, direction, d, radius));
                if let (Some(exact), Some(kept)) = (exact, kept) {
                    largest_m = largest_m.max((exact - kept).abs());
                    both += 1;
                } else if exact.is_some() != kept.is_some() {
                    one += 1;
                }
            }
            println!(
                "voxels of {voxel_m} m: {both} rays cross both discs, ranges apart by at most {:.3} mm; \
                 {one} cross one of them",
                1e3 * largest_m
            );
            assert!(both > 150_000 && largest_m <= 1e-3, "{voxel_m} m: {largest_m} m");
        }
    }

    proptest! {
        #[test]
        fn a_code_is_as_near_as_it_says(
            voxel_m in 0.01..2.0f64, inside in prop::array::uniform3(0.0..=1.0f64),
            normal in prop::array::uniform3(-1.0..1.0f64), corner in prop::array::uniform3(0..3u32),
        ) {
            let normal = Vector3::from(normal);
            prop_assume!(normal.norm() > 1e-3);
            let lattice = Lattice::new(voxel_m).unwrap();
            let most = f64::from(lattice.voxel_units() - 1);
            // Sometimes exactly on a face.
            let mean: [f64; 3] = std::array::from_fn(|k| match corner[k] { 0 => 0.0, 1 => most, _ => inside[k] * most });
            let code = SurfelCode::of(&lattice, [0, 0, 0], NormalCode::of(normal.into()), mean);
            let surfel = Decoder::new(&lattice, 0).surfel(&code);
            let kept = Vector3::from(surfel.normal.map(f64::from));
            prop_assert!((kept.norm() - 1.0).abs() < 1e-6);
            let off = kept.cross(&normal.normalize()).norm();
            prop_assert!(off < 2.8e-6, "{off} rad");
            prop_assert!(kept.iter().all(|c| c.abs() <= kept[code.normal.axis]));
            let centre = surfel.centre_in_tile_m.map(|c| f64::from(c) * UNITS_PER_M);
            prop_assert!(centre.iter().all(|c| (0.0..=most).contains(c)), "{centre:?}");
            let moved = Vector3::from_fn(|k, _| centre[k] - mean[k]);
            // Up to half a step across, a whole one at the voxel's faces; as much again where the plane is steep.
            prop_assert!(moved.iter().all(|c| c.abs() * f64::from(lattice.across_steps()) <= 2.5), "{moved}");
            let plane = moved.dot(&kept);
            prop_assert!(plane.abs() <= 0.5 / f64::from(DEPTH_STEPS) + 1e-3, "{plane} units");
        }
    }

    #[test]
    fn opposite_normals_and_ties_have_one_code() {
        for (normal, axis, slopes) in [
            ([0.0, 0.0, -1.0], 2, [0.0, 0.0]),
            ([1.0, -1.0, 0.0], 0, [-1.0, 0.0]),
            ([-1.0, -1.0, -1.0], 0, [1.0, 1.0]),
            ([0.25, 1.0, -0.5], 1, [0.25, -0.5]),
        ] {
            let slope_steps = slopes.map(|slope: f64| (slope * f64::from(SLOPE_STEPS)) as i32);
            assert_eq!(NormalCode::of(normal), NormalCode { axis, slope_steps });
            assert_eq!(NormalCode::of(normal.map(|c| -c)), NormalCode::of(normal));
        }
    }
}
