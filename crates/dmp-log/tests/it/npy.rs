//! Arrays of poses: files that `NumPy` wrote (`tests/data`), and files that it would not write.

use crate::common::{assert_says, refusals};
use dmp_log::{TrajectoryFormat, parse_kitti, parse_npy, parse_raw, read_raw_trajectory, read_trajectory};
use dmp_sensor::Trajectory;
use std::fs;
use std::path::{Path, PathBuf};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// A file with any header, and data of f64.
pub(crate) fn npy(header: &str, data: &[f64]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    let text = format!("{header:<117}\n");
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.extend(data.iter().flat_map(|number| number.to_le_bytes()));
    bytes
}

pub(crate) const IDENTITY: [f64; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

const HEADER: &str = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 4, 4), }";

fn error_of(bytes: &[u8]) -> String {
    parse_npy(bytes).unwrap_err().to_string()
}

#[test]
fn what_numpy_writes_is_read_in_every_order_and_type() {
    // The same three poses, written as text by NumPy.
    let text = fs::read(data("poses.txt")).unwrap();
    let poses = parse_kitti(&text).unwrap();
    let raw = parse_raw(&text, TrajectoryFormat::Kitti).unwrap();
    for (name, tolerance) in
        [("c_f8.npy", 1e-15), ("fortran_f4.npy", 1e-6), ("big_endian_f8.npy", 1e-15), ("version_3.npy", 1e-6)]
    {
        let read = read_trajectory(&data(name)).unwrap();
        assert_eq!((read.format, read.trajectory.len()), (TrajectoryFormat::Npy, 3), "{name}");
        assert_says(&read.notes.join("; "), &["n-th pose"]);
        for (a, b) in read.trajectory.poses().iter().zip(poses.poses()) {
            assert_eq!(a.translation, b.translation, "{name}");
            assert!(a.rotation.angle_to(&b.rotation) < 1e-7_f64.max(tolerance), "{name}: {a} {b}");
        }
        let read = read_raw_trajectory(&data(name), None).unwrap();
        assert_eq!((read.stamps_s, &read.positions_m), (None, &raw.positions_m));
        for (a, b) in read.rotations.iter().zip(&raw.rotations) {
            assert!((a - b).amax() <= tolerance, "{name}: {a} {b}");
        }
    }
}

#[test]
fn stamps_come_from_times_txt_as_with_kitti() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.npy");
    fs::copy(data("c_f8.npy"), &path).unwrap();
    let beside = |times: &str| {
        fs::write(folder.path().join("times.txt"), times).unwrap();
        read_trajectory(&path)
    };
    assert_eq!(
        beside("0\n1e-1\n0.2\n").unwrap().trajectory.stamps_ns(),
        Some(&[0, 100_000_000, 200_000_000][..])
    );
    assert_says(&beside("0\nx\n0.2\n").unwrap_err().to_string(), &["times.txt: line 2: ", "`x`"]);
}

#[test]
fn headers_are_read_as_python_reads_them() {
    let one = parse_npy(&npy(HEADER, &IDENTITY)).unwrap();
    assert_eq!(one, Trajectory::unstamped(vec![dmp_sensor::Isometry3::identity()]).unwrap());
    for header in [
        "{'shape': (1L, 4L, 4L), 'descr': '<f8', 'fortran_order': False}",
        "{\"descr\": \"<f8\",\"fortran_order\":True,\"shape\":(1,4,4,)}",
        " { 'descr' : '<f8' , 'fortran_order' : False , 'shape' : ( 1 , 4 , 4 ) , } ",
    ] {
        assert_eq!(parse_npy(&npy(header, &IDENTITY)), Ok(one.clone()), "{header}");
    }
}

#[test]
fn other_arrays_are_refused() {
    let of = |rest: &str| format!("{{'descr': '<f8', 'fortran_order': False, {rest}");
    refusals(
        |header| error_of(&npy(header, &IDENTITY)),
        "byte 10: ",
        &[
            ("{'descr': '|O', 'fortran_order': False, 'shape': (1, 4, 4), }", "'|O' | float64 or float32"),
            ("{'descr': '<i8', 'fortran_order': False, 'shape': (1, 4, 4), }", "'<i8'"),
            ("{'descr': [('x', '<f8')], 'fortran_order': False, 'shape': (1, 4, 4), }", "descr"),
            ("{'descr': '<f8', 'fortran_order': maybe, 'shape': (1, 4, 4), }", "maybe"),
            ("{'descr': '<f8' 'fortran_order': False, 'shape': (1, 4, 4), }", "no comma after `descr`"),
            (&of("'shape': (16,), }"), "(16,) | N x 4 x 4"),
            (&of("'shape': (), }"), "shape ()"),
            (&of("'shape': (1, 4, 3), }"), "(1, 4, 3)"),
            (&of("'shape': (-1, 4, 4), }"), "(-1, 4, 4)"),
            (&of("}"), "not all of"),
            (&of("'descr': '<f8', 'shape': (1, 4, 4), }"), "`descr` twice"),
            (&of("'shape': (1, 4, 4), 'more': 1}"), "`more`"),
            (&of("'shape': (1, 4, 4"), "no dictionary"),
            ("", "no dictionary"),
        ],
    );
    let with = |at: usize, byte: u8| {
        let mut bytes = npy(HEADER, &IDENTITY);
        bytes[at] = byte;
        error_of(&bytes)
    };
    for (at, byte, parts) in [
        (0, b'x', &["byte 0", "no .npy file", "78, 4e"][..]),
        (6, 4, &["byte 6", "version 4.0"]),
        (7, 1, &["version 1.1"]),
        (9, 0xff, &["byte 10", "65,398 bytes in a file of 256"]),
        (20, 0xff, &["not text"]),
    ] {
        assert_says(&with(at, byte), parts);
    }
    assert_says(&error_of(b"\x93NUMPY\x01\x00\x05"), &["byte 9", "ends within its header"]);
}

#[test]
fn the_shape_is_compared_with_the_length_of_the_file() {
    let header =
        |poses: &str| format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({poses}, 4, 4), }}");
    for (poses, parts) in [
        ("2", &["byte 128", "128 bytes of data for 2 poses of 128 bytes", "cut?"][..]),
        ("0", &["128 bytes of data for 0 poses"]),
        // Times 128 this is 0 in 64 bits.
        ("288230376151711744", &["for 288,230,376,151,711,744 poses"]),
        ("18446744073709551615", &["for 18,446,744,073,709,551,615 poses"]),
        ("99999999999999999999", &["shape (99999999999999999999, 4, 4)"]),
    ] {
        assert_says(&error_of(&npy(&header(poses), &IDENTITY)), parts);
    }
    assert_says(&error_of(&npy(&header("0"), &[])), &["no poses"]);
}

#[test]
fn row_18_bad_poses_of_an_array_are_named() {
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 4, 4), }";
    let cases = [
        (3, f64::NAN, &["pose 1", "`NaN` is not finite"][..]),
        (7, f64::INFINITY, &["`inf` is not finite"]),
        (11, 1e9, &["1e9 m from the origin"]),
        (0, -1.0, &["reflection"]),
        (0, 0.0, &["no rotation"]),
        (15, 2.0, &["last row is [0.0, 0.0, 0.0, 2.0]"]),
        (12, f64::NAN, &["`NaN` is not finite"]),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.npy");
    for (at, value, parts) in cases {
        let mut data = [IDENTITY, IDENTITY].concat();
        data[16 + at] = value;
        fs::write(&path, npy(header, &data)).unwrap();
        let error = read_trajectory(&path).unwrap_err().to_string();
        assert_says(&error, &["run.npy: byte 256: pose 1: "]);
        assert_says(&error, parts);
    }
    // Cut within a pose.
    let whole = npy(header, &[IDENTITY, IDENTITY].concat());
    fs::write(&path, &whole[..whole.len() - 9]).unwrap();
    assert_says(&read_trajectory(&path).unwrap_err().to_string(), &["run.npy: byte 128: 247 bytes", "cut?"]);
}
