//! Scans as rows of float32 with the heads that go before them.

use dmp_sensor::Scan;
use std::io::Write as _;

/// KITTI: x, y, z, intensity.
pub(super) fn bin(scan: &Scan, bytes: &mut Vec<u8>) {
    for point in &scan.points_in_sensor_m {
        bytes.extend_from_slice(point.map(f32::to_le_bytes).as_flattened());
        bytes.extend_from_slice(&0_f32.to_le_bytes());
    }
}

/// PCD version 0.7.
pub(super) fn pcd(scan: &Scan, timed: bool, bytes: &mut Vec<u8>) {
    let [fields, sizes, types, counts] = if timed {
        ["x y z t", "4 4 4 4", "F F F U", "1 1 1 1"]
    } else {
        ["x y z", "4 4 4", "F F F", "1 1 1"]
    };
    let points = scan.len();
    // Writing to bytes cannot fail.
    let _ = write!(
        bytes,
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\n\
         COUNT {counts}\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary\n"
    );
    rows(scan, timed, bytes);
}

/// PLY, little-endian.
pub(super) fn ply(scan: &Scan, timed: bool, bytes: &mut Vec<u8>) {
    let time = if timed { "property uint t\n" } else { "" };
    let _ = write!(
        bytes,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\n{time}end_header\n",
        scan.len()
    );
    rows(scan, timed, bytes);
}

fn rows(scan: &Scan, timed: bool, bytes: &mut Vec<u8>) {
    if !timed {
        bytes.extend(scan.points_in_sensor_m.iter().flatten().flat_map(|c| c.to_le_bytes()));
        return;
    }
    for (point, &offset_ns) in scan.points_in_sensor_m.iter().zip(&scan.time_offsets_ns) {
        let [x, y, z] = point.map(f32::to_le_bytes);
        bytes.extend_from_slice([x, y, z, (offset_ns as u32).to_le_bytes()].as_flattened());
    }
}
