//! The pose of a patch in the world.

/// The pose of a patch in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The rotation of `world_from_patch`: a matrix, row by row.
    pub rotation: [[f64; 3]; 3],
    /// The patch's origin in the world, metres.
    pub origin_in_world_m: [f64; 3],
}

impl Placement {
    #[inline]
    pub(super) fn place(&self, point_in_patch_m: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = point_in_patch_m;
        std::array::from_fn(|k| {
            let [a, b, c] = self.rotation[k];
            self.origin_in_world_m[k] + a * x + b * y + c * z
        })
    }

    /// Bounds in the world of a box in the patch, both given by their lowest and highest corner, metres.
    pub fn bounds_m(&self, [low, high]: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
        let middle: [f64; 3] = std::array::from_fn(|k| f64::midpoint(low[k], high[k]));
        let half: [f64; 3] = std::array::from_fn(|k| (high[k] - low[k]) / 2.0);
        let middle = self.place(middle);
        let half = self.rotation.map(|row| (0..3).map(|k| row[k].abs() * half[k]).sum::<f64>());
        [std::array::from_fn(|k| middle[k] - half[k]), std::array::from_fn(|k| middle[k] + half[k])]
    }

    /// R C Rᵀ of a covariance xx, xy, xz, yy, yz, zz.
    #[inline]
    pub(super) fn rotate(&self, [xx, xy, xz, yy, yz, zz]: [f64; 6]) -> [f64; 6] {
        let by_row = |[a, b, c]: [f64; 3]| {
            [a * xx + b * xy + c * xz, a * xy + b * yy + c * yz, a * xz + b * yz + c * zz]
        };
        let rows = self.rotation.map(by_row);
        let dot = |i: usize, j: usize| {
            let ([a, b, c], [x, y, z]) = (rows[i], self.rotation[j]);
            a * x + b * y + c * z
        };
        [dot(0, 0), dot(0, 1), dot(0, 2), dot(1, 1), dot(1, 2), dot(2, 2)]
    }
}
