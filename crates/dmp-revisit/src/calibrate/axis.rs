//! What is looked for: an error of time, one of mounting, and whether returns have times of their own.

use nalgebra::{SMatrix, SVector};

/// How many numbers are looked for together.
pub(crate) const AXES: usize = 8;

pub(crate) type Vector = SVector<f64, AXES>;
pub(crate) type Matrix = SMatrix<f64, AXES, AXES>;

/// One of the numbers that are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Clock offset: the poses hold this much later than their stamps say, seconds: what to add to the log's stamps.
    Time,
    /// How much of the returns' own times is true: 1 where the scan is as it was measured, 0 where its points were
    /// already brought to one instant.
    Sweep,
    /// The sensor is turned about its own x axis, radians.
    Roll,
    /// About its y axis, radians.
    Pitch,
    /// About its z axis, radians.
    Yaw,
    /// The sensor sits further along its own x axis, metres.
    X,
    /// Along its y axis, metres.
    Y,
    /// Along its z axis, metres.
    Z,
}

impl Axis {
    /// All, in the order of a [`Calibration`](crate::calibrate::Calibration).
    pub const ALL: [Self; AXES] =
        [Self::Time, Self::Sweep, Self::Roll, Self::Pitch, Self::Yaw, Self::X, Self::Y, Self::Z];

    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Sweep => "sweep",
            Self::Roll => "roll",
            Self::Pitch => "pitch",
            Self::Yaw => "yaw",
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// What it is where nothing is off.
    pub fn as_given(self) -> f64 {
        if self == Self::Sweep { 1.0 } else { 0.0 }
    }

    /// What a unit of it is in the search, so that one of each moves points by about as much.
    pub(crate) fn step(self, metre_m: f64) -> f64 {
        match self {
            Self::Time => 0.01,
            Self::Sweep => 0.1,
            Self::Roll | Self::Pitch | Self::Yaw => 0.1_f64.to_radians(),
            Self::X | Self::Y | Self::Z => 0.01 * metre_m,
        }
    }

    /// How far off it may be before anything is known, as a standard deviation in such units: what the scans do not show
    /// stays as wide as this.
    pub(crate) fn prior_steps(self) -> f64 {
        match self {
            // 0.2 s; from a whole sweep to none; 3°; 1 m.
            Self::Time => 20.0,
            Self::Sweep => 10.0,
            Self::Roll | Self::Pitch | Self::Yaw => 30.0,
            Self::X | Self::Y | Self::Z => 100.0,
        }
    }

    /// An interval wider than this to either side, in such units, is no answer: 20 ms, 0.3, 0.5°, 10 cm.
    pub(crate) fn seen_within_steps(self) -> f64 {
        match self {
            Self::Time => 2.0,
            Self::Sweep => 3.0,
            Self::Roll | Self::Pitch | Self::Yaw => 5.0,
            Self::X | Self::Y | Self::Z => 10.0,
        }
    }

    /// Less than this, in such units, is not worth a word: 2 ms, 0.3, 0.05°, 1 cm.
    pub(crate) fn worth_steps(self) -> f64 {
        match self {
            Self::Time => 0.2,
            Self::Sweep => 3.0,
            Self::Roll | Self::Pitch | Self::Yaw => 0.5,
            Self::X | Self::Y | Self::Z => 1.0,
        }
    }
}
