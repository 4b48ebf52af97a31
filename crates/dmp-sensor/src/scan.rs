//! One sweep of the sensor.

/// One sweep of the sensor: what it measured, in its own frame.
///
/// The ray of every return starts at the sensor's origin (0, 0, 0). Readers reuse a scan's buffers:
/// [`Scan::clear`] keeps the allocations.
///
/// ```
/// use dmp_sensor::Scan;
///
/// let scan = Scan {
///     stamp_ns: Some(1_700_000_000_000_000_000),
///     points_in_sensor_m: vec![[4.0, 3.0, 0.5], [f32::NAN; 3]],
///     time_offsets_ns: vec![0, 50_000_000],
/// };
/// assert_eq!(scan.len(), 2);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scan {
    /// The instant the scan's times count from, nanoseconds; `None` where the log has no stamps.
    pub stamp_ns: Option<i64>,
    /// Returns as the log has them, metres in the sensor frame; NaN and zero rows included.
    pub points_in_sensor_m: Vec<[f32; 3]>,
    /// Time of each return after `stamp_ns`, nanoseconds; as long as `points_in_sensor_m`, or empty
    /// where the log has no times of its own for the returns.
    pub time_offsets_ns: Vec<i64>,
}

impl Scan {
    /// Forgets the contents, keeps the buffers.
    pub fn clear(&mut self) {
        self.stamp_ns = None;
        self.points_in_sensor_m.clear();
        self.time_offsets_ns.clear();
    }

    /// Number of returns, used or not.
    pub fn len(&self) -> usize {
        self.points_in_sensor_m.len()
    }

    /// Whether the scan has no returns at all.
    pub fn is_empty(&self) -> bool {
        self.points_in_sensor_m.is_empty()
    }
}
