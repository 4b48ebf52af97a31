//! Trajectories whose columns have names, and stamps in units that no format has.

use crate::common::{assert_says, refusals};
use dmp_log::{
    LogError, RawTrajectory, TimeUnit, TrajectoryFile, TrajectoryFormat, read_raw_trajectory,
    read_raw_trajectory_as, read_trajectory, read_trajectory_as,
};
use dmp_sensor::Translation3;
use std::fs;
use std::path::PathBuf;

/// 2023, in nanoseconds.
const FIRST_NS: i64 = 1_690_309_709_285_305_500;

fn file(text: impl AsRef<[u8]>) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    fs::write(&path, text).unwrap();
    (folder, path)
}

fn read(text: impl AsRef<[u8]>) -> Result<TrajectoryFile, LogError> {
    read_trajectory(&file(text).1)
}

fn raw(text: impl AsRef<[u8]>) -> RawTrajectory {
    read_raw_trajectory(&file(text).1, None).unwrap()
}

/// By both readers, in the same words.
fn refused(text: &str) -> String {
    let (_folder, path) = file(text);
    let error = read_trajectory(&path).unwrap_err().to_string();
    assert_eq!(read_raw_trajectory(&path, None).unwrap_err().to_string(), error);
    assert_says(&error, &["run.csv: "]);
    error
}

/// Two poses, one metre apart, the second turned by 90° about z.
fn is_the_run(text: &str, format: TrajectoryFormat, stamps_ns: [i64; 2]) -> TrajectoryFile {
    let run = read(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(run.format, format, "{text}");
    assert_eq!(run.trajectory.stamps_ns(), Some(&stamps_ns[..]), "{text}");
    let [a, b] = [0, 1].map(|k| run.trajectory.poses()[k]);
    assert_eq!(
        (a.translation, b.translation),
        (Translation3::new(1.0, 2.0, 3.0), Translation3::new(2.0, 2.0, 3.0))
    );
    assert!(a.rotation.angle() < 1e-9, "{text}");
    assert!((b.rotation.euler_angles().2 - std::f64::consts::FRAC_PI_2).abs() < 1e-6, "{text}");
    let raw = raw(text);
    assert_eq!((raw.format, raw.rotations.len()), (format, 2));
    for (stamp_s, stamp_ns) in raw.stamps_s.unwrap().into_iter().zip(stamps_ns) {
        assert!((stamp_s - stamp_ns as f64 / 1e9).abs() < 1e-6, "{text}");
    }
    assert!((raw.rotations[1][(1, 0)] - 1.0).abs() < 1e-6);
    run
}

const STAMPS_NS: [i64; 2] = [FIRST_NS, FIRST_NS + 100_000_000];

#[test]
fn columns_are_found_by_their_names() {
    let ns = STAMPS_NS.map(|ns| ns.to_string());
    let [a, b] = ns.each_ref().map(String::as_str);
    let csv = TrajectoryFormat::Csv;
    for text in [
        format!("timestamp,tx,ty,tz,qx,qy,qz,qw\n{a},1,2,3,0,0,0,1\n{b},2,2,3,0,0,0.70710678,0.70710678\n"),
        format!("time,x,y,z,qw,qx,qy,qz\n{a},1,2,3,1,0,0,0\n{b},2,2,3,0.70710678,0,0,0.70710678\n"),
        format!(
            "# made by hand\r\n\r\nqw;frame;z;y;x;t_ns;qz;qy;qx\r\n1;map;3;2;1;{a};0;0;0\r\n0.70710678;;3;2;2;{b};0.70710678;0;0;\r\n"
        ),
        format!(
            "\u{feff}\"timestamp\",\"p_x\",\"p_y\",\"p_z\",\"q_x\",\"q_y\",\"q_z\",\"q_w\"\n\"{a}\",1,2,3,0,0,0,1\n{b}, 2 ,2,3,0,0,0.70710678,0.70710678"
        ),
        format!(
            "timestamp [ns] x [m] y [m] z [m] qw qx qy qz\n{a} 1 2 3 1 0 0 0 # first\n\n{b} 2 2 3 0.70710678 0 0 0.70710678\n"
        ),
        format!(
            "time\tx\ty\tz\tqx\tqy\tqz\tqw\n{a}\t1\t2\t3\t0\t0\t0\t1\n{b}\t2\t2\t3\t0\t0\t0.70710678\t0.70710678\n"
        ),
        // Comments: the last before the data, which is not TUM's and not EuRoC's order.
        format!(
            "# run\n# time tx ty tz qw qx qy qz\n{a} 1 2 3 1 0 0 0\n{b} 2 2 3 0.70710678 0 0 0.70710678\n"
        ),
        format!(
            "#timestamp [ns],x,y,z,qx,qy,qz,qw\n{a},1,2,3,0,0,0,1\n{b},2,2,3,0,0,0.70710678,0.70710678\n"
        ),
    ] {
        let run = is_the_run(&text, csv, STAMPS_NS);
        assert_says(&run.notes.join("; "), &["columns by the names in line ", "stamps in nanoseconds"]);
    }
    let rostopic = "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.child_frame_id,\
        field.pose.pose.position.x,field.pose.pose.position.y,field.pose.pose.position.z,field.pose.pose.orientation.x,\
        field.pose.pose.orientation.y,field.pose.pose.orientation.z,field.pose.pose.orientation.w,field.pose.covariance0,\
        field.twist.twist.linear.x\n";
    let text = format!(
        "{rostopic}7,0,{a},odom,,1,2,3,0,0,0,1,0.1,9\n8,1,{b},odom,,2,2,3,0,0,0.70710678,0.70710678,0.1,9\n"
    );
    let run = is_the_run(&text, csv, STAMPS_NS);
    assert_says(&run.notes.join("; "), &["line 1: field.header.stamp, field.pose.pose.position.x"]);
    // Of a simulation: nanoseconds all the same.
    let text = text.replace(a, "5000000000").replace(b, "5100000000");
    is_the_run(&text, csv, [5_000_000_000, 5_100_000_000]);
    let text = "secs,nsecs,x,y,z,qx,qy,qz,qw\n1690309709,285305500,1,2,3,0,0,0,1\n\
        1690309709,385305500,2,2,3,0,0,0.70710678,0.70710678\n";
    is_the_run(text, csv, STAMPS_NS);
}

#[test]
fn names_that_say_what_is_so_anyway_change_nothing() {
    let tum = "# timestamp tx ty tz qx qy qz qw\n0 1 2 3 0 0 0 1\n1 2 2 3 0 0 0.70710678 0.70710678\n";
    assert_eq!(is_the_run(tum, TrajectoryFormat::Tum, [0, 1_000_000_000]).notes, [""; 0]);
    let euroc = format!(
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n\
         {},1,2,3,1,0,0,0\n{},2,2,3,0.70710678,0,0,0.70710678\n",
        STAMPS_NS[0], STAMPS_NS[1]
    );
    assert_eq!(is_the_run(&euroc, TrajectoryFormat::Euroc, STAMPS_NS).notes, [""; 0]);
    // Without names nothing says which number of a quaternion is w.
    let bare = euroc.split_once('\n').unwrap().1;
    assert_says(&read(bare).unwrap().notes.join("; "), &["quaternions are read as w x y z"]);
}

#[test]
fn stamps_since_1970_have_any_unit() {
    for (unit, digits) in
        [(TimeUnit::Nanoseconds, 19), (TimeUnit::Microseconds, 16), (TimeUnit::Milliseconds, 13)]
    {
        let stamps = STAMPS_NS.map(|ns| ns.to_string()[..digits].to_owned());
        let ns = STAMPS_NS.map(|ns| ns - ns % unit.in_ns());
        let [a, b] = &stamps;
        let tum = format!("{a} 1 2 3 0 0 0 1\n{b} 2 2 3 0 0 0.70710678 0.70710678\n");
        let run = is_the_run(&tum, TrajectoryFormat::Tum, ns);
        assert_says(&run.notes.join("; "), &[&format!("stamps in {}", unit.name())]);
        assert_eq!(raw(&tum).notes, run.notes);
        let csv = format!("t,x,y,z,qx,qy,qz,qw\n{}", tum.replace(' ', ","));
        assert_says(&is_the_run(&csv, TrajectoryFormat::Csv, ns).notes.join("; "), &[unit.name()]);
    }
    // EuRoC's columns with microseconds.
    let text = "1690309709285305,1,2,3,1,0,0,0\n1690309709385305,2,2,3,0.70710678,0,0,0.70710678\n";
    let run =
        is_the_run(text, TrajectoryFormat::Euroc, [1_690_309_709_285_305_000, 1_690_309_709_385_305_000]);
    assert_says(&run.notes.join("; "), &["stamps in microseconds"]);
}

#[test]
fn stamps_that_may_be_this_or_that_are_asked_for() {
    let line = |k: i64| format!("{} {k} 0 0 0 0 0 1\n", 3_000_000_000 + k * 100_000_000);
    let text = [0, 1, 2, 3, 4].map(line).concat();
    refusals(
        refused,
        "run.csv: ",
        &[
            (
                &text,
                "line 1: stamps from 3000000000 to 3400000000, 100000000 apart | the time unit must be given",
            ),
            (
                &format!("t x y z qx qy qz qw\n{text}"),
                "line 2: stamps from | must be given (s, ms, us or ns)",
            ),
        ],
    );
    let given = |unit| {
        let (_folder, path) = file(&text);
        let run = read_trajectory_as(&path, None, Some(unit)).unwrap().trajectory;
        let raw = read_raw_trajectory_as(&path, None, Some(unit)).unwrap();
        (run.stamps_ns().unwrap()[1], raw.stamps_s.unwrap()[1])
    };
    assert_eq!(given(TimeUnit::Nanoseconds), (3_100_000_000, 3.1));
    assert_eq!(given(TimeUnit::Microseconds), (3_100_000_000_000, 3100.0));
    assert_eq!(given(TimeUnit::Seconds), (3_100_000_000_000_000_000, 3.1e9));
    // Files whose stamps tell what they are do not need it.
    let since_1970 = file("1690309709.25 1 0 0 0 0 0 1\n");
    let raw = read_raw_trajectory_as(&since_1970.1, None, Some(TimeUnit::Nanoseconds)).unwrap();
    assert_eq!(raw.stamps_s, Some(vec![1_690_309_709.25]));
    // What a name says needs no other word, and is not doubted where the word is for all files.
    let named = format!("t_ns x y z qx qy qz qw\n{text}");
    let raw = read_raw_trajectory_as(&file(&named).1, None, Some(TimeUnit::Milliseconds)).unwrap();
    assert_eq!(raw.stamps_s.unwrap()[1], 3.1);
}

#[test]
fn what_is_wrong_is_named_with_line_column_and_value() {
    let head = "time,x,y,z,qx,qy,qz,qw,frame\n0.5,1,2,3,0,0,0,1,map\n";
    refusals(
        |line| refused(&format!("{head}\n{line}\n")),
        "run.csv: line 4: ",
        &[
            ("0.6,1,2,3,0,0,0,1", "8 columns, line 1 names 9 | cut?"),
            ("0.6,1,2,3,0,0,0,1,map,9", "10 columns"),
            ("0.6,1,x2,3,0,0,0,1,map", "`x2` in the column `y` is not a number"),
            ("0.6,1,,3,0,0,0,1,map", "`` in the column `y` is not a number"),
            ("0.6,1,2,3,0,0,0,nan,map", "`nan` in the column `qw` is not finite"),
            ("now,1,2,3,0,0,0,1,map", "`now` in the column `time` is not a number"),
        ],
    );
    let pair = "secs,nsecs,x,y,z,qx,qy,qz,qw\n";
    refusals(
        |text| read(text).unwrap_err().to_string(),
        "run.csv: ",
        &[
            (&format!("{head}0.6,1,2,3,0,0,0,0.5,map\n"), "line 3: | norm 0.5"),
            (&format!("{head}0.6,1e9,2,3,0,0,0,1,map\n"), "line 3: | 1e9 m"),
            (&format!("{pair}99999999999,0,1,2,3,0,0,0,1\n"), "line 2: | 99999999999 s"),
            (&format!("{pair}1,1000000000,1,2,3,0,0,0,1\n"), "line 2: 1000000000 nanoseconds after a second"),
            (&format!("{pair}1.5,0,1,2,3,0,0,0,1\n"), "`1.5` in the column `secs` is no whole number"),
            ("time,x,y,z\n0,1,2,3\n", "line 1: no quaternion among the columns `time,x,y,z` | places alone"),
            (
                "GPSTime,easting,northing,altitude,roll,pitch,heading\n1,1,2,3,0,0,0\n",
                "line 1: | Euler angles are not read",
            ),
            ("time,x,y,z,qx,qy,qz,qw\n", "no poses"),
            ("a,b\n1,2\n", "line 1: 2 columns | name the columns"),
        ],
    );
    let given = read_trajectory_as(&file("1 2 3\n").1, Some(TrajectoryFormat::Csv), None).unwrap_err();
    assert_says(&given.to_string(), &["no line with the names of columns"]);
}

/// Whatever parts the columns; those that are left out are not used.
#[test]
fn an_empty_cell_may_end_a_row() {
    for delimiter in [",", ";", "\t"] {
        for end in ["\n", "\r\n"] {
            let text =
                ["stamp,tx,ty,tz,qx,qy,qz,qw,quality,note", "1.5,1,2,3,0,0,0,1,7,", "2.5,1,2,3,0,0,0,1,,"]
                    .map(|line| line.replace(',', delimiter) + end)
                    .concat();
            assert_eq!(
                read(&text).unwrap().trajectory.stamps_ns(),
                Some(&[1_500_000_000, 2_500_000_000][..])
            );
            assert_eq!(raw(&text).stamps_s, Some(vec![1.5, 2.5]), "{text:?}");
            // Blanks are no cells.
            let blank = text.replacen(end, &format!("  {end}"), 1);
            assert_eq!(read(&blank).unwrap().trajectory.len(), 2, "{blank:?}");
            // One cell too few is no empty one.
            let cut = ["stamp,tx,ty,tz,qx,qy,qz,qw,quality,note", "1.5,1,2,3,0,0,0,1,"];
            let cut = cut.map(|line| line.replace(',', delimiter) + end).concat();
            assert_says(&refused(&cut), &["line 2: ", "line 1 names 10: is the line cut?"]);
        }
    }
}
