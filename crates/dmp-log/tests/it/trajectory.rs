use crate::common::{Random, assert_says};
use dmp_log::{
    TrajectoryFormat, parse_euroc, parse_kitti, parse_raw, parse_tum, read_raw_trajectory, read_trajectory,
    write_kitti, write_tum,
};
use dmp_sensor::{Isometry3, Trajectory, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::fs;

fn poses(count: usize) -> Vec<Isometry3<f64>> {
    let mut random = Random(7);
    let mut unit = || (random.next() >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0;
    (0..count)
        .map(|_| {
            let turn = Vector3::new(3.0 * unit(), 3.0 * unit(), 3.0 * unit());
            let place = Translation3::new(5e5 * unit(), 4e6 * unit(), 100.0 * unit());
            Isometry3::from_parts(place, UnitQuaternion::from_scaled_axis(turn))
        })
        .collect()
}

fn assert_near(a: &Trajectory, b: &Trajectory, tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.poses().iter().zip(b.poses()) {
        assert_eq!(a.translation, b.translation);
        assert!(a.rotation.angle_to(&b.rotation) < tolerance, "{a} {b}");
    }
}

#[test]
fn tum_and_kitti_give_back_what_was_written() {
    let stamped = poses(50).into_iter().enumerate();
    let stamped = stamped.map(|(k, pose)| (1_403_636_579_763_555_584 + k as i64 * 99_999_999, pose));
    let run = Trajectory::stamped(stamped.collect()).unwrap().trajectory;
    let mut text = Vec::new();
    write_tum(&mut text, &run).unwrap();
    let read = parse_tum(&text).unwrap();
    assert_eq!(read.trajectory.stamps_ns(), run.stamps_ns());
    assert_near(&read.trajectory, &run, 1e-7);
    assert_eq!((read.out_of_order, read.repeated), (0, 0));

    let run = Trajectory::unstamped(poses(50)).unwrap();
    let mut text = Vec::new();
    write_kitti(&mut text, &run).unwrap();
    assert_near(&parse_kitti(&text).unwrap(), &run, 1e-7);
    let error = write_tum(&mut Vec::new(), &run).unwrap_err();
    assert_says(&error.to_string(), &["needs stamps"]);
}

#[test]
fn people_write_tum_in_many_ways() {
    let text = b"\xef\xbb\xbf# stamp tx ty tz qx qy qz qw\r\n\r\n\
        1.403636579763555584e+09\t1 2 3   0 0 0 1  \r\n\
        \t1403636579.863555584,4,5,6,0,0,0.70710678,0.70710678 # a turn\n\
        +1403636579.963555584 -7e0 +8. .9 0 0 0 -1.05";
    let read = parse_tum(text).unwrap().trajectory;
    let stamps = [1_403_636_579_763_555_584, 1_403_636_579_863_555_584, 1_403_636_579_963_555_584];
    assert_eq!(read.stamps_ns(), Some(&stamps[..]));
    assert_eq!(read.poses()[2].translation, Translation3::new(-7.0, 8.0, 0.9));
    assert!((read.poses()[1].rotation.angle() - std::f64::consts::FRAC_PI_2).abs() < 1e-6);
    assert!(read.poses()[2].rotation.angle() < 1e-12);
}

#[test]
fn broken_tum_lines_are_named() {
    let good = "0.1 1 2 3 0 0 0 1\n";
    let cases = [
        ("0.2 1 2 3 0 0 0", &["7 columns", "8", "cut?"][..]),
        ("0.2 1 2 3 0 0 0 1 9", &["9 columns"]),
        ("0.2 1 2 3 0 0 0 0", &["quaternion (0, 0, 0, 0) is zero"]),
        ("0.2 1 2 3 0 0 0 1.2", &["norm 1.2"]),
        ("0.2 1 2 3 0 0 0 0.5", &["norm 0.5"]),
        ("0.2 1 nan 3 0 0 0 1", &["`nan` is not finite"]),
        ("0.2 1 2 inf 0 0 0 1", &["`inf` is not finite"]),
        ("0.2 1 2 3 0 0 0 1e999", &["`1e999` is not finite"]),
        ("nan 1 2 3 0 0 0 1", &["`nan`"]),
        ("0.2 1 2 3 0 0 zero 1", &["`zero` is not a number"]),
        ("0.2 1 2.0.0 3 0 0 0 1", &["`2.0.0` is not a number"]),
        ("0.2 1e9 2 3 0 0 0 1", &["(1000000000, 2, 3)", "1e9 m"]),
        ("1403636579763555584 1 2 3 0 0 0 1", &["1403636579763555584", "another unit"]),
        ("0.2 1 2 3 0 0 0 \u{221e}", &["`\u{221e}` is not a number"]),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.tum");
    for (line, parts) in cases {
        fs::write(&path, format!("# run\n{good}\n{line}\n")).unwrap();
        let error = read_trajectory(&path).unwrap_err().to_string();
        assert_says(&error, &["run.tum: line 4: "]);
        assert_says(&error, parts);
    }
    fs::write(&path, b"0.1 1 2 3 0 0 0 1\n\xff\xfe 1 2").unwrap();
    assert_says(&read_trajectory(&path).unwrap_err().to_string(), &["run.tum: line 2", "not text: [ff, fe"]);
}

#[test]
fn whole_files_that_are_no_trajectory_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.txt");
    let cases = [
        ("", &["no poses in 0 bytes"][..]),
        ("# only a comment\n\n", &["no poses"]),
        ("a,b\n", &["line 1", "2 columns", "`a`", "TUM", "KITTI"]),
        ("1 0 0 0 0 0 0 1\n1 9 0 0 0 0 0 1\n", &["1000000000 ns", "9.000 m", "two runs"]),
    ];
    for (text, parts) in cases {
        fs::write(&path, text).unwrap();
        let error = read_trajectory(&path).unwrap_err().to_string();
        assert_says(&error, &["run.txt: "]);
        assert_says(&error, parts);
    }
    let gone = read_trajectory(&folder.path().join("gone.tum")).unwrap_err();
    assert!(gone.is_usage());
    assert_says(&gone.to_string(), &["gone.tum", "no such file"]);
    assert!(parse_tum(b"").is_err() && parse_kitti(b"# nothing").is_err());
}

#[test]
fn disorder_is_repaired_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.tum");
    fs::write(&path, "3 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n").unwrap();
    let read = read_trajectory(&path).unwrap();
    assert_eq!(read.format, TrajectoryFormat::Tum);
    assert_eq!((read.out_of_order, read.repeated, read.trajectory.len()), (1, 1, 2));
    assert!(read.fingerprint.starts_with("crc32:"));
}

#[test]
fn kitti_rotations_are_made_exact_or_refused() {
    // Rounded to three digits.
    let rounded = parse_kitti(b"0.707 -0.707 0 1 0.707 0.707 0 2 0 0 1 3\n").unwrap();
    let angle = rounded.poses()[0].rotation.euler_angles().2;
    assert!((angle - std::f64::consts::FRAC_PI_4).abs() < 1e-12);
    let cases = [
        ("1 0 0 0 0 1 0 0 0 0 -1 0", &["reflection", "-1.000"][..]),
        ("1.1 0 0 0 0 1 0 0 0 0 1 0", &["no rotation", "0.210"]),
        ("0 0 0 0 0 0 0 0 0 0 0 0", &["no rotation", "1.000"]),
        ("1 0 0 0 0 1 0 0 0 0 1", &["11 columns"]),
        ("1 0 0 2e8 0 1 0 0 0 0 1 0", &["2e8 m"]),
        ("1 0 0 0 0 1 0 0 0 0 NaN 0", &["`NaN` is not finite"]),
        ("1e200 0 0 0 0 1e200 0 0 0 0 1e200 0", &["no rotation"]),
    ];
    for (line, parts) in cases {
        let text = format!("1 0 0 0 0 1 0 0 0 0 1 0\n{line}\n");
        let error = parse_kitti(text.as_bytes()).unwrap_err().to_string();
        assert_says(&error, &["line 2"]);
        assert_says(&error, parts);
    }
}

#[test]
fn kitti_stamps_come_from_times_txt() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.txt");
    fs::write(&path, "1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(3)).unwrap();
    let read = read_trajectory(&path).unwrap();
    assert_eq!((read.format, read.trajectory.stamps_ns()), (TrajectoryFormat::Kitti, None));
    assert_says(&read.notes.join("; "), &["n-th pose"]);
    fs::write(folder.path().join("times.txt"), "0\n0.1\n0.2\n").unwrap();
    let read = read_trajectory(&path).unwrap();
    assert_eq!(read.trajectory.stamps_ns(), Some(&[0, 100_000_000, 200_000_000][..]));
    fs::write(folder.path().join("times.txt"), "0\n0.1\n").unwrap();
    let read = read_trajectory(&path).unwrap();
    assert_eq!(read.trajectory.stamps_ns(), None);
    assert_says(&read.notes.join("; "), &["times.txt has 2 lines for 3 poses"]);
}

const EUROC: &str = "#timestamp [ns], p_x [m], p_y [m], p_z [m], q_w [], q_x [], q_y [], q_z [], v_x, v_y, v_z, \
    b_x, b_y, b_z, a_x, a_y, a_z\n\
    1403636580838555648,4.6,-1.7,0.7,0.53,-0.15,-0.82,-0.08,0,0,0,0,0,0,0,0,0\n\
    1403636580843555328,4.7,-1.8,0.8,0.53,-0.15,-0.82,-0.08,0,0,0,0,0,0,0,0,0\n";

#[test]
fn euroc_is_found_by_looking() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("data.csv");
    fs::write(&path, EUROC).unwrap();
    let read = read_trajectory(&path).unwrap();
    assert_eq!(read.format, TrajectoryFormat::Euroc);
    assert_eq!(
        read.trajectory.stamps_ns(),
        Some(&[1_403_636_580_838_555_648, 1_403_636_580_843_555_328][..])
    );
    let tum = parse_tum(b"0 4.6 -1.7 0.7 -0.15 -0.82 -0.08 0.53").unwrap().trajectory;
    assert!(read.trajectory.poses()[0].rotation.angle_to(&tum.poses()[0].rotation) < 1e-7);
    assert_eq!(read.trajectory.poses()[0].translation, tum.poses()[0].translation);
    // Eight columns without a heading, and small stamps with one.
    for (text, format) in [
        ("1403636580838555648,1,2,3,1,0,0,0", TrajectoryFormat::Euroc),
        ("#timestamp [ns]\n5000,1,2,3,1,0,0,0", TrajectoryFormat::Euroc),
        ("# stamp\n5000,1,2,3,0,0,0,1", TrajectoryFormat::Tum),
        ("1403636580.838555648,1,2,3,0,0,0,1", TrajectoryFormat::Tum),
    ] {
        fs::write(&path, text).unwrap();
        let read = read_trajectory(&path).unwrap();
        assert_eq!(read.format, format, "{text}");
        assert!(read.trajectory.poses()[0].rotation.angle() < 1e-12);
        assert_eq!(read_raw_trajectory(&path, None).unwrap().format, format);
    }
}

#[test]
fn broken_euroc_lines_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("data.csv");
    let cases = [
        ("1403636580848555520,4.7,-1.8,0.8,0.53,-0.15,-0.82", &["7 columns", "17", "cut?"][..]),
        ("1403636580848555520,4.7,x,0.8,0.53,-0.15,-0.82,-0.08,0,0,0,0,0,0,0,0,0", &["`x` is not a number"]),
        (
            "1403636580848.5,4.7,1,0.8,0.53,-0.15,-0.82,-0.08,0,0,0,0,0,0,0,0,0",
            &["`1403636580848.5`", "nanoseconds"],
        ),
        ("1403636580848555520,4.7,1,0.8,0,0,0,0,0,0,0,0,0,0,0,0,0", &["(0, 0, 0, 0) is zero"]),
    ];
    for (line, parts) in cases {
        fs::write(&path, format!("{EUROC}{line}\n")).unwrap();
        let error = read_trajectory(&path).unwrap_err().to_string();
        assert_says(&error, &["data.csv: line 4: "]);
        assert_says(&error, parts);
    }
}

#[test]
fn raw_poses_stay_as_they_are_written() {
    let text = b"3.25 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 2\n1 2 0 0 0 0 0 0\n1 1 0 0 0 0 0 1\n";
    let raw = parse_raw(text, TrajectoryFormat::Tum).unwrap();
    assert_eq!(raw.stamps_s.as_deref(), Some(&[3.25, 1.0, 1.0, 1.0][..]));
    assert_eq!(raw.positions_m.iter().map(|p| p.x).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 1.0]);
    assert_eq!((raw.rotations[1], raw.zero_quaternions), (raw.rotations[0], 1));
    let raw = parse_raw(b"0.707 -0.707 0 1 0.707 0.707 0 2 0 0 1 3\n", TrajectoryFormat::Kitti).unwrap();
    assert_eq!((raw.stamps_s, raw.rotations[0][(0, 0)]), (None, 0.707));
    let raw = parse_raw(EUROC.as_bytes(), TrajectoryFormat::Euroc).unwrap();
    assert_eq!(
        raw.stamps_s,
        Some(vec![1_403_636_580_838_555_648.0 / 1e9, 1_403_636_580_843_555_328.0 / 1e9])
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.tum");
    fs::write(&path, "1 0 0 0 0 0 0 1\n").unwrap();
    let error = read_raw_trajectory(&path, Some(TrajectoryFormat::Kitti)).unwrap_err().to_string();
    assert_says(&error, &["run.tum: line 1", "8 columns", "12"]);
    fs::write(&path, "# nothing\n").unwrap();
    assert_says(
        &read_raw_trajectory(&path, Some(TrajectoryFormat::Tum)).unwrap_err().to_string(),
        &["no poses"],
    );
}

proptest! {
    #[test]
    fn no_text_makes_a_parser_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = parse_tum(&bytes);
        let _ = parse_kitti(&bytes);
        let _ = parse_euroc(&bytes);
        let _ = parse_raw(&bytes, TrajectoryFormat::Euroc);
    }

    #[test]
    fn no_numbers_make_a_parser_panic(text in "[-+0-9.eEna# ,\t\r\n]{0,200}") {
        let _ = parse_tum(text.as_bytes());
        let _ = parse_kitti(text.as_bytes());
        let _ = parse_euroc(text.as_bytes());
        let _ = parse_raw(text.as_bytes(), TrajectoryFormat::Euroc);
    }
}
