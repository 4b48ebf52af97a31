//! The vehicle's own returns.

/// Where the vehicle that carries the sensor is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Ego {
    /// Detected in a sample of scans.
    Auto,
    /// Not in view.
    None,
    /// A box in the sensor frame, smallest and largest corner in millimetres.
    BoxMm([i64; 3], [i64; 3]),
}
