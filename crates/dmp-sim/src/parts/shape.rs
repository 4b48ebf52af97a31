//! Solids that a ray can meet from outside, with the closed form of where.

use nalgebra::Vector3;

use crate::random::Random;

type Vec3 = Vector3<f64>;

/// Where a ray enters a solid: the range along the ray and the outward unit normal there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Entry {
    pub(crate) range_m: f64,
    pub(crate) normal: Vec3,
}

/// A solid in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    /// An upright box, turned about the vertical.
    Box { centre: Vec3, half: Vec3, cos_yaw: f64, sin_yaw: f64 },
    /// An upright cylinder with flat ends, standing at `foot`.
    Cylinder { foot: Vec3, radius_m: f64, height_m: f64 },
    /// An ellipsoid along the world's axes.
    Ellipsoid { centre: Vec3, half: Vec3 },
}

impl Shape {
    /// A box along the world's axes, between two opposite corners.
    pub(crate) fn upright(a: Vec3, b: Vec3) -> Self {
        Self::Box { centre: (a + b) / 2.0, half: (b - a).abs() / 2.0, cos_yaw: 1.0, sin_yaw: 0.0 }
    }

    /// Where the ray enters; `None` where it passes by or starts inside.
    pub(crate) fn entry(&self, origin: Vec3, direction: Vec3) -> Option<Entry> {
        match *self {
            Self::Box { centre, half, cos_yaw, sin_yaw } => {
                let into =
                    |v: Vec3| Vec3::new(cos_yaw * v.x + sin_yaw * v.y, cos_yaw * v.y - sin_yaw * v.x, v.z);
                let Entry { range_m, normal } = slabs(into(origin - centre), into(direction), half)?;
                let x = cos_yaw * normal.x - sin_yaw * normal.y;
                let y = cos_yaw * normal.y + sin_yaw * normal.x;
                Some(Entry { range_m, normal: Vec3::new(x, y, normal.z) })
            }
            Self::Cylinder { foot, radius_m, height_m } => tube(origin - foot, direction, radius_m, height_m),
            Self::Ellipsoid { centre, half } => ball(origin - centre, direction, half),
        }
    }

    /// The smallest box along the world's axes around it: lower and upper corner.
    pub(crate) fn bounds(&self) -> (Vec3, Vec3) {
        match *self {
            Self::Box { centre, half, cos_yaw, sin_yaw } => {
                let (c, s) = (cos_yaw.abs(), sin_yaw.abs());
                let reach = Vec3::new(c * half.x + s * half.y, s * half.x + c * half.y, half.z);
                (centre - reach, centre + reach)
            }
            Self::Cylinder { foot, radius_m, height_m } => {
                let reach = Vec3::new(radius_m, radius_m, 0.0);
                (foot - reach, foot + reach + Vec3::new(0.0, 0.0, height_m))
            }
            Self::Ellipsoid { centre, half } => (centre - half, centre + half),
        }
    }

    /// A ball somewhere within an ellipsoid: what crowns of trees are made of.
    pub(crate) fn leaves(centre: Vec3, half: Vec3, random: &mut Random) -> Self {
        let offset = loop {
            let v = Vec3::from_fn(|_, _| random.between(-1.0, 1.0));
            if v.norm_squared() <= 1.0 {
                break v;
            }
        };
        let radius_m = random.between(0.22, 0.45);
        Self::Ellipsoid { centre: centre + offset.component_mul(&half), half: Vec3::repeat(radius_m) }
    }
}

/// A box |x| ≤ half about the origin, by its three slabs.
fn slabs(origin: Vec3, direction: Vec3, half: Vec3) -> Option<Entry> {
    let (mut enter, mut leave, mut axis) = (f64::NEG_INFINITY, f64::INFINITY, 0);
    for k in 0..3 {
        if direction[k] == 0.0 {
            if origin[k].abs() > half[k] {
                return None;
            }
            continue;
        }
        let towards = half[k].copysign(direction[k]);
        let near = (-towards - origin[k]) / direction[k];
        if near > enter {
            (enter, axis) = (near, k);
        }
        leave = leave.min((towards - origin[k]) / direction[k]);
    }
    (enter > 0.0 && enter <= leave).then(|| {
        let mut normal = Vec3::zeros();
        normal[axis] = -direction[axis].signum();
        Entry { range_m: enter, normal }
    })
}

/// An upright cylinder standing on the origin.
fn tube(origin: Vec3, direction: Vec3, radius_m: f64, height_m: f64) -> Option<Entry> {
    let a = direction.x * direction.x + direction.y * direction.y;
    let b = origin.x * direction.x + origin.y * direction.y;
    let c = origin.x * origin.x + origin.y * origin.y - radius_m * radius_m;
    if a > 0.0 && c > 0.0 {
        let root = b * b - a * c;
        if root < 0.0 || b > 0.0 {
            return None;
        }
        let range_m = (-b - libm::sqrt(root)) / a;
        let z = origin.z + range_m * direction.z;
        if (0.0..=height_m).contains(&z) {
            let normal = (origin + direction * range_m) / radius_m;
            return Some(Entry { range_m, normal: Vec3::new(normal.x, normal.y, 0.0) });
        }
    }
    // Not through the side: through an end, if at all.
    let end = if direction.z < 0.0 { height_m } else { 0.0 };
    let range_m = (end - origin.z) / direction.z;
    let at = origin + direction * range_m;
    let inside = at.x * at.x + at.y * at.y <= radius_m * radius_m;
    (range_m > 0.0 && range_m.is_finite() && inside)
        .then(|| Entry { range_m, normal: Vec3::new(0.0, 0.0, -direction.z.signum()) })
}

/// An ellipsoid about the origin.
fn ball(origin: Vec3, direction: Vec3, half: Vec3) -> Option<Entry> {
    let (o, d) = (origin.component_div(&half), direction.component_div(&half));
    let (a, b, c) = (d.norm_squared(), o.dot(&d), o.norm_squared() - 1.0);
    let root = b * b - a * c;
    if root < 0.0 || b > 0.0 || c <= 0.0 {
        return None;
    }
    let range_m = (-b - libm::sqrt(root)) / a;
    let normal = (o + d * range_m).component_div(&half).normalize();
    Some(Entry { range_m, normal })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64, z: f64) -> Vec3 {
        Vec3::new(x, y, z)
    }

    fn check(shape: Shape, origin: Vec3, towards: Vec3, expected: Option<(f64, Vec3)>) {
        let got = shape.entry(origin, towards.normalize());
        match (got, expected) {
            (None, None) => {}
            (Some(entry), Some((range_m, normal))) => {
                assert!((entry.range_m - range_m).abs() < 1e-12, "{entry:?} {range_m}");
                assert!((entry.normal - normal).norm() < 1e-12, "{entry:?} {normal}");
            }
            _ => panic!("{shape:?} from {origin:?} to {towards:?}: {got:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn a_box_is_entered_through_the_face_that_is_seen() {
        let shape = Shape::upright(v(2.0, -1.0, 0.0), v(4.0, 1.0, 3.0));
        check(shape, v(0.0, 0.0, 1.0), v(1.0, 0.0, 0.0), Some((2.0, v(-1.0, 0.0, 0.0))));
        check(shape, v(3.0, 0.0, 9.0), v(0.0, 0.0, -1.0), Some((6.0, v(0.0, 0.0, 1.0))));
        check(shape, v(0.0, 0.0, 1.0), v(-1.0, 0.0, 0.0), None);
        check(shape, v(0.0, 1.5, 1.0), v(1.0, 0.0, 0.0), None);
        check(shape, v(3.0, 0.0, 1.0), v(1.0, 0.0, 0.0), None);
    }

    #[test]
    fn a_turned_box_is_a_diamond() {
        let eighth = std::f64::consts::FRAC_PI_4;
        let (centre, half) = (v(5.0, 0.0, 0.0), v(1.0, 1.0, 1.0));
        let shape = Shape::Box { centre, half, cos_yaw: libm::cos(eighth), sin_yaw: libm::sin(eighth) };
        let side = libm::sqrt(0.5);
        let range_m = 5.0 - libm::sqrt(2.0) + 0.5;
        check(shape, v(0.0, 0.5, 0.0), v(1.0, 0.0, 0.0), Some((range_m, v(-side, side, 0.0))));
        assert!((shape.bounds().0.x - (5.0 - libm::sqrt(2.0))).abs() < 1e-12);
    }

    #[test]
    fn a_cylinder_has_a_side_and_two_ends() {
        let shape = Shape::Cylinder { foot: v(5.0, 0.0, 0.0), radius_m: 1.0, height_m: 4.0 };
        check(shape, v(0.0, 0.0, 1.0), v(1.0, 0.0, 0.0), Some((4.0, v(-1.0, 0.0, 0.0))));
        let off_axis = 5.0 - libm::sqrt(1.0 - 0.36);
        check(shape, v(0.0, 0.6, 1.0), v(1.0, 0.0, 0.0), Some((off_axis, v(-0.8, 0.6, 0.0))));
        check(shape, v(5.5, 0.0, 9.0), v(0.0, 0.0, -1.0), Some((5.0, v(0.0, 0.0, 1.0))));
        check(shape, v(5.0, 0.5, -2.0), v(0.0, 0.0, 1.0), Some((2.0, v(0.0, 0.0, -1.0))));
        check(shape, v(0.0, 0.0, 5.0), v(1.0, 0.0, 0.0), None);
        check(shape, v(0.0, 1.1, 1.0), v(1.0, 0.0, 0.0), None);
        check(shape, v(5.0, 0.0, 1.0), v(1.0, 0.0, 0.0), None);
    }

    #[test]
    fn a_sphere_is_met_where_the_formula_says() {
        let shape = Shape::Ellipsoid { centre: v(0.0, 10.0, 0.0), half: v(2.0, 2.0, 2.0) };
        check(shape, v(0.0, 0.0, 0.0), v(0.0, 1.0, 0.0), Some((8.0, v(0.0, -1.0, 0.0))));
        let range_m = 10.0 - libm::sqrt(4.0 - 1.0);
        check(shape, v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0), Some((range_m, v(0.5, -libm::sqrt(0.75), 0.0))));
        check(shape, v(2.1, 0.0, 0.0), v(0.0, 1.0, 0.0), None);
        let long = Shape::Ellipsoid { centre: v(0.0, 10.0, 0.0), half: v(1.0, 4.0, 1.0) };
        check(long, v(0.0, 0.0, 0.0), v(0.0, 1.0, 0.0), Some((6.0, v(0.0, -1.0, 0.0))));
    }
}
