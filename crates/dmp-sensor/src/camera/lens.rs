//! The distortion of a lens, and its undoing.

/// Steps in which a distortion is undone, and how near its image must come to the place asked for, in focal lengths.
const STEPS: usize = 50;
const NEAR: f64 = 1e-12;

/// What a lens does to places in an image: Brown's model as `OpenCV` and TUM RGB-D write it, k1, k2, p1, p2, k3.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Distortion {
    /// k1, k2, k3: along the radius.
    pub radial: [f64; 3],
    /// p1, p2: from a lens that is not parallel to the image.
    pub tangential: [f64; 2],
}

impl Distortion {
    /// None at all.
    pub const NONE: Self = Self { radial: [0.0; 3], tangential: [0.0; 2] };

    pub(super) fn numbers(&self) -> [f64; 5] {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        [k1, k2, p1, p2, k3]
    }

    /// Where x / z, y / z is seen, in focal lengths from the centre.
    pub(super) fn done(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }

    /// x / z, y / z of what is seen at a place, by Newton's method from there; `None` where it does not get there.
    pub(super) fn undone(&self, seen: [f64; 2]) -> Option<[f64; 2]> {
        if *self == Self::NONE {
            return Some(seen);
        }
        let mut place = seen;
        for _ in 0..STEPS {
            let there = self.done(place);
            let off = [seen[0] - there[0], seen[1] - there[1]];
            if off[0].abs().max(off[1].abs()) < NEAR {
                return Some(place);
            }
            let [[a, b], [c, d]] = self.slope(place);
            let determinant = a * d - b * c;
            // Beyond the fold the model maps back inwards: nothing is seen there.
            if determinant.is_nan() || determinant <= 0.0 {
                return None;
            }
            place[0] += (d * off[0] - b * off[1]) / determinant;
            place[1] += (a * off[1] - c * off[0]) / determinant;
        }
        None
    }

    /// The derivatives of [`Self::done`], a row for each of its numbers.
    fn slope(&self, [x, y]: [f64; 2]) -> [[f64; 2]; 2] {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        // Of the radial factor by r².
        let steeper = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
        let across = 2.0 * x * y * steeper + 2.0 * p1 * x + 2.0 * p2 * y;
        [
            [radial + 2.0 * x * x * steeper + 2.0 * p1 * y + 6.0 * p2 * x, across],
            [across, radial + 2.0 * y * y * steeper + 6.0 * p1 * y + 2.0 * p2 * x],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_beyond_the_fold_shows_nothing() {
        let folding = Distortion { radial: [-0.5, 0.0, 0.0], tangential: [0.0; 2] };
        // r − r³ / 2 is largest, 0.544, at r = 0.816.
        let near = folding.undone([0.5, 0.0]).unwrap();
        assert!((folding.done(near)[0] - 0.5).abs() < 1e-12 && near[0] < 0.816);
        assert_eq!(folding.undone([0.6, 0.0]), None);
        assert_eq!(folding.undone([f64::NAN, 0.0]), None);
    }
}
