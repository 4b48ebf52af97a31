use crate::common::{
    F64, Message, POINTS, STAMP_NS, U32, assert_says, open, open_error, read_all, write_messages,
};
use dmp_log::{LogOptions, PointTime, TimeUnit, open_log};
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
