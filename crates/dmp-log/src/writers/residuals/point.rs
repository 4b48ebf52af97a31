//! A scored return and a scored scan, and the columns that are written of them.

use crate::geometry::cloud::table::{Column, Number};
use dmp_sensor::Isometry3;

/// A return with what a map predicts for it. Lengths are metres; NaN stands for a prediction that there is not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoredPoint {
    /// Where the return lies in the world of the run.
    pub point_in_world_m: [f64; 3],
    /// The measured range minus the predicted one.
    pub signed_residual_m: f32,
    /// The predicted range.
    pub map_range_m: f32,
    /// The measured range.
    pub range_m: f32,
    /// The measured range minus that of the first surfel on the ray.
    pub first_residual_m: f32,
    /// The measured range minus that of the surfel on the ray nearest to the return.
    pub nearest_residual_m: f32,
    /// When it was measured, seconds after the stamp of the log's first scan; of a log without stamps, after the
    /// beginning of its scan.
    pub time_s: f64,
    /// The number of the scan in the log, from 0.
    pub frame: i32,
    /// What the ray meets first: 0 nothing, 1 a surfel at the return, 2 one in front of it, 3 one behind it.
    pub kind: u8,
    /// Whether the place is predicted from another visit.
    pub revisited: bool,
}

const fn column(name: &'static str, number: Number, about: &'static str) -> Column {
    Column { names: ["", name, name], number, about }
}

/// The columns beside the place, in the order in which they stand in every format. `CloudCompare` takes properties of
/// PLY for scalar fields where their names begin with `scalar_`, leaves that away, and shows the first.
pub(super) const COLUMNS: [Column; 10] = {
    use Number::{F32, F64, I32, U8};
    [
        column("residual_m", F32, "|measured - predicted range|"),
        column("signed_residual_m", F32, "measured - predicted range"),
        column("map_range_m", F32, "predicted range"),
        column("range_m", F32, "measured range"),
        column("first_residual_m", F32, "measured - first surfel's range"),
        column("nearest_residual_m", F32, "measured - nearest surfel's"),
        column("time_s", F64, "seconds after the first scan"),
        column("frame", I32, "number of the scan"),
        column("kind", U8, "0 miss 1 hit 2 blocked 3 beyond"),
        column("revisited", U8, "seen on another visit"),
    ]
};

/// Bytes of all columns.
pub(super) const COLUMN_BYTES: usize = 38;

impl ScoredPoint {
    /// Bytes of [`Self::to_bytes`].
    pub const BYTES: usize = 24 + COLUMN_BYTES;

    /// The point as a row of bytes: what PLY and PCD have of it.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let lengths = [
            self.signed_residual_m.abs(),
            self.signed_residual_m,
            self.map_range_m,
            self.range_m,
            self.first_residual_m,
            self.nearest_residual_m,
        ];
        let mut row = [0; Self::BYTES];
        row[..24].copy_from_slice(self.point_in_world_m.map(f64::to_le_bytes).as_flattened());
        row[24..48].copy_from_slice(lengths.map(f32::to_le_bytes).as_flattened());
        row[48..56].copy_from_slice(&self.time_s.to_le_bytes());
        row[56..60].copy_from_slice(&self.frame.to_le_bytes());
        row[60] = self.kind;
        row[61] = u8::from(self.revisited);
        row
    }

    /// The point of such a row.
    pub fn of_bytes(row: &[u8; Self::BYTES]) -> Self {
        let long = |at: usize| f64::from_le_bytes(std::array::from_fn(|k| row[at + k]));
        let short = |at: usize| f32::from_le_bytes(std::array::from_fn(|k| row[at + k]));
        Self {
            point_in_world_m: [0, 8, 16].map(long),
            signed_residual_m: short(28),
            map_range_m: short(32),
            range_m: short(36),
            first_residual_m: short(40),
            nearest_residual_m: short(44),
            time_s: long(48),
            frame: i32::from_le_bytes(std::array::from_fn(|k| row[56 + k])),
            kind: row[60],
            revisited: row[61] != 0,
        }
    }
}

/// A scan whose returns were scored.
#[derive(Debug, Clone, Copy)]
pub struct ScoredScan {
    /// Its stamp, nanoseconds; MCAP needs one.
    pub stamp_ns: Option<i64>,
    /// The pose of the sensor at that instant.
    pub world_from_sensor: Isometry3<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_as_its_columns_say() {
        assert_eq!(COLUMNS.iter().map(|column| column.number.bytes()).sum::<usize>(), COLUMN_BYTES);
        assert!(COLUMNS.iter().all(|column| column.names[2].len() <= 32 && column.about.len() <= 32));
        let point = ScoredPoint {
            point_in_world_m: [500_000.125, -4_000_000.5, 7.25],
            signed_residual_m: -0.5,
            map_range_m: 10.5,
            range_m: 10.0,
            first_residual_m: 1.5,
            nearest_residual_m: -0.25,
            time_s: 12.345,
            frame: 70_000,
            kind: 2,
            revisited: true,
        };
        assert_eq!(ScoredPoint::of_bytes(&point.to_bytes()), point);
        let row = point.to_bytes();
        let number = |at: usize| f32::from_le_bytes(*row[24 + at..].first_chunk().unwrap());
        assert_eq!([0, 4, 8, 12, 16, 20].map(number), [0.5, -0.5, 10.5, 10.0, 1.5, -0.25]);
        assert_eq!(row[24 + 36..], [2, 1]);
    }
}
