//! What errors and the distances of pairs are counted in.

/// What errors are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorUnit {
    /// A norm of a matrix.
    None,
    /// Millimetres.
    Millimeters,
    /// Centimetres.
    Centimeters,
    /// Metres.
    Meters,
    /// Kilometres.
    Kilometers,
    /// Degrees.
    Degrees,
    /// Radians.
    Radians,
    /// Percent.
    Percent,
}

impl ErrorUnit {
    /// As it is printed.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "unit-less",
            Self::Millimeters => "mm",
            Self::Centimeters => "cm",
            Self::Meters => "m",
            Self::Kilometers => "km",
            Self::Degrees => "deg",
            Self::Radians => "rad",
            Self::Percent => "%",
        }
    }

    pub(super) fn meters(self) -> Option<f64> {
        match self {
            Self::Millimeters => Some(1e-3),
            Self::Centimeters => Some(1e-2),
            Self::Meters => Some(1.0),
            Self::Kilometers => Some(1e3),
            _ => None,
        }
    }
}

/// What the distance of a pair is counted in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DeltaUnit {
    /// Lines of the trajectory.
    #[default]
    Frames,
    /// Metres of path length.
    Meters,
    /// Degrees of turn.
    Degrees,
    /// Radians of turn.
    Radians,
}

impl DeltaUnit {
    /// As it is printed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Frames => "frames",
            Self::Meters => "m",
            Self::Degrees => "deg",
            Self::Radians => "rad",
        }
    }
}
