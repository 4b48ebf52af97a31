//! Trajectories in text: TUM, KITTI, EuRoC, Redwood and g2o. Each is read as it was meant, or refused with its line.

use crate::common::{Random, assert_says, refusals};
use dmp_log::{
    LogError, TrajectoryFile, TrajectoryFormat, parse_euroc, parse_g2o, parse_kitti, parse_raw,
    parse_redwood_log, parse_tum, poses_at_most, read_raw_trajectory, read_trajectory, read_trajectory_as,
    write_euroc, write_kitti, write_redwood_log, write_tum,
};
use dmp_sensor::{Isometry3, Trajectory, Translation3, UnitQuaternion, Vector3};
use std::fs;
use std::path::PathBuf;

use TrajectoryFormat::{Euroc, G2o, Kitti, RedwoodLog, Tum};

fn file(text: impl AsRef<[u8]>) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.txt");
    fs::write(&path, text).unwrap();
    (folder, path)
}

fn read(text: impl AsRef<[u8]>) -> Result<TrajectoryFile, LogError> {
    read_trajectory(&file(text).1)
}

fn refused(text: impl AsRef<[u8]>) -> String {
    let error = read(text).unwrap_err();
    assert!(!error.is_usage(), "{error}");
    assert_says(&error.to_string(), &["run.txt: "]);
    error.to_string()
}

/// A line of the format with this stamp, place along x, metres, and rotation about z, radians.
fn line(format: TrajectoryFormat, second: i64, x: &str, yaw: f64) -> String {
    let (s, c) = (0.5 * yaw).sin_cos();
    match format {
        Tum => format!("{}.5 {x} 0 0 0 0 {s} {c}", 1_700_000_000 + second),
        Euroc => format!("{}500000000,{x},0,0,{c},0,0,{s},9,9", 1_700_000_000 + second),
        G2o => format!("VERTEX_SE3:QUAT {second} {x} 0 0 0 0 {s} {c}"),
        _ => {
            let (s, c) = yaw.sin_cos();
            format!("{c} {} 0 {x} {s} {c} 0 0 0 0 1 0", -s)
        }
    }
}

const TEXTS: [TrajectoryFormat; 4] = [Tum, Euroc, Kitti, G2o];

type Writer = fn(&mut Vec<u8>, &Trajectory) -> std::io::Result<()>;

#[test]
fn every_format_gives_back_what_was_written() {
    let mut random = Random(7);
    let mut unit = || (random.next() >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0;
    let mut pose = || {
        let turn = Vector3::new(3.0 * unit(), 3.0 * unit(), 3.0 * unit());
        let place = Translation3::new(5e5 * unit(), 4e6 * unit(), 100.0 * unit());
        Isometry3::from_parts(place, UnitQuaternion::from_scaled_axis(turn))
    };
    let poses: Vec<Isometry3<f64>> = (0..50).map(|_| pose()).collect();
    let unstamped = Trajectory::unstamped(poses.clone()).unwrap();
    let writers: [(TrajectoryFormat, Writer); 4] = [
        (Tum, |out, run| write_tum(out, run)),
        (Euroc, |out, run| write_euroc(out, run)),
        (Kitti, |out, run| write_kitti(out, run)),
        (RedwoodLog, |out, run| write_redwood_log(out, run)),
    ];
    for (format, write) in writers {
        let is_stamped = [Tum, Euroc].contains(&format);
        for first_ns in [0, 5_000, 1_403_636_579_763_555_584] {
            let stamped = poses.iter().enumerate().map(|(k, pose)| (first_ns + k as i64 * 99_999_999, *pose));
            let stamped = Trajectory::stamped(stamped.collect()).unwrap().trajectory;
            let run = if is_stamped { &stamped } else { &unstamped };
            let mut text = Vec::new();
            write(&mut text, run).unwrap();
            let read = read(&text).unwrap();
            assert_eq!((read.format, read.out_of_order, read.repeated), (format, 0, 0));
            assert_eq!(
                (read.trajectory.stamps_ns(), read.trajectory.len()),
                (run.stamps_ns(), 50),
                "{format}"
            );
            for (a, b) in read.trajectory.poses().iter().zip(run.poses()) {
                assert_eq!(a.translation, b.translation, "{format}");
                assert!(a.rotation.angle_to(&b.rotation) < 1e-7, "{format}: {a} {b}");
            }
        }
        let error = write(&mut Vec::new(), &unstamped).map_err(|error| error.to_string());
        assert_eq!(error.is_err_and(|error| error.contains("needs stamps")), is_stamped, "{format}");
    }
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
        let bad = |line: &str, part: &str| {
            for end in ["", "\n"] {
                assert_says(&refused(format!("# run\n{good}\n\n{line}{end}")), &["line 4: ", part]);
            }
        };
        for word in ["nan", "NaN", "inf", "-inf", "1e999"] {
            bad(&line(format, 1, word, 0.0), &format!("`{word}` is not finite"));
        }
        for word in ["x", "1.2.3", "--1", "0x1", "1e", "１", "\u{221e}"] {
            bad(&line(format, 1, word, 0.0), &format!("`{word}` is not a number"));
        }
        bad(&line(format, 1, "1e9", 0.0), "1e9 m");
        let zero = match format {
            Tum => "1700000001.5 1 0 0 0 0 0 0",
            Euroc => "1700000001500000000,1,0,0,0,0,0,0,9,9",
            G2o => "VERTEX_SE3:QUAT 1 1 0 0 0 0 0 0",
            _ => "0 0 0 1 0 0 0 0 0 0 0 0",
        };
        bad(zero, if format == Kitti { "no rotation" } else { "is zero" });
        // Cut behind every column but the last.
        let whole = line(format, 1, "1", 0.2);
        for (at, _) in whole.match_indices(if format == Euroc { ',' } else { ' ' }) {
            bad(&whole[..at], "columns");
            bad(&whole[..at], "cut?");
        }
        // In the last number a cut does not show, but that the line has no end.
        let text = format!("{good}\n{whole}");
        let may_be_cut =
            |text: &str| read(text).unwrap().notes.iter().any(|note| note.contains("it may be cut"));
        assert!(may_be_cut(&text), "{format}");
        assert!(!may_be_cut(&format!("{text}\n")) && !may_be_cut(&format!("{text}\r\n  ")), "{format}");
    }
}

/// What is particular to a format.
#[test]
fn row_18_other_faults_are_named_with_their_line() {
    refusals(
        |line| refused(format!("# run\n0.1 1 2 3 0 0 0 1\n\n{line}\n")),
        "line 4: ",
        &[
            ("0.2 1 2 3 0 0 0 1 9", "9 columns"),
            ("0.2 1 2 3 0 0 0 1.2", "norm 1.2"),
            ("0.2 1 2 3 0 0 0 0.5", "norm 0.5"),
            ("nan 1 2 3 0 0 0 1", "`nan`"),
            ("0.2 1e9 2 3 0 0 0 1", "(1000000000, 2, 3)"),
            ("1403636579763555584 1 2 3 0 0 0 1", "1403636579763555584 | another unit"),
        ],
    );
    refusals(
        |line| refused(format!("{EUROC}{line}\n")),
        "line 4: ",
        &[
            ("1403636580848555520,4.7,-1.8,0.8,0.53,-0.15,-0.82", "7 columns | 17"),
            (
                "1403636580848.5,4.7,1,0.8,0.53,-0.15,-0.82,-0.08,0,0,0,0,0,0,0,0,0",
                "`1403636580848.5` | nanoseconds",
            ),
        ],
    );
    refusals(
        |line| refused(format!("1 0 0 0 0 1 0 0 0 0 1 0\n{line}\n")),
        "line 2: ",
        &[
            ("1 0 0 0 0 1 0 0 0 0 -1 0", "reflection | -1.000"),
            ("1.1 0 0 0 0 1 0 0 0 0 1 0", "no rotation | 0.210"),
            ("1e200 0 0 0 0 1e200 0 0 0 0 1e200 0", "no rotation"),
        ],
    );
    refusals(
        |line| refused(format!("\u{feff}# a graph\r\nVERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\r\n{line}")),
        "line 3: ",
        &[
            ("VERTEX_SE3:QUAT", "0 columns | cut?"),
            ("VERTEX_SE3:Q", "`VERTEX_SE3:Q` | cut?"),
            ("VERTEX_SE2 1 0 0", "3 columns | id x y theta"),
            ("VERTEX_SE3:QUAT 1.5 0 0 0 0 0 0 1", "id `1.5` | no whole number"),
            ("VERTEX_SE3:QUAT 0 0 3 0 0 0 0 1", "the vertex 0 has another pose than in line 2: 3.000 m"),
            ("VERTEX_SE3:QUAT 0 0 0 0 0 0 1 0", "another pose"),
        ],
    );
    let row = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    let with = |from: &str, to: &str| format!("0 0 1\n{}", row.replace(from, to));
    refusals(
        |text| refused(text),
        "",
        &[
            (
                "0 0 1\n1 0 0 0\n0 1 0 0\n",
                "line 1: the pose that begins here has 2 of 4 rows: is the file cut?",
            ),
            (&format!("0 0 1\n{row}1 1 2\n"), "line 6: the pose that begins here has 0 of 4 rows"),
            (&format!("0 0 1\n{row}1 1 2\n1 0 0\n"), "line 7: 3 columns, expected 4"),
            (&format!("0 0 1\n{row}1 1\n{row}"), "line 6: `1 1` begins no pose"),
            (&format!("0 0 1\n{row}{row}"), "line 6: `1 0 0 0` begins no pose"),
            (&with("0 0 0 1", "0 0 0 2"), "line 5: the last row is [0.0, 0.0, 0.0, 2.0]"),
            (&with("0 1 0 0", "0 2 0 0"), "line 2: the 3 x 3 part is no rotation"),
            (&with("0 0 1 0", "0 0 -1 0"), "line 2: the 3 x 3 part is a reflection"),
            (&with("0 1 0 0", "0 1 0 nan"), "line 3: `nan` is not finite"),
            (&with("0 1 0 0", "0 1 0 x"), "line 3: `x` is not a number"),
            (&with("0 1 0 0", "0 1 0 1e9"), "from the origin"),
            // Whole files that are no trajectory.
            ("", "no poses in 0 bytes"),
            ("# only a comment\n\n", "no poses"),
            ("EDGE_SE3:QUAT 0 1\n", "no poses"),
            ("a,b\n", "line 1 | 2 columns | `a` | TUM | KITTI"),
            ("1 2 3.5\n", "3 columns of numbers | Redwood"),
        ],
    );
    assert_says(&refused(b"0.1 1 2 3 0 0 0 1\n\xff\xfe 1 2"), &["line 2", "not text: [ff, fe"]);
    let gone = read_trajectory(&file("").0.path().join("gone.tum")).unwrap_err();
    assert!(gone.is_usage());
    assert_says(&gone.to_string(), &["gone.tum", "no such file"]);
    assert!(parse_tum(b"").is_err() && parse_kitti(b"# nothing").is_err());
}

#[test]
fn row_18_two_runs_in_one_file_are_refused_and_disorder_is_sorted() {
    for format in [Tum, Euroc, G2o] {
        let run = |offset: &str, yaw| {
            (0..3).map(|k| line(format, k, offset, yaw) + "\n").collect::<Vec<_>>().concat()
        };
        let words = if format == G2o { "another pose" } else { "two runs" };
        assert_says(&refused(run("0", 0.0) + &run("5", 0.0)), &[words, "5.000 m"]);
        assert_says(&refused(run("0", 0.0) + &run("0", 0.1)), &[words, "0.000 m"]);
        // The same again is one run.
        let twice = read(run("0", 0.0) + &run("0", 0.0)).unwrap();
        assert_eq!((twice.repeated, twice.trajectory.len()), (3, 3), "{format}");
        let mixed: String = [2, 0, 1, 3].map(|k| line(format, k, &k.to_string(), 0.0) + "\n").concat();
        let mixed = read(mixed).unwrap();
        let x: Vec<f64> = mixed.trajectory.poses().iter().map(|pose| pose.translation.x).collect();
        assert_eq!((mixed.out_of_order, x), (1, vec![0.0, 1.0, 2.0, 3.0]), "{format}");
        assert!(mixed.fingerprint.starts_with("crc32:"));
    }
}

#[test]
fn row_18_gaps_and_ends_have_no_pose() {
    for format in [Tum, Euroc] {
        let text: String = [0, 1, 60].map(|second| line(format, second, "1", 0.0) + "\n").concat();
        let run = read(text).unwrap().trajectory;
        let at = |second: f64| {
            run.world_from_body_at(1_700_000_000_500_000_000 + (1e9 * second) as i64, 2_000_000_000)
        };
        assert!(at(0.5).is_some() && at(60.0).is_some());
        assert!(at(-0.1).is_none() && at(30.0).is_none() && at(60.1).is_none());
    }
}

const EUROC: &str = "#timestamp [ns], p_x [m], p_y [m], p_z [m], q_w [], q_x [], q_y [], q_z [], v_x, v_y, v_z, \
    b_x, b_y, b_z, a_x, a_y, a_z\n\
    1403636580838555648,4.6,-1.7,0.7,0.53,-0.15,-0.82,-0.08,0,0,0,0,0,0,0,0,0\n\
    1403636580843555328,4.7,-1.8,0.8,0.53,-0.15,-0.82,-0.08,0,0,0,0,0,0,0,0,0\n";
const REDWOOD: &str = "0\t0\t1\r\n1 0 0 -2.25\r\n0 1 0 0\r\n0 0 1 0.5\r\n0 0 0 1\r\n1 1 2\n0 -1 0 1.0e+00\n1 0 0 2\n0 0 1 3\n0 0 0 1\n";

#[test]
fn formats_are_found_by_looking_or_given() {
    for (text, format) in [
        ("1403636580838555648,1,2,3,1,0,0,0", Euroc),
        ("#timestamp [ns]\n5000,1,2,3,1,0,0,0", Euroc),
        ("# stamp\n5000,1,2,3,0,0,0,1", Tum),
        ("1403636580.838555648,1,2,3,0,0,0,1", Tum),
        // ICL-NUIM's truth has whole numbers for stamps.
        ("1 0 0 -2.25 0 0 0 1\n2 0 0 -2.24 0 0 0 1\n3 0 0 -2 0 0 0 1\n", Tum),
        (REDWOOD, RedwoodLog),
        (EUROC, Euroc),
    ] {
        let (_folder, path) = file(text);
        assert_eq!(read_trajectory(&path).unwrap().format, format, "{text}");
        assert_eq!(read_raw_trajectory(&path, None).unwrap().format, format);
    }
    let read_euroc = parse_euroc(EUROC.as_bytes()).unwrap().trajectory;
    let stamps = [1_403_636_580_838_555_648, 1_403_636_580_843_555_328];
    assert_eq!(read_euroc.stamps_ns(), Some(&stamps[..]));
    let tum = parse_tum(b"0 4.6 -1.7 0.7 -0.15 -0.82 -0.08 0.53").unwrap().trajectory;
    assert!(read_euroc.poses()[0].rotation.angle_to(&tum.poses()[0].rotation) < 1e-7);
    assert_eq!(read_euroc.poses()[0].translation, tum.poses()[0].translation);

    // Stamps of a simulation, in nanoseconds: to the eye this is TUM.
    let (_folder, path) = file("5000,1,2,3,0.5,0.5,0.5,0.5\n");
    assert_eq!(read_trajectory(&path).unwrap().format, Tum);
    let given = |word: &str| read_trajectory_as(&path, Some(word.parse().unwrap()), None);
    let euroc = given("euroc").unwrap();
    assert_eq!((euroc.format, euroc.trajectory.stamps_ns()), (Euroc, Some(&[5000][..])));
    refusals(
        |word| given(word).unwrap_err().to_string(),
        "run.txt: ",
        &[
            ("kitti", "line 1: 8 columns, expected 12"),
            ("npy", "byte 0: no .npy file"),
            ("g2o", "no poses in 27 bytes"),
        ],
    );
    for format in TrajectoryFormat::ALL {
        assert_eq!(format.to_string().parse(), Ok(format));
    }
    let error = "TUM".parse::<TrajectoryFormat>().unwrap_err();
    assert_says(&error, &["`TUM` is no format", "tum, kitti, euroc, npy, g2o"]);
}

#[test]
fn matrices_are_read_with_the_stamps_beside_them() {
    let rounded = parse_kitti(b"0.707 -0.707 0 1 0.707 0.707 0 2 0 0 1 3\n").unwrap();
    let angle = rounded.poses()[0].rotation.euler_angles().2;
    assert!((angle - std::f64::consts::FRAC_PI_4).abs() < 1e-12, "made exact");
    let read_redwood = parse_redwood_log(REDWOOD.as_bytes()).unwrap();
    let [first, second] = read_redwood.poses() else { panic!("two poses") };
    assert_eq!(first.translation.vector, Vector3::new(-2.25, 0.0, 0.5));
    let quarter = UnitQuaternion::from_scaled_axis(Vector3::z() * std::f64::consts::FRAC_PI_2);
    assert!(second.rotation.angle_to(&quarter) < 1e-12);

    for (text, format) in [("1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(2), Kitti), (REDWOOD.to_owned(), RedwoodLog)] {
        let (folder, path) = file(text);
        let beside = |times: &str| {
            fs::write(folder.path().join("times.txt"), times).unwrap();
            read_trajectory(&path).unwrap()
        };
        let none = read_trajectory(&path).unwrap();
        assert_eq!((none.format, none.trajectory.stamps_ns()), (format, None));
        assert_says(&none.notes.join("; "), &["the n-th pose belongs to the n-th scan"]);
        let stamped = beside("1.5\n2.5\n");
        assert_eq!(stamped.trajectory.stamps_ns(), Some(&[1_500_000_000, 2_500_000_000][..]));
        let other = beside("0\n0.1\n0.2\n");
        assert_eq!(other.trajectory.stamps_ns(), None);
        assert_says(&other.notes.join("; "), &["times.txt has 3 lines for 2 poses"]);
    }
}

/// As written by several programs: parameters, other vertices, edges, priors, fixed vertices, trailing
/// blanks, large ids.
const GRAPH: &str = "# saved by a program\nPARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n\
    VERTEX_SE3:QUAT 8646911284551352322 4 5 6 0 0 0.70710678 0.70710678 \n\
    FIX 8646911284551352320\n\
    VERTEX_SE3:QUAT 8646911284551352320 1 2 3 0 0 0 1\t\r\n\
    VERTEX_PLANE 7 0 0 1 0\nVERTEX_TRACKXYZ 8 1 2 3\n\
    ROBOTLASER1 0 -1.57 3.14 0.5\n\
    VERTEX_SE3:QUAT 8646911284551352320 1 2 3 0 0 0 1\n\
    EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n\
    EDGE_SE3_PRIORXYZ 0 1 2 3 1 0 0 1 0 1\n\n";

#[test]
fn vertices_are_in_the_order_of_their_ids() {
    let graph = parse_g2o(GRAPH.as_bytes()).unwrap();
    assert_eq!(graph.ids, [8_646_911_284_551_352_320, 8_646_911_284_551_352_322]);
    assert_eq!((graph.out_of_order, graph.repeated, graph.other_vertices), (1, 1, 2));
    let tum = parse_tum(b"0 1 2 3 0 0 0 1\n1 4 5 6 0 0 0.70710678 0.70710678").unwrap().trajectory;
    assert_eq!((graph.trajectory.poses(), graph.trajectory.stamps_ns()), (tum.poses(), None));
    let (_folder, path) = file(GRAPH);
    let read = read_trajectory(&path).unwrap();
    assert_eq!((read.format, read.out_of_order, read.repeated), (G2o, 1, 1));
    assert_says(
        &read.notes.join("; "),
        &["8646911284551352320 to 8646911284551352322, not all", "2 vertices"],
    );
    let raw = read_raw_trajectory(&path, None).unwrap();
    assert_eq!(raw.positions_m.iter().map(|p| p.x).collect::<Vec<_>>(), [1.0, 1.0, 4.0]);

    // In the plane, vertices turn about z.
    let flat = b"EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nVERTEX_SE2 -1 1 2 1.5\nVERTEX_SE2 0 3 4 -0.5\n";
    let flat = parse_g2o(flat).unwrap();
    assert_eq!((flat.ids, flat.out_of_order), (vec![-1, 0], 0));
    let [first, second] = flat.trajectory.poses() else { panic!("two poses") };
    assert_eq!(first.translation.vector.as_slice(), [1.0, 2.0, 0.0]);
    let (roll, pitch, yaw) = first.rotation.euler_angles();
    assert!(roll.abs() < 1e-15 && pitch.abs() < 1e-15 && (yaw - 1.5).abs() < 1e-15);
    assert!((second.rotation.euler_angles().2 + 0.5).abs() < 1e-15);
}

#[test]
fn raw_poses_stay_as_they_are_written() {
    let text = b"3.25 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 2\n1 2 0 0 0 0 0 0\n1 1 0 0 0 0 0 1\n";
    let raw = parse_raw(text, Tum).unwrap();
    assert_eq!(raw.stamps_s.as_deref(), Some(&[3.25, 1.0, 1.0, 1.0][..]));
    assert_eq!(raw.positions_m.iter().map(|p| p.x).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 1.0]);
    assert_eq!((raw.rotations[1], raw.zero_quaternions), (raw.rotations[0], 1));
    let raw = parse_raw(b"0.707 -0.707 0 1 0.707 0.707 0 2 0 0 1 3\n", Kitti).unwrap();
    assert_eq!((raw.stamps_s, raw.rotations[0][(0, 0)]), (None, 0.707));
    let raw = parse_raw(REDWOOD.as_bytes(), RedwoodLog).unwrap();
    assert_eq!((raw.rotations[1][(0, 1)], raw.positions_m[1][2], raw.stamps_s), (-1.0, 3.0, None));
    let raw = parse_raw(EUROC.as_bytes(), Euroc).unwrap();
    let stamps_s = [1_403_636_580_838_555_648.0 / 1e9, 1_403_636_580_843_555_328.0 / 1e9];
    assert_eq!(raw.stamps_s, Some(stamps_s.to_vec()));
    let error =
        |text: &str, format| read_raw_trajectory(&file(text).1, Some(format)).unwrap_err().to_string();
    assert_says(&error("1 0 0 0 0 0 0 1\n", Kitti), &["run.txt: line 1", "8 columns", "12"]);
    assert_says(&error("# nothing\n", Tum), &["no poses"]);
}

/// Those of `MulRan`, KITTI-360, and what else has matrices in lines: the values say which numbers are what.
#[test]
fn lines_with_a_matrix_are_told_apart_by_their_values() {
    let rows = |second: i64| {
        let (s, c) = (0.1 * second as f64).sin_cos();
        format!("{c} {} 0 {} {s} {c} 0 4025000 0 0 1 20", -s, 353_000 + 2 * second)
    };
    let stamped = |stamp: &dyn Fn(i64) -> String, last: &str| -> String {
        (0..9).map(|k| format!("{} {}{last}\n", stamp(k), rows(k)).replace(' ', ",")).collect()
    };
    let ns = |k: i64| format!("{}000000000", 1_564_718_964 + k);
    let seconds = |k: i64| format!("{}.25", 1_564_718_964 + k);
    for (text, offset_ns) in [
        (stamped(&ns, ""), 0),
        (stamped(&ns, " 0 0 0 1"), 0),
        (stamped(&seconds, ""), 250_000_000),
        (stamped(&seconds, " 0 0 0 1").replace(',', " "), 250_000_000),
    ] {
        let run = read(&text).unwrap();
        assert_eq!((run.format, run.trajectory.len()), (TrajectoryFormat::Matrices, 9));
        let stamps_ns = run.trajectory.stamps_ns().unwrap();
        assert_eq!(stamps_ns[8], 1_564_718_972_000_000_000 + offset_ns);
        let place = run.trajectory.poses()[8].translation.vector;
        assert_eq!(place, Vector3::new(353_016.0, 4_025_000.0, 20.0));
        let raw = read_raw_trajectory(&file(&text).1, None).unwrap();
        assert_eq!(raw.positions_m[8], place);
        assert!((raw.stamps_s.unwrap()[8] - 1e-9 * stamps_ns[8] as f64).abs() < 1e-6);
    }
    let unstamped = (0..9).map(|k| rows(k) + " 0 0 0 1\n").collect::<Vec<_>>().concat();
    let run = read(&unstamped).unwrap();
    assert_eq!((run.format, run.trajectory.len()), (Kitti, 9));

    let no_rotation = stamped(&ns, "").replace(",20\n", ",20,7\n");
    assert_says(
        &refused(no_rotation),
        &["14 columns of numbers", "columns 2 to 13 hold a rotation and a place"],
    );
}

#[test]
fn columns_that_fit_by_number_alone_are_not_believed() {
    // Eight numbers with commas and a stamp in nanoseconds, but velocities where EuRoC has a quaternion.
    let velocities = "1403636580838555648,4.6,-1.7,0.7,12.5,-3.1,0.1,0\n".repeat(3);
    assert_says(
        &refused(velocities),
        &["8 columns of numbers", "columns 5 to 8 have length 12.879", "name the columns"],
    );
    assert_says(
        &refused("1700000000.5 1 2 3 10 20 30 40\n"),
        &["columns 5 to 8 have length 54.7723: no quaternion"],
    );
    assert_says(
        &refused("7.5 1700000000.5 1 2 3 0 0 0 1\n"),
        &["columns 6 to 9 have the length of a quaternion"],
    );
    assert_says(&refused("1699999999,98 0,5 -1,25 0,0 0,0 0,0 0,0 1,0\n"), &["decimal commas"]);
    assert_says(&refused("VERTEX_SE3:QUAT 0 0,5 -1,25 0,0 0,0 0,0 0,0 1,0\n"), &["decimal commas"]);
}

/// Tables of published data sets: what their lines hold has one reading, or the line is described.
#[test]
fn tables_of_data_sets_are_read_or_described() {
    const LINES: i64 = 12;
    let turn = |k: i64| (0.05 * k as f64).sin_cos();
    let second = |k: i64| 1_700_000_000 + k;
    let all = |line: &dyn Fn(i64) -> String| (0..LINES).map(|k| line(k) + "\n").collect::<Vec<_>>().concat();
    let pose = |k: i64, by: &str| {
        let (s, c) = turn(k);
        format!("{},{},3,0,0,{s},{c}", 2 * k, k).replace(',', by)
    };
    // Each is poses along x, two metres apart, a second apart: TIERS, RTAB-Map with and without names, messages of
    // `ros2 topic echo --csv`, seconds and nanoseconds, semicolons, UTF-16.
    let utf16 = |text: &str, big: bool| -> Vec<u8> {
        let unit = |unit: u16| if big { unit.to_be_bytes() } else { unit.to_le_bytes() };
        "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(unit).collect()
    };
    let tum = all(&|k| format!("{}.5 {}", second(k), pose(k, " ")));
    let covariance = ",0.1".repeat(36);
    for (what, text) in [
        ("TIERS", all(&|k| format!("{k} {}.5 {}", second(k), pose(k, " "))).into_bytes()),
        ("RTAB-Map", all(&|k| format!("{}.500000 {} {}", second(k), pose(k, " "), k + 1)).into_bytes()),
        (
            "RTAB-Map with names",
            ("#timestamp x y z qx qy qz qw id\n".to_owned()
                + &all(&|k| format!("{}.500000 {} {}", second(k), pose(k, " "), k + 1)))
                .into_bytes(),
        ),
        ("PoseStamped", all(&|k| format!("{},500000000,map,{}", second(k), pose(k, ","))).into_bytes()),
        (
            "Odometry",
            all(&|k| {
                let (second, pose) = (second(k), pose(k, ","));
                format!("{second},500000000,odom,base_link,{pose}{covariance},1,0,0,0,0,0{covariance}")
            })
            .into_bytes(),
        ),
        ("TransformStamped", all(&|k| format!("{},500000000,map,,{}", second(k), pose(k, ","))).into_bytes()),
        ("two numbers", all(&|k| format!("{} 500000000 {}", second(k), pose(k, " "))).into_bytes()),
        ("semicolons", tum.replace(' ', ";").into_bytes()),
        ("UTF-16", utf16(&tum, false)),
        ("UTF-16, big endian", utf16(&tum.replace('\n', "\r\n"), true)),
    ] {
        let run = read(&text).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(run.trajectory.len() as i64, LINES, "{what}");
        let stamps_ns = run.trajectory.stamps_ns().unwrap();
        assert_eq!(stamps_ns[3], second(3) * 1_000_000_000 + 500_000_000, "{what}");
        let last = run.trajectory.poses()[11];
        assert_eq!(last.translation, Translation3::new(22.0, 11.0, 3.0), "{what}");
        assert!((last.rotation.angle() - 1.1).abs() < 1e-9, "{what}");
        let raw = read_raw_trajectory(&file(&text).1, None).unwrap();
        assert_eq!((raw.positions_m.len() as i64, raw.has_rotations), (LINES, true), "{what}");
        assert_eq!(raw.stamps_s.unwrap()[3], second(3) as f64 + 0.5, "{what}");
    }
    for (what, text, words) in [
        ("NCLT", all(&|k| format!("{}500000,{k},2,3,0.01,-0.02,3.1", second(k))), "Euler angles"),
        ("RTK", all(&|k| format!("{}.5,{k},2,3", second(k))), "places alone"),
        ("check points", all(&|k| format!("{k} 353000.5 4025000.25 20.5")), "places alone"),
        (
            "matrices in four lines",
            all(&|k| format!("0 -1 0 {k}\n1 0 0 2\n0 0 1 3\n0 0 0 1")),
            "the rows of a matrix",
        ),
        ("named points", all(&|k| format!("P{k} 353000.5 4025000.25 20.5")), "4 columns starting with `P0`"),
        ("COLMAP", all(&|k| format!("{} 1 0 0 0 {k} 2 3 1 left/{k}.png", k + 1)), "COLMAP's images.txt"),
        (
            "Boreas",
            "GPSTime,easting,northing,altitude,roll,pitch,heading\n".to_owned()
                + &all(&|k| format!("{}500000,{k},2,3,0,0,1", second(k))),
            "Euler angles are not read",
        ),
        (
            "quaternion first",
            all(&|k| format!("{}.5 0 0 0 1 {k} 20 30", second(k))),
            "columns 2 to 5 have the length",
        ),
        // The first line alone would be TUM's; the places of a loop are no stamps.
        (
            "no stamp",
            all(&|k| format!("{} 1 2 3 0 0 0 1", [5, 3, 1, 4][k as usize % 4])),
            "column 1 falls from 5 to 3",
        ),
        (
            "UTF-16 without a mark",
            String::from_utf8(utf16(&tum, false)[2..].to_vec()).unwrap(),
            "UTF-16 without a mark",
        ),
    ] {
        assert!(refused(&text).contains(words), "{what}: {}", refused(&text));
    }
    let cut = [utf16(&tum, false), vec![0]].concat();
    assert_says(&refused(cut), &["begins as UTF-16 and is none"]);
}

/// A later line that breaks what the first line promised is named with its values, by both readers.
#[test]
fn all_lines_are_looked_at() {
    let eight = |last: &str| {
        (0..8).map(|k| format!("{}.5 {k} 0 0 0 0 0 1\n", 1_700_000_000 + k)).collect::<Vec<_>>().concat()
            + last
            + "\n"
    };
    let rows = |k: i64| format!("1 0 0 {k} 0 1 0 0 0 0 1 0");
    let kitti = |last: &str| (0..8).map(|k| rows(k) + "\n").collect::<Vec<_>>().concat() + last + "\n";
    let stamped = |last: &str| {
        (0..8).map(|k| format!("{}.5 {}\n", 1_700_000_000 + k, rows(k))).collect::<Vec<_>>().concat()
            + last
            + "\n"
    };
    for (text, words) in [
        (
            eight("1700000009.5 0 0 0 10 20 30 40"),
            "line 9: the quaternion (10, 20, 30, 40) has the norm 54.7723",
        ),
        (eight("1700000009.5 0 0 0 0 0 0 0.5"), "line 9: the quaternion (0, 0, 0, 0.5) has the norm 0.5000"),
        (kitti("2 0 0 8 0 2 0 0 0 0 2 0"), "line 9: the 3 x 3 part"),
        (kitti("1 0 0 8 0 1 0 0 0 0 -1 0"), "line 9: the 3 x 3 part"),
        (stamped("1700000009.5 0 0 0 8 0 0 0 0 0 0 0 0"), "line 9: the 3 x 3 part"),
    ] {
        for error in [read(&text).unwrap_err(), read_raw_trajectory(&file(&text).1, None).unwrap_err()] {
            assert_says(&error.to_string(), &["run.txt: ", words]);
        }
    }
}

#[test]
fn numbered_matrices_have_scans_by_their_numbers() {
    let rows = |k: usize| format!("1 0 0 {k} 0 1 0 0 0 0 1 0");
    let of = |numbers: &[usize], end: &str| {
        numbers.iter().map(|&k| format!("{k} {}{end}\n", rows(k))).collect::<Vec<_>>().concat()
    };
    let whole: Vec<usize> = (0..9).collect();
    for end in ["", " 0 0 0 1"] {
        let run = read(of(&whole, end)).unwrap();
        assert_eq!((run.format, run.trajectory.stamps_ns()), (TrajectoryFormat::Numbered, None));
        assert_says(&run.notes.join("; "), &["column 1 counts the frames from 0", "n-th scan"]);
        let error = refused(of(&[0, 1, 2, 5, 6], end));
        assert_says(&error, &["line 4: frame 5 follows frame 2", "times.txt"]);
        assert_says(&refused(of(&[3, 4, 5], end)), &["line 1: the first frame is 3"]);
        // With the stamps of all frames beside it, gaps are no matter.
        let (folder, path) = file(of(&[0, 1, 2, 5, 6], end));
        let times = (0..7).map(|k| format!("{}.25\n", 1_700_000_000 + k)).collect::<Vec<_>>().concat();
        fs::write(folder.path().join("times.txt"), times).unwrap();
        let run = read_trajectory(&path).unwrap();
        assert_eq!(run.trajectory.stamps_ns().unwrap()[3], 1_700_000_005_250_000_000);
        assert_says(&run.notes.join("; "), &["times.txt for frame n"]);
        let raw = read_raw_trajectory(&path, None).unwrap();
        assert_eq!(raw.stamps_s.as_deref(), Some(&[0.0, 1.0, 2.0, 5.0, 6.0][..]));
    }
    let broken = of(&whole, "").replace("7 1", "7.5 1");
    assert_says(&refused(broken), &["line 8: `7.5` is no number of a frame"]);
}

#[test]
fn places_alone_are_read_as_they_are() {
    let names = "GPSTime,easting,northing,altitude,vel_east,roll,pitch,heading\n";
    for (text, stamps_s) in [
        ("1700000000.5,1,2,3\n1700000001.5,4,5,6\n".to_owned(), [1_700_000_000.5, 1_700_000_001.5]),
        ("t,x,y,z\n1700000000.5,1,2,3\n1700000001.5,4,5,6\n".to_owned(), [1_700_000_000.5, 1_700_000_001.5]),
        ("17 1 2 3\n19 4 5 6\n".to_owned(), [17.0, 19.0]),
        ("id,e,n,h\n17,1,2,3\n19,4,5,6\n".to_owned(), [17.0, 19.0]),
        ("point;east;north;height\n17;1;2;3\n19;4;5;6\n".to_owned(), [17.0, 19.0]),
        (
            format!("{names}1700000000500000,1,2,3,9,0,0,1\n1700000001500000,4,5,6,9,0,0,1\n"),
            [1_700_000_000.5, 1_700_000_001.5],
        ),
        (
            "1700000000500000,1,2,3,0,0,1\n1700000001500000,4,5,6,0,0,1\n".to_owned(),
            [1_700_000_000.5, 1_700_000_001.5],
        ),
    ] {
        let raw = read_raw_trajectory(&file(&text).1, None).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!((raw.has_rotations, raw.stamps_s.as_deref()), (false, Some(&stamps_s[..])), "{text}");
        assert_eq!(raw.positions_m, [Vector3::new(1.0, 2.0, 3.0), Vector3::new(4.0, 5.0, 6.0)], "{text}");
        assert_says(&raw.notes.join("; "), &["rotations are not compared"]);
        assert!(read(&text).is_err(), "{text}");
    }
}

#[test]
fn poses_are_counted_before_they_are_read() {
    let stamped = (0..500).map(|k| format!("{k}.5 1 2 3 0 0 0 1\n")).collect::<Vec<_>>().concat();
    let graph =
        "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\nEDGE_SE3:QUAT 0 1\n".to_owned();
    let mut npy = b"\x93NUMPY\x01\x00\x46\x00".to_vec();
    npy.resize(80 + 10 * 12 * 8, b' ');
    for (bytes, most) in [
        (format!("# stamp\n\n{stamped}").into_bytes(), 500),
        (stamped.trim_end().as_bytes().to_vec(), 500),
        (REDWOOD.as_bytes().to_vec(), 2),
        (graph.into_bytes(), 2),
        (npy, 21),
        (Vec::new(), 0),
    ] {
        let length = bytes.len() as u64;
        assert_eq!(poses_at_most(&file(bytes).1).unwrap(), (most, length));
    }
}
