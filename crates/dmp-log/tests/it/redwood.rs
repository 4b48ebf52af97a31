//! Redwood's `.log` trajectories.

use crate::common::assert_says;
use dmp_log::{
    TrajectoryFormat, parse_raw, parse_redwood_log, read_raw_trajectory, read_trajectory, write_redwood_log,
};
use dmp_sensor::{Isometry3, Trajectory, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::fs;

const TWO: &str = "0\t0\t1\r\n1 0 0 -2.25\r\n0 1 0 0\r\n0 0 1 0.5\r\n0 0 0 1\r\n1 1 2\n0 -1 0 1.0e+00\n1 0 0 2\n0 0 1 3\n0 0 0 1\n";

#[test]
fn it_is_told_by_its_first_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("livingroom1-traj.txt");
    fs::write(&path, TWO).unwrap();
    let read = read_trajectory(&path).unwrap();
    assert_eq!((read.format, read.trajectory.len()), (TrajectoryFormat::RedwoodLog, 2));
    assert_says(&read.notes.join("; "), &["no stamps: the n-th pose belongs to the n-th scan"]);
    let [first, second] = read.trajectory.poses() else { panic!("two poses") };
    assert_eq!(first.translation.vector, Vector3::new(-2.25, 0.0, 0.5));
    let quarter = UnitQuaternion::from_scaled_axis(Vector3::z() * std::f64::consts::FRAC_PI_2);
    assert!(second.rotation.angle_to(&quarter) < 1e-12);
    let raw = read_raw_trajectory(&path, None).unwrap();
    assert_eq!((raw.rotations[1][(0, 1)], raw.positions_m[1][2], raw.stamps_s), (-1.0, 3.0, None));
    fs::write(folder.path().join("times.txt"), "1.5\n2.5\n").unwrap();
    assert_eq!(
        read_trajectory(&path).unwrap().trajectory.stamps_ns(),
        Some(&[1_500_000_000, 2_500_000_000][..])
    );
    assert_eq!("redwood".parse(), Ok(TrajectoryFormat::RedwoodLog));
}

/// ICL-NUIM's truth has whole numbers for stamps.
#[test]
fn whole_numbers_for_stamps_are_tum() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("livingRoom2.gt.freiburg");
    fs::write(&path, "1 0 0 -2.25 0 0 0 1\n2 0.000466347 0.00895357 -2.24935 -0.00101358 0.00052453 -0.000231475 0.999999\n3 0 0 -2 0 0 0 1\n").unwrap();
    let read = read_trajectory(&path).unwrap();
    assert_eq!(read.format, TrajectoryFormat::Tum);
    assert_eq!(read.trajectory.stamps_ns(), Some(&[1, 2, 3].map(|s| s * 1_000_000_000)[..]));
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let row = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    for (text, said) in [
        (
            "0 0 1\n1 0 0 0\n0 1 0 0\n".to_owned(),
            "line 1: the pose that begins here has 2 of 4 rows: is the file cut?",
        ),
        (format!("0 0 1\n{row}1 1 2\n"), "line 6: the pose that begins here has 0 of 4 rows"),
        (format!("0 0 1\n{row}1 1 2\n1 0 0\n"), "line 7: 3 columns, expected 4"),
        (format!("0 0 1\n{row}1 1\n{row}"), "line 6: `1 1` begins no pose"),
        (format!("0 0 1\n{row}{row}"), "line 6: `1 0 0 0` begins no pose"),
        (
            format!("0 0 1\n{}", row.replace("0 0 0 1", "0 0 0 2")),
            "line 5: the last row is [0.0, 0.0, 0.0, 2.0]",
        ),
        (format!("0 0 1\n{}", row.replace("0 1 0 0", "0 2 0 0")), "line 2: the 3 x 3 part is no rotation"),
        (format!("0 0 1\n{}", row.replace("0 0 1 0", "0 0 -1 0")), "line 2: the 3 x 3 part is a reflection"),
        (format!("0 0 1\n{}", row.replace("0 1 0 0", "0 1 0 nan")), "line 3: `nan` is not finite"),
        (format!("0 0 1\n{}", row.replace("0 1 0 0", "0 1 0 x")), "line 3: `x` is not a number"),
        (format!("0 0 1\n{}", row.replace("0 1 0 0", "0 1 0 1e9")), "from the origin"),
    ] {
        assert_says(&parse_redwood_log(text.as_bytes()).unwrap_err().to_string(), &[said]);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.log");
    fs::write(&path, "0 0 1\n1 0 0 0\n").unwrap();
    assert_says(
        &read_trajectory(&path).unwrap_err().to_string(),
        &["a.log: line 1: the pose", "1 of 4 rows"],
    );
    fs::write(&path, "1 2 3.5\n").unwrap();
    assert_says(&read_trajectory(&path).unwrap_err().to_string(), &["3 columns", "nor Redwood"]);
}

#[test]
fn what_is_written_is_read_again() {
    let pose = |k: i64| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.1 * k as f64, 1.0));
        Isometry3::from_parts(Translation3::new(0.1 * k as f64, -4.0, 1.0 / 3.0), turn)
    };
    let run = Trajectory::unstamped((0..30).map(pose).collect()).unwrap();
    let mut text = Vec::new();
    write_redwood_log(&mut text, &run).unwrap();
    assert!(text.starts_with(b"0 0 1\n"));
    let read = parse_redwood_log(&text).unwrap();
    assert_eq!(read.len(), 30);
    for (a, b) in read.poses().iter().zip(run.poses()) {
        assert_eq!(a.translation, b.translation);
        assert!(a.rotation.angle_to(&b.rotation) < 1e-7);
    }
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..100), at in 0..200usize, cut in 0..200usize) {
        let _ = parse_redwood_log(&bytes);
        let mut text = TWO.as_bytes().to_vec();
        for (there, byte) in text.iter_mut().skip(at).zip(bytes.iter().take(3)) {
            *there = *byte;
        }
        text.truncate(cut);
        let _ = parse_redwood_log(&text);
        let _ = parse_raw(&text, TrajectoryFormat::RedwoodLog);
    }
}
