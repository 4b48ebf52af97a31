//! Depth cameras: pixels to bearings, and how exact a depth is.

mod lens;
mod noise;

use nalgebra::Point3;

pub use lens::Distortion;
pub use noise::DepthNoise;

/// How the pixels of a depth image lie to the world in front of it: the pinhole model of Zhang & Chen 2021, with
/// the lens of its datasets.
///
/// Camera frame: z along the optical axis, x along the rows of the image, y along its columns where `focal_px[1]` is
/// positive; the trajectories of ICL-NUIM go with a negative one. Pixel (0, 0) has its *middle* at (0, 0).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PinholeCamera {
    size_px: [u32; 2],
    focal_px: [f64; 2],
    centre_px: [f64; 2],
    distortion: Distortion,
}

/// Numbers that make no camera.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// An image without pixels, or with more than any camera has.
    #[error("an image of {} x {} pixels: it must have 1 to {MOST_IN_ALL_PX} in all", size_px[0], size_px[1])]
    Size {
        /// Width and height.
        size_px: [u32; 2],
    },
    /// A focal length that is zero or no number.
    #[error("focal lengths of {} and {} pixels: they must be numbers other than 0", focal_px[0], focal_px[1])]
    Focal {
        /// fx and fy.
        focal_px: [f64; 2],
    },
    /// A centre or a distortion that is no number.
    #[error("a {what} of {value}: it must be a finite number")]
    NotFinite {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

/// More pixels than any depth camera has.
const MOST_IN_ALL_PX: u64 = 1 << 24;

impl PinholeCamera {
    /// The camera with images of `size_px` (width, height), focal lengths fx and fy and the centre cx, cy, pixels.
    ///
    /// # Errors
    /// When a number makes no sense.
    pub fn new(
        size_px: [u32; 2],
        focal_px: [f64; 2],
        centre_px: [f64; 2],
        distortion: Distortion,
    ) -> Result<Self, CameraError> {
        let [width, height] = size_px.map(u64::from);
        if !(1..=MOST_IN_ALL_PX).contains(&(width * height)) {
            return Err(CameraError::Size { size_px });
        }
        if !focal_px.iter().all(|px| px.is_finite() && *px != 0.0) {
            return Err(CameraError::Focal { focal_px });
        }
        let centre = centre_px.into_iter().map(|value| ("centre", value));
        let lens = distortion.numbers().into_iter().map(|value| ("distortion", value));
        if let Some((what, value)) = centre.chain(lens).find(|(_, value)| !value.is_finite()) {
            return Err(CameraError::NotFinite { what, value });
        }
        Ok(Self { size_px, focal_px, centre_px, distortion })
    }

    /// Width and height of an image, pixels.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// fx and fy, pixels.
    pub fn focal_px(&self) -> [f64; 2] {
        self.focal_px
    }

    /// cx and cy, pixels.
    pub fn centre_px(&self) -> [f64; 2] {
        self.centre_px
    }

    /// What the lens does to a place in the image.
    pub fn distortion(&self) -> Distortion {
        self.distortion
    }

    /// Where what is seen at a place in the image lies: x / z and y / z in the camera frame. `None` where the lens
    /// model folds over and nothing straight lies behind the place.
    pub fn slopes_at(&self, place_px: [f64; 2]) -> Option<[f64; 2]> {
        self.distortion.undone(std::array::from_fn(|k| (place_px[k] - self.centre_px[k]) / self.focal_px[k]))
    }

    /// Where in the image a point in front of the camera is seen, pixels, also beside the image; `None` for what is
    /// not in front.
    pub fn place_of(&self, point_in_camera_m: Point3<f64>) -> Option<[f64; 2]> {
        let z = point_in_camera_m.z;
        if z <= 0.0 {
            return None;
        }
        let seen = self.distortion.done([point_in_camera_m.x / z, point_in_camera_m.y / z]);
        Some(std::array::from_fn(|k| self.focal_px[k] * seen[k] + self.centre_px[k]))
    }

    /// The bearings of all pixels, row by row. `O(pixels)`, and as many pairs of numbers.
    pub fn bearings(&self) -> PixelBearings {
        let [width, height] = self.size_px;
        let pixels = (0..height).flat_map(|row| (0..width).map(move |column| [column, row]));
        let slopes = pixels.map(|pixel| self.slopes_at(pixel.map(f64::from)));
        PixelBearings { slopes: slopes.map(|slopes| slopes.unwrap_or([f64::NAN; 2])).collect() }
    }
}

/// The bearings of a camera's pixels: what makes points of a depth image.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelBearings {
    /// x / z and y / z, row by row; NaN where a pixel has no bearing.
    slopes: Vec<[f64; 2]>,
}

impl PixelBearings {
    /// Pixels of an image.
    pub fn len(&self) -> usize {
        self.slopes.len()
    }

    /// Whether there are none, which no camera has.
    pub fn is_empty(&self) -> bool {
        self.slopes.is_empty()
    }

    /// x / z and y / z of the `pixel`-th, row by row.
    ///
    /// # Panics
    /// Where there is no such pixel.
    #[inline]
    pub fn slopes(&self, pixel: usize) -> [f64; 2] {
        self.slopes[pixel]
    }

    /// The point that the `pixel`-th pixel sees at `depth_m` along the optical axis, camera frame, metres: its z *is*
    /// that depth. A depth of 0 is "nothing seen" and gives (0, 0, 0), no return.
    ///
    /// # Panics
    /// Where there is no such pixel.
    #[inline]
    pub fn point(&self, pixel: usize, depth_m: f32) -> [f32; 3] {
        if depth_m == 0.0 {
            return [0.0; 3];
        }
        let [x, y] = self.slopes[pixel].map(|slope| (slope * f64::from(depth_m)) as f32);
        [x, y, depth_m]
    }
}

/// What a depth camera's own number is to a range: depth = range · this, the cosine between the bearing of a point
/// and the optical axis. So a residual in depth is one in range times this, for both lie on the same ray.
#[inline]
pub fn depth_per_range(point_in_camera_m: [f32; 3]) -> f64 {
    let point = Point3::from(point_in_camera_m.map(f64::from));
    point.z / point.coords.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// `freiburg1` of TUM RGB-D.
    fn freiburg1() -> PinholeCamera {
        let lens = Distortion { radial: [0.2624, -0.9531, 1.1633], tangential: [-0.0054, 0.0026] };
        PinholeCamera::new([640, 480], [517.3, 516.5], [318.6, 255.3], lens).unwrap()
    }

    /// ICL-NUIM: y goes up.
    fn icl() -> PinholeCamera {
        PinholeCamera::new([640, 480], [481.2, -480.0], [319.5, 239.5], Distortion::NONE).unwrap()
    }

    #[test]
    fn pixels_lie_where_the_formula_says() {
        let camera = icl();
        assert_eq!(camera.slopes_at([319.5, 239.5]), Some([0.0, 0.0]));
        assert_eq!(camera.slopes_at([0.0, 0.0]), Some([-319.5 / 481.2, 239.5 / 480.0]));
        let bearings = camera.bearings();
        assert_eq!(bearings.len(), 640 * 480);
        assert_eq!(bearings.slopes(640 * 2 + 5), camera.slopes_at([5.0, 2.0]).unwrap());
        assert_eq!(bearings.point(7, 0.0), [0.0; 3]);
        assert_eq!(bearings.point(7, 1.2345)[2], 1.2345);
        assert!(camera.place_of(Point3::new(0.1, 0.2, -1.0)).is_none());
    }

    #[test]
    fn numbers_that_make_no_camera_are_refused() {
        let of = |size, focal, centre, lens| {
            PinholeCamera::new(size, focal, centre, lens).unwrap_err().to_string()
        };
        let none = Distortion::NONE;
        assert!(of([0, 480], [1.0; 2], [0.0; 2], none).starts_with("an image of 0 x 480"));
        assert!(of([5000, 4000], [1.0; 2], [0.0; 2], none).contains("it must have 1 to 16777216 in all"));
        assert!(of([640, 480], [525.0, 0.0], [0.0; 2], none).contains("525 and 0 pixels"));
        assert!(of([640, 480], [525.0, 525.0], [f64::NAN, 1.0], none).starts_with("a centre of NaN"));
        let lens = Distortion { radial: [0.0, f64::INFINITY, 0.0], ..none };
        assert!(of([640, 480], [525.0, 525.0], [0.0; 2], lens).starts_with("a distortion of inf"));
    }

    proptest! {
        #[test]
        fn a_pixel_is_seen_where_its_bearing_points(
            column in 0..640u32, row in 0..480u32, depth_m in 0.1..20.0f32, which in 0..2usize,
        ) {
            let camera = [freiburg1(), icl()][which];
            let slopes = camera.slopes_at([column, row].map(f64::from)).unwrap();
            let depth = f64::from(depth_m);
            let [u, v] = camera.place_of(Point3::new(slopes[0] * depth, slopes[1] * depth, depth)).unwrap();
            prop_assert!((u - f64::from(column)).abs() < 1e-8 && (v - f64::from(row)).abs() < 1e-8, "{u} {v}");
        }

        #[test]
        fn depth_and_range_are_one_ray(column in 0..640u32, row in 0..480u32, depth_m in 0.1..20.0f32, off_m in -1.0..1.0f64) {
            let camera = freiburg1();
            let point = camera.bearings().point((row * 640 + column) as usize, depth_m);
            let range_m = Point3::from(point.map(f64::from)).coords.norm();
            prop_assert!((range_m * depth_per_range(point) - f64::from(depth_m)).abs() < 1e-12);
            // A surface met so much further along the ray.
            let met = Point3::from(point.map(f64::from)) * ((range_m + off_m) / range_m);
            prop_assert!((met.z - f64::from(depth_m) - off_m * depth_per_range(point)).abs() < 1e-12);
        }
    }
}
