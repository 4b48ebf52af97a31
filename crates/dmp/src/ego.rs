//! What is known of the vehicle.

/// What is known of the vehicle that carries the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Ego {
    /// Looked for in a sample of scans.
    Auto,
    /// There is none in view.
    None,
    /// A box in the sensor frame, smallest and largest corner in millimetres.
    BoxMm([i64; 3], [i64; 3]),
}
