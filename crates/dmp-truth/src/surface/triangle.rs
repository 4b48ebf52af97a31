//! How far a point is from a triangle.

/// Three corners, metres.
pub type Triangle = [[f64; 3]; 3];

/// Sine of an angle below which a triangle has no inside to speak of: its plane would be made of rounding.
/// What is excluded then is narrower than this times its length.
const MIN_SINE: f64 = 1e-12;

type Vector = [f64; 3];

/// Squared distance of a point from a triangle, square metres. A triangle without area is the segments or
/// the point that it is.
///
/// Above the inside of the triangle it is the distance from the plane, elsewhere that from the nearest
/// edge. Everything is counted from the point, so nothing is lost far from the origin.
pub(super) fn squared_distance(point: Vector, triangle: &Triangle) -> f64 {
    let [a, b, c] = triangle.map(|corner| sub(corner, point));
    let (ab, ac) = (sub(b, a), sub(c, a));
    let normal = cross(ab, ac);
    let area2 = dot(normal, normal);
    if area2 > MIN_SINE * MIN_SINE * dot(ab, ab) * dot(ac, ac) {
        // The foot of the perpendicular is inside where the point is on the inner side of all three edges.
        let inside = |from: Vector, to: Vector| dot(cross(sub(to, from), from), normal) <= 0.0;
        if inside(a, b) && inside(b, c) && inside(c, a) {
            let height = dot(normal, a);
            return height * height / area2;
        }
    }
    from_segment(a, b).min(from_segment(b, c)).min(from_segment(c, a))
}

/// Squared distance of the origin from a segment.
fn from_segment(a: Vector, b: Vector) -> f64 {
    let along = sub(b, a);
    let length2 = dot(along, along);
    let share = if length2 > 0.0 { (-dot(a, along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    let nearest: Vector = std::array::from_fn(|k| a[k] + share * along[k]);
    // At the far end the corner itself, not what rounding makes of it.
    dot(nearest, nearest).min(dot(a, a)).min(dot(b, b))
}

pub(super) fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: Triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]];

    #[test]
    fn all_seven_regions_are_right() {
        let cases = [
            ([1.0, 1.0, 2.0], 4.0),              // above the inside
            ([1.0, 1.0, 0.0], 0.0),              // on it
            ([-3.0, -4.0, 0.0], 25.0),           // corner a
            ([7.0, -4.0, 0.0], 25.0),            // corner b
            ([-1.0, 5.0, 2.0], 9.0),             // corner c
            ([2.0, -3.0, 4.0], 25.0),            // edge ab
            ([-2.0, 1.0, 0.0], 4.0),             // edge ca
            ([2.0 + 3.0, 1.5 + 4.0, 0.0], 25.0), // edge bc: its normal is (3, 4)
        ];
        for (point, expected) in cases {
            for turn in 0..3 {
                let mut triangle = RIGHT;
                triangle.rotate_left(turn);
                assert!((squared_distance(point, &triangle) - expected).abs() < 1e-12, "{point:?}");
                triangle.swap(0, 1);
                assert!((squared_distance(point, &triangle) - expected).abs() < 1e-12, "{point:?}");
            }
        }
    }

    #[test]
    fn triangles_without_area_are_segments_and_points() {
        let segment = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        assert_eq!(squared_distance([1.5, 2.0, 0.0], &segment), 4.0);
        assert_eq!(squared_distance([5.0, 4.0, 0.0], &segment), 25.0);
        assert_eq!(squared_distance([3.0, 4.0, 0.0], &[[0.0; 3]; 3]), 25.0);
        let needle = [[0.0, 0.0, 0.0], [1e3, 0.0, 0.0], [1e3, 1e-13, 0.0]];
        assert!((squared_distance([500.0, 0.0, 2.0], &needle) - 4.0).abs() < 1e-9);
    }

    #[test]
    fn nothing_is_lost_far_from_the_origin() {
        let shift = [500_000.125, 5_400_000.25, 100.5];
        let far = RIGHT.map(|corner| std::array::from_fn(|k| corner[k] + shift[k]));
        let point = std::array::from_fn(|k| [1.0, 1.0, 0.0625][k] + shift[k]);
        assert_eq!(squared_distance(point, &far), 0.0625 * 0.0625);
    }
}
