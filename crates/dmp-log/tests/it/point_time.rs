use crate::common::{
    F64, Message, POINTS, STAMP_NS, U32, assert_says, open, open_error, read_all, write_messages,
};
use dmp_log::{LogOptions, PointTime, TimeUnit, open_log, outline_log};
use std::path::PathBuf;

const OFFSETS_S: [f64; 4] = [0.0, 0.033, 0.066, 0.099];

/// Five scans 0.1 s apart whose points have a time field with what `value` makes of stamp and offset.
fn log_of(
    folder: &tempfile::TempDir,
    name: &'static str,
    datatype: u8,
    value: impl Fn(i64, f64) -> Vec<u8>,
) -> PathBuf {
    let path = folder.path().join("log.mcap");
    let messages: Vec<_> = (0..5)
        .map(|k| {
            let stamp_ns = STAMP_NS + k * 100_000_000;
            let mut message =
                Message { stamp_ns, row_step: 0, data: Vec::new(), ..Message::of(&[[1.0; 3]; 5]) };
            message.fields.push((name, 12, datatype));
            // The last point is a hole, with a time of zero as many drivers leave it.
            let times = OFFSETS_S.iter().map(|&offset| value(stamp_ns, offset));
            for (point, time) in times.enumerate() {
                message.data.extend([1.0, point as f32, 3.0_f32].iter().flat_map(|c| c.to_le_bytes()));
                message.data.extend(&time);
                message.point_step = 12 + time.len() as u32;
            }
            message.data.extend([0, 0, 0xc0, 0x7f].repeat(3));
            message.data.resize(5 * message.point_step as usize, 0);
            (0, message.encode())
        })
        .collect();
    write_messages(&path, &[POINTS], &messages);
    path
}

fn f64_of(value: f64) -> Vec<u8> {
    value.to_le_bytes().into()
}

#[test]
fn equal_times_are_none_and_garbage_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    for value in [0.0, 12.5] {
        let log = open(&log_of(&folder, "time", F64, move |_, _| f64_of(value)));
        assert!(!log.summary().has_point_times());
        assert_says(&log.summary().notes.join("; "), &["field `time`", "the same for all points"]);
        assert!(read_all(&*log).iter().all(|scan| scan.time_offsets_ns.is_empty()));
    }
    let path = log_of(&folder, "time", F64, |_, s| f64_of(s * 37.0));
    let error = open_error(&path, &LogOptions::default());
    assert_says(&error, &["log.mcap", "field `time`", "spans 3.66", "0.1000 s", "`point_time`"]);
    let path = log_of(&folder, "time", F64, |_, s| f64_of(s + 86_400.0));
    assert_says(&open_error(&path, &LogOptions::default()), &["86400", "seconds", "`point_time`"]);
    let with = |point_time| LogOptions { point_time, ..LogOptions::default() };
    let ignored = open_log(&path, &with(PointTime::Ignore)).unwrap();
    assert!(!ignored.summary().has_point_times());
    assert_says(&ignored.summary().notes.join("; "), &["not used"]);
    let given = open_log(&path, &with(PointTime::Relative(TimeUnit::Seconds))).unwrap();
    assert_says(given.summary().point_times.as_deref().unwrap(), &["seconds after", "as given"]);
    assert_eq!(read_all(&*given)[0].time_offsets_ns[0], 86_400_000_000_000);
}

#[test]
fn a_time_that_is_no_number_takes_the_point_out() {
    let folder = tempfile::tempdir().unwrap();
    let value = |_: i64, s: f64| f64_of(if s == 0.033 { f64::NAN } else { s });
    let log = open(&log_of(&folder, "time", F64, value));
    let scan = &read_all(&*log)[0];
    assert_eq!(scan.time_offsets_ns, [0, 0, 66_000_000, 99_000_000, 0]);
    assert!(scan.points_in_sensor_m[1].iter().all(|c| c.is_nan()));
    assert_eq!(scan.points_in_sensor_m[2], [1.0, 2.0, 3.0]);
}

#[test]
fn a_scan_without_the_field_is_skipped_and_an_option_without_it_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let plain = Message::of(&[[1.0; 3]; 4]);
    let mut timed = Message { data: Vec::new(), point_step: 16, row_step: 0, ..plain.clone() };
    timed.fields.push(("t", 12, U32));
    for offset in OFFSETS_S {
        timed.data.extend(1_f32.to_le_bytes().repeat(3));
        timed.data.extend(((offset * 1e9) as u32).to_le_bytes());
    }
    let empty = Message::of(&[]);
    write_messages(&path, &[POINTS], &[(0, timed.encode()), (0, plain.encode()), (0, empty.encode())]);
    let log = open(&path);
    assert_eq!(log.frames().len(), 2);
    assert_says(&log.summary().damage[0].place, &["message 1"]);
    assert_says(&log.summary().damage[0].what, &["no field `t`"]);
    assert_says(&log.summary().notes.join("; "), &["0.1 s is used"]);

    write_messages(&path, &[POINTS], &[(0, plain.encode())]);
    let options = LogOptions { point_time: PointTime::Absolute(TimeUnit::Seconds), ..LogOptions::default() };
    let error = open_log(&path, &options).unwrap_err();
    assert!(error.is_usage());
    assert_says(&error.to_string(), &["log.mcap", "`point_time` absolute-s", "[x, y, z]"]);
}

/// A log of five scans 0.1 s apart whose headers have this stamp, and whose points have these fields.
fn log_with(
    folder: &tempfile::TempDir,
    header_ns: impl Fn(i64) -> i64,
    fields: &[(&'static str, u8)],
    values: impl Fn(i64, f64) -> Vec<Vec<u8>>,
) -> PathBuf {
    let path = folder.path().join("log.mcap");
    let message = |k: i64| {
        let stamp_ns = STAMP_NS + k * 100_000_000;
        let plain = Message::of(&[[1.0; 3]; 4]);
        let mut message = Message { stamp_ns: header_ns(stamp_ns), row_step: 0, data: Vec::new(), ..plain };
        for (point, offset_s) in OFFSETS_S.into_iter().enumerate() {
            message.data.extend([1.0, point as f32, 3.0_f32].iter().flat_map(|c| c.to_le_bytes()));
            let mut at = 12;
            for (&(name, datatype), value) in fields.iter().zip(values(stamp_ns, offset_s)) {
                if point == 0 {
                    message.fields.push((name, at, datatype));
                }
                at += value.len() as u32;
                message.data.extend(value);
            }
            message.point_step = at;
        }
        (0, message.encode())
    };
    write_messages(&path, &[POINTS], &(0..5).map(message).collect::<Vec<_>>());
    path
}

/// The stamp of every scan and the times of its points, nanoseconds, are those that were meant, to this.
fn assert_times(path: &std::path::Path, options: &LogOptions, within_ns: i64, case: &str) {
    let log = open_log(path, options).unwrap_or_else(|error| panic!("{case}: {error}"));
    let outline = outline_log(path, options).unwrap();
    let part = outline.open(&[0, 1, 2, 3, 4]).unwrap();
    for scans in [read_all(&*log), read_all(&*part)] {
        assert_eq!(scans.len(), 5, "{case}");
        for (k, scan) in scans.iter().enumerate() {
            assert_eq!(scan.time_offsets_ns.len(), 4, "{case}");
            for (found_ns, offset_s) in scan.time_offsets_ns.iter().zip(OFFSETS_S) {
                let meant_ns = STAMP_NS + k as i64 * 100_000_000 + (offset_s * 1e9) as i64;
                let off_ns = scan.stamp_ns.unwrap() + found_ns - meant_ns;
                assert!(off_ns.abs() <= within_ns, "{case}: off by {off_ns} ns");
            }
        }
    }
}

/// What the fields of a point hold at so many seconds of a scan with this stamp.
type Values<'a> = &'a dyn Fn(i64, f64) -> Vec<Vec<u8>>;

#[test]
fn without_stamps_in_headers_the_points_are_the_clock() {
    let folder = tempfile::tempdir().unwrap();
    let no_stamp = |_: i64| 0;
    let at_s = |stamp_ns: i64, s: f64| stamp_ns as f64 / 1e9 + s;
    let split = |stamp_ns: i64, s: f64| {
        let ns = stamp_ns + (s * 1e9) as i64;
        (ns / 1_000_000_000, ns % 1_000_000_000)
    };
    let two: Values<'_> = &|stamp_ns, s| {
        let (seconds, ns) = split(stamp_ns, s);
        [seconds, ns].map(|part| (part as u32).to_le_bytes().to_vec()).into()
    };
    // Hesai and glim: seconds; others: what a double holds of milli-, micro- and nanoseconds.
    let cases: [(&[(&'static str, u8)], Values<'_>); 7] = [
        (&[("timestamp", F64)], &|stamp_ns, s| vec![f64_of(at_s(stamp_ns, s))]),
        (&[("time", F64)], &|stamp_ns, s| vec![f64_of(at_s(stamp_ns, s) * 1e3)]),
        (&[("t", F64)], &|stamp_ns, s| vec![f64_of(at_s(stamp_ns, s) * 1e6)]),
        (&[("timestamps", F64)], &|stamp_ns, s| vec![f64_of((stamp_ns as f64) + s * 1e9)]),
        (&[("timeSecond", U32), ("timeNanosecond", U32)], two),
        (&[("t_sec", U32), ("t_nsec", U32)], two),
        (&[("intensity", F64), ("gps_time", F64)], &|stamp_ns, s| {
            vec![f64_of(s * 700.0), f64_of(at_s(stamp_ns, s))]
        }),
    ];
    for (fields, values) in cases {
        let path = log_with(&folder, no_stamp, fields, values);
        assert_times(&path, &LogOptions::default(), 600, fields[0].0);
        let notes = open(&path).summary().notes.join("; ");
        assert_says(&notes, &["5 scans have no stamp in their header (0 s)", "first point"]);
    }
    // A clock of the sensor's own says no date: nothing is made up.
    let path = log_with(&folder, no_stamp, &[("timestamp", F64)], |stamp_ns, s| {
        vec![f64_of(at_s(stamp_ns - STAMP_NS, s) + 5000.0)]
    });
    let error = open_error(&path, &LogOptions::default());
    assert_says(
        &error,
        &["`timestamp`", "every scan has the stamp 0.000 s", "5000", "give the scans stamps"],
    );
}

#[test]
fn seconds_and_nanoseconds_in_two_fields_are_one_time() {
    let folder = tempfile::tempdir().unwrap();
    let parts = |ns: i64, below: i64| {
        let per_s = 1_000_000_000 / below;
        vec![
            ((ns / 1_000_000_000) as u32).to_le_bytes().to_vec(),
            ((ns % 1_000_000_000 / below).rem_euclid(per_s) as u32).to_le_bytes().to_vec(),
        ]
    };
    let in_ns = |s: f64| (s * 1e9) as i64;
    for (names, below, absolute) in [
        (["timeSecond", "timeNanosecond"], 1, true),
        (["sec", "nsec"], 1, true),
        (["timestamp_s", "timestamp_ns"], 1, true),
        (["tv_sec", "tv_usec"], 1000, true),
        (["offset_sec", "offset_nsec"], 1, false),
        (["stampSecs", "stampNanosecs"], 1, false),
    ] {
        let from = |stamp_ns: i64| if absolute { stamp_ns } else { 0 };
        let fields = [(names[0], U32), (names[1], U32)];
        let path = log_with(&folder, |ns| ns, &fields, |stamp_ns, s| parts(from(stamp_ns) + in_ns(s), below));
        assert_times(&path, &LogOptions::default(), below, names[0]);
        let words = open(&path).summary().point_times.clone().unwrap();
        assert_says(&words, &[&format!("field `{} + {}`", names[0], names[1]), "nanoseconds"]);
    }
    // Two times of their own are no parts of one.
    let path = log_with(
        &folder,
        |ns| ns,
        &[("time_s", F64), ("time_ns", U32)],
        |_, s| vec![f64_of(s), (in_ns(s) as u32).to_le_bytes().to_vec()],
    );
    assert_times(&path, &LogOptions::default(), 1, "time_s");
    assert_says(open(&path).summary().point_times.as_deref().unwrap(), &["field `time_s`"]);
}

#[test]
fn a_field_of_another_name_is_named_and_can_be_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let milliseconds = |s: f64| ((s * 1e3) as f32).to_le_bytes().to_vec();
    for name in ["curvature", "offset", "dt", "usec_of_scan", "firing"] {
        let path = log_with(
            &folder,
            |ns| ns,
            &[(name, 7), ("intensity", 7)],
            |_, s| vec![milliseconds(s), milliseconds(s)],
        );
        let log = open(&path);
        assert!(!log.summary().has_point_times());
        let notes = log.summary().notes.join("; ");
        assert_says(
            &notes,
            &[&format!("field `{name}` may be times of points, as milliseconds"), "is not used"],
        );
        assert!(!notes.contains("intensity"), "{notes}");
        let options = LogOptions { point_time_field: Some(name.into()), ..LogOptions::default() };
        assert_times(&path, &options, 10, name);
        let unit = PointTime::Relative(TimeUnit::Milliseconds);
        assert_times(&path, &LogOptions { point_time: unit, ..options }, 10, name);
    }
    let path = log_with(
        &folder,
        |ns| ns,
        &[("a", U32), ("b", U32), ("c", 7)],
        |_, s| vec![vec![0; 4], ((s * 1e9) as u32).to_le_bytes().to_vec(), milliseconds(0.5)],
    );
    let with = |field: &str| LogOptions { point_time_field: Some(field.into()), ..LogOptions::default() };
    assert_times(&path, &with("a + b"), 1, "a + b");
    let says = |field: &str, words: &[&str]| {
        let error = open_log(&path, &with(field)).unwrap_err();
        assert!(error.is_usage(), "{error}");
        assert_says(&error.to_string(), words);
    };
    says("d", &["log.mcap: `point_time_field` d was given", "the fields [x, y, z, a, b, c]"]);
    says("c", &["`point_time_field` c was given, but its value is the same for all points"]);
    assert_says(&open_error(&path, &with("x")), &["x"]);
}
