//! The ground that things stand on, whatever it is made of.

/// The ground that something stands on.
pub(crate) trait Relief {
    /// Height at a place, metres.
    fn height_m(&self, x: f64, y: f64) -> f64;
}
