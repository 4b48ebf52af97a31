//! Bad trajectories in every format of text: each is refused with its line, or read as it was meant.

use crate::common::assert_says;
use dmp_log::{
    LogError, TrajectoryFile, TrajectoryFormat, parse_euroc, read_trajectory, read_trajectory_as, write_euroc,
};
use dmp_sensor::{Isometry3, Trajectory, Translation3, UnitQuaternion, Vector3};
use std::fs;

fn read(text: impl AsRef<[u8]>) -> Result<TrajectoryFile, LogError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.txt");
    fs::write(&path, text).unwrap();
    read_trajectory(&path)
}

fn refused(text: &str, parts: &[&str]) {
    let error = read(text).unwrap_err();
    assert!(!error.is_usage(), "{error}");
    assert_says(&error.to_string(), &["run.txt: "]);
    assert_says(&error.to_string(), parts);
}

/// A line of the format with this stamp, place along x, metres, and rotation about z, radians.
fn line(format: TrajectoryFormat, second: i64, x: &str, yaw: f64) -> String {
    let (s, c) = (0.5 * yaw).sin_cos();
    match format {
        TrajectoryFormat::Tum => format!("{}.5 {x} 0 0 0 0 {s} {c}", 1_700_000_000 + second),
        TrajectoryFormat::Euroc => format!("{}500000000,{x},0,0,{c},0,0,{s},9,9", 1_700_000_000 + second),
        TrajectoryFormat::G2o => format!("VERTEX_SE3:QUAT {second} {x} 0 0 0 0 {s} {c}"),
        _ => {
            let (s, c) = yaw.sin_cos();
            format!("{c} {} 0 {x} {s} {c} 0 0 0 0 1 0", -s)
        }
    }
}

const TEXTS: [TrajectoryFormat; 4] =
    [TrajectoryFormat::Tum, TrajectoryFormat::Euroc, TrajectoryFormat::Kitti, TrajectoryFormat::G2o];

#[test]
fn row_18_every_line_end_blank_mark_and_comment_is_read() {
    for format in TEXTS {
        let lines: Vec<String> = (0..3).map(|k| line(format, k, &k.to_string(), 0.1 * k as f64)).collect();
        let plain = read(lines.join("\n") + "\n").unwrap();
        assert_eq!((plain.format, plain.trajectory.len()), (format, 3));
        let tabs = |separator: &str| lines.join(" \t\r\n").replace(' ', separator) + "\r\n";
        let comments = lines.join(" # why\n\n   \t\n# a line of its own\n");
        for text in [
            tabs("\t"),
            tabs("   "),
            format!("\u{feff}{}\n\n\n", lines.join("\n")),
            format!("\u{feff}# first\r\n\r\n  {comments}\n"),
        ] {
            let read = read(&text).unwrap();
            assert_eq!((read.format, &read.trajectory), (format, &plain.trajectory), "{text}");
            assert_eq!(read.notes, plain.notes, "{text}");
        }
    }
}

#[test]
fn row_18_zero_quaternions_nan_and_cuts_are_named_with_their_line() {
    for format in TEXTS {
        let good = line(format, 0, "0", 0.0);
        let bad = |line: &str, parts: &[&str]| {
            refused(&format!("# run\n{good}\n\n{line}"), parts);
            refused(&format!("# run\n{good}\n\n{line}\n"), parts);
            assert_says(&read(format!("# run\n{good}\n\n{line}")).unwrap_err().to_string(), &["line 4: "]);
        };
        for word in ["nan", "NaN", "inf", "-inf", "1e999"] {
            bad(&line(format, 1, word, 0.0), &[&format!("`{word}` is not finite")]);
        }
        for word in ["x", "1.2.3", "--1", "0x1", "1e", "１"] {
            bad(&line(format, 1, word, 0.0), &[&format!("`{word}` is not a number")]);
        }
        let zero = match format {
            TrajectoryFormat::Tum => "1700000001.5 1 0 0 0 0 0 0",
            TrajectoryFormat::Euroc => "1700000001500000000,1,0,0,0,0,0,0,9,9",
            TrajectoryFormat::G2o => "VERTEX_SE3:QUAT 1 1 0 0 0 0 0 0",
            _ => "0 0 0 1 0 0 0 0 0 0 0 0",
        };
        bad(zero, &[if format == TrajectoryFormat::Kitti { "no rotation" } else { "is zero" }]);
        // Cut behind every column but the last.
        let whole = line(format, 1, "1", 0.2);
        let separator = if format == TrajectoryFormat::Euroc { ',' } else { ' ' };
        for (at, _) in whole.match_indices(separator) {
            bad(&whole[..at], &["columns", "cut?"]);
        }
    }
}

#[test]
fn row_18_a_cut_in_the_last_number_is_told() {
    for format in TEXTS {
        let text = format!("{}\n{}", line(format, 0, "0", 0.0), line(format, 1, "1", 0.3));
        let told = |read: &TrajectoryFile| read.notes.iter().any(|note| note.contains("it may be cut"));
        assert!(told(&read(&text).unwrap()), "{format}");
        assert!(!told(&read(format!("{text}\n")).unwrap()), "{format}");
        assert!(!told(&read(format!("{text}\r\n  ")).unwrap()), "{format}");
    }
}

#[test]
fn row_18_two_runs_in_one_file_are_refused() {
    for format in [TrajectoryFormat::Tum, TrajectoryFormat::Euroc, TrajectoryFormat::G2o] {
        let run = |offset: &str, yaw| (0..3).map(|k| line(format, k, offset, yaw) + "\n").collect::<String>();
        let told = if format == TrajectoryFormat::G2o { "another pose" } else { "two runs" };
        refused(&(run("0", 0.0) + &run("5", 0.0)), &[told, "5.000 m"]);
        refused(&(run("0", 0.0) + &run("0", 0.1)), &[told, "0.000 m"]);
        // The same again is one run.
        let read = read(run("0", 0.0) + &run("0", 0.0)).unwrap();
        assert_eq!((read.repeated, read.trajectory.len()), (3, 3), "{format}");
    }
}

#[test]
fn row_18_gaps_and_ends_have_no_pose() {
    for format in [TrajectoryFormat::Tum, TrajectoryFormat::Euroc] {
        let text: String = [0, 1, 60].map(|second| line(format, second, "1", 0.0) + "\n").concat();
        let run = read(text).unwrap().trajectory;
        let at = |second: f64| {
            run.world_from_body_at(1_700_000_000_500_000_000 + (1e9 * second) as i64, 2_000_000_000)
        };
        assert!(at(0.5).is_some() && at(60.0).is_some());
        assert!(at(-0.1).is_none() && at(30.0).is_none() && at(60.1).is_none());
    }
}

#[test]
fn row_18_disorder_is_sorted_and_counted() {
    for format in [TrajectoryFormat::Tum, TrajectoryFormat::Euroc, TrajectoryFormat::G2o] {
        let text: String = [2, 0, 1, 3].map(|k| line(format, k, &k.to_string(), 0.0) + "\n").concat();
        let read = read(text).unwrap();
        let x: Vec<f64> = read.trajectory.poses().iter().map(|pose| pose.translation.x).collect();
        assert_eq!((read.out_of_order, x), (1, vec![0.0, 1.0, 2.0, 3.0]), "{format}");
    }
}

#[test]
fn a_format_that_is_given_is_not_looked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    // Stamps of a simulation, in nanoseconds: to the eye this is TUM.
    fs::write(&path, "5000,1,2,3,0.5,0.5,0.5,0.5\n").unwrap();
    assert_eq!(read_trajectory(&path).unwrap().format, TrajectoryFormat::Tum);
    let given = |word: &str| read_trajectory_as(&path, Some(word.parse().unwrap()), None);
    let read = given("euroc").unwrap();
    assert_eq!((read.format, read.trajectory.stamps_ns()), (TrajectoryFormat::Euroc, Some(&[5000][..])));
    assert_says(&given("kitti").unwrap_err().to_string(), &["run.csv: line 1: 8 columns, expected 12"]);
    assert_says(&given("npy").unwrap_err().to_string(), &["run.csv: byte 0: no .npy file"]);
    assert_says(&given("g2o").unwrap_err().to_string(), &["run.csv: ", "no poses in 27 bytes"]);
    for format in TrajectoryFormat::ALL {
        assert_eq!(format.to_string().parse(), Ok(format));
    }
    let error = "TUM".parse::<TrajectoryFormat>().unwrap_err();
    assert_says(&error, &["`TUM` is no format", "tum, kitti, euroc, npy, g2o"]);
}

#[test]
fn euroc_gives_back_what_was_written() {
    for first_ns in [0, 5_000, 1_403_636_579_763_555_584] {
        let pose = |k: i64| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.1 * k as f64, 1.0));
            Isometry3::from_parts(Translation3::new(5e5 + 0.1 * k as f64, -4e6, 1.0 / 3.0), turn)
        };
        let run = Trajectory::stamped((0..50).map(|k| (first_ns + k * 4_999_999, pose(k))).collect());
        let run = run.unwrap().trajectory;
        let mut text = Vec::new();
        write_euroc(&mut text, &run).unwrap();
        assert!(text.starts_with(b"#timestamp [ns],p_RS_R_x [m],"));
        assert_eq!(read(&text).unwrap().format, TrajectoryFormat::Euroc);
        let read = parse_euroc(&text).unwrap().trajectory;
        assert_eq!(read.stamps_ns(), run.stamps_ns());
        for (a, b) in read.poses().iter().zip(run.poses()) {
            assert_eq!(a.translation, b.translation);
            assert!(a.rotation.angle_to(&b.rotation) < 1e-7);
        }
    }
    let unstamped = Trajectory::unstamped(vec![Isometry3::identity()]).unwrap();
    assert_says(&write_euroc(&mut Vec::new(), &unstamped).unwrap_err().to_string(), &["needs stamps"]);
}
