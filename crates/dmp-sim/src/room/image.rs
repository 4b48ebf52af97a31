//! A depth image.

/// A depth image, as cameras write them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DepthImage {
    /// When it was taken, nanoseconds.
    pub stamp_ns: i64,
    /// Depths along the optical axis, row by row, in the units of the recording; 0 where nothing was measured.
    pub units: Vec<u16>,
}

impl DepthImage {
    /// Depths in metres, rounded to units; 0 for what is not finite or beyond the largest number.
    pub(super) fn new(stamp_ns: i64, depths_m: impl Iterator<Item = f64>, units_per_m: f64) -> Self {
        let unit = |depth_m: f64| {
            let units = libm::round(depth_m * units_per_m);
            if (0.0..=f64::from(u16::MAX)).contains(&units) { units as u16 } else { 0 }
        };
        Self { stamp_ns, units: depths_m.map(unit).collect() }
    }

    /// Pixels that measured something.
    pub fn valid(&self) -> usize {
        self.units.iter().filter(|units| **units > 0).count()
    }
}
