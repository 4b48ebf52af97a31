//! What a LiDAR is like.

use std::f64::consts::PI;

use crate::error::{SimError, require};

/// What a scan holds where nothing came back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum NoReturn {
    /// No point at all.
    #[default]
    Omitted,
    /// The point (0, 0, 0).
    Zero,
    /// A point of NaNs.
    NotANumber,
}

impl NoReturn {
    /// The point, sensor frame, metres; `None` for none.
    pub(crate) fn point(self) -> Option<[f32; 3]> {
        match self {
            Self::Omitted => None,
            Self::Zero => Some([0.0; 3]),
            Self::NotANumber => Some([f32::NAN; 3]),
        }
    }
}

/// When the points of a sweep are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Sweep {
    /// One firing after the other while the sensor moves; each return has its own time and lies in the
    /// sensor frame of that instant.
    #[default]
    Spinning,
    /// All at the stamp, as if the sensor stood still: for formats without times of their own for points.
    Instant,
}

/// What a multi-beam spinning [`Lidar`](crate::Lidar) is like.
#[derive(Debug, Clone, PartialEq)]
pub struct LidarOptions {
    /// Seed of the noise and the random drop-outs.
    pub seed: u64,
    /// Number of beams, one above the other.
    pub beams: usize,
    /// Elevation of the lowest and the highest beam, radians; the others lie evenly between.
    pub elevation_rad: [f64; 2],
    /// Firings in one turn; each fires all beams at once.
    pub azimuth_steps: usize,
    /// Turns per second. Every turn is a scan.
    pub rate_hz: f64,
    /// Range of the farthest return of a bright surface (0.8) seen straight on, metres. Darker ones and those
    /// seen at a grazing angle are lost earlier: the light that comes back falls with the square of the range.
    pub max_range_m: f64,
    /// Range of the nearest return, metres.
    pub min_range_m: f64,
    /// Standard deviation of the measured range, metres.
    pub range_noise_m: f64,
    /// Standard deviation of the reported bearing against the true direction of firing, radians, along each
    /// of the two axes across it: what is left of an imperfect calibration and encoder. Drawn per return.
    pub bearing_noise_rad: f64,
    /// Share of the returns that get lost for no reason.
    pub drop_out: f64,
    /// Coordinates are rounded to multiples of this, metres; 0 for none. A power of two keeps files small.
    pub resolution_m: f64,
    /// What stands in for a return that did not come.
    pub no_return: NoReturn,
    /// When the points are measured.
    pub sweep: Sweep,
}

impl LidarOptions {
    /// A common sensor with that many beams: ± 15° for 16 beams or fewer, −25° to 15° for more.
    pub fn with_beams(beams: usize) -> Self {
        let lowest_deg: f64 = if beams <= 16 { -15.0 } else { -25.0 };
        Self {
            seed: 1,
            beams,
            elevation_rad: [lowest_deg.to_radians(), 15_f64.to_radians()],
            azimuth_steps: 900,
            rate_hz: 10.0,
            max_range_m: 100.0,
            min_range_m: 0.5,
            range_noise_m: 0.02,
            bearing_noise_rad: 0.0,
            drop_out: 0.01,
            resolution_m: 1.0 / 512.0,
            no_return: NoReturn::Omitted,
            sweep: Sweep::Spinning,
        }
    }

    /// Refuses what no sensor can be.
    pub(crate) fn check(&self) -> Result<(), SimError> {
        let LidarOptions { beams, azimuth_steps, elevation_rad: [low, high], .. } = *self;
        require((1..=1024).contains(&beams), "the number of beams", "from 1 to 1024", beams as f64)?;
        let steps = (4..=100_000).contains(&azimuth_steps);
        require(steps, "the number of azimuth steps", "from 4 to 100000", azimuth_steps as f64)?;
        let upright = -PI / 2.0 < low && high < PI / 2.0;
        require(
            upright && low <= high,
            "the lowest elevation in rad",
            "below the highest, within ±π/2",
            low,
        )?;
        require(
            (0.01..=1000.0).contains(&self.rate_hz),
            "the rate in Hz",
            "from 0.01 to 1000",
            self.rate_hz,
        )?;
        let range = self.max_range_m > self.min_range_m && self.max_range_m <= 1000.0;
        require(range, "the largest range in m", "above the smallest, up to 1000", self.max_range_m)?;
        require(self.min_range_m >= 0.0, "the smallest range in m", "0 or more", self.min_range_m)?;
        let noise = (0.0..=10.0).contains(&self.range_noise_m);
        require(noise, "the range noise in m", "from 0 to 10", self.range_noise_m)?;
        let noise = (0.0..=0.1).contains(&self.bearing_noise_rad);
        require(noise, "the bearing noise in rad", "from 0 to 0.1", self.bearing_noise_rad)?;
        require(
            (0.0..=1.0).contains(&self.drop_out),
            "the share of drop-outs",
            "from 0 to 1",
            self.drop_out,
        )?;
        let resolution = (0.0..=1.0).contains(&self.resolution_m);
        require(resolution, "the resolution in m", "from 0 to 1", self.resolution_m)
    }
}
