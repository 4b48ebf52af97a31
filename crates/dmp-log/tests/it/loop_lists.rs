use crate::common::{assert_says, refusals};
use dmp_log::{
    KeyframeTimes, KeyframeTimesFault, TimeUnit, parse_keyframe_times, parse_keyframe_times_in,
    parse_loop_labels, read_keyframe_times, read_keyframe_times_in, read_loop_labels, write_keyframe_times,
};
use std::collections::BTreeMap;
use std::fs;

fn labels_error(text: &str) -> String {
    parse_loop_labels(text.as_bytes()).unwrap_err().to_string()
}

fn times(text: &str) -> KeyframeTimes {
    parse_keyframe_times(text.as_bytes()).unwrap()
}

fn times_error(text: &str) -> String {
    parse_keyframe_times(text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn labels_are_read_as_people_write_them() {
    let text = "\u{feff}from,to,label,kind\r\n# by hand\n12,400,true,near\r\n\n 400\t12 YES # again\n\
        7, -3, False\n9007199254740993 2 1\n5 6 0 more of it\n8 9 nO";
    let found = parse_loop_labels(text.as_bytes()).unwrap();
    let expected = [
        ((-3, 7), false),
        ((2, 9_007_199_254_740_993), true),
        ((5, 6), false),
        ((8, 9), false),
        ((12, 400), true),
    ];
    assert_eq!((found.labels.clone(), found.repeated), (BTreeMap::from(expected), 1));
    assert_eq!((found.of(400, 12), found.of(7, -3), found.of(7, 3)), (Some(true), Some(false), None));
    // Names of columns need not be there.
    assert_eq!(parse_loop_labels(b"1 2 true").unwrap().labels, BTreeMap::from([((1, 2), true)]));
}

#[test]
fn labels_that_cannot_be_are_named_with_their_lines() {
    refusals(
        labels_error,
        "",
        &[
            ("12,400,true\n# so\n400,12,0\n", "line 3: | between 400 and 12 is false | in line 1 it is true"),
            ("1 2 true\n3 4 maybe\n", "line 2: | label `maybe`"),
            ("1 2 true\n3 4\n", "line 2: | 2 columns, expected 3"),
            ("1,,true\n", "line 1: | 2 columns, expected 3"),
            ("1 2 true\n3 b 1\n", "line 2: | the id `b` is no whole number"),
            ("5 5 true\n", "line 1: | from the vertex 5 to itself"),
            // One line of names is allowed, the first; and a line with a number in it is none.
            ("from to label\nfrom to label\n", "line 2: | the id `from`"),
            ("12 to label\n", "line 1: | the id `to`"),
            ("1.5 2.5 true\n", "line 1: | the id `1.5`"),
            ("1 9223372036854775808 true\n", "line 1: | no whole number"),
            ("1 2 true\n\u{1}\n3 4 1", "line 2: | 1 columns"),
            ("", "the whole file: no labels"),
            ("# from to label\n\n", "the whole file: no labels"),
            ("from,to,label\n", "the whole file: no labels"),
        ],
    );
    assert_says(&parse_loop_labels(b"1 2 1\n\xff\xfe").unwrap_err().to_string(), &["line 2: ", "not text"]);
}

#[test]
fn times_are_read_with_ids_and_without() {
    // Further apart than neighbours of an f64.
    let stamps_ns = vec![1_690_309_709_285_305_500, 1_690_309_709_285_305_501, 1_690_309_710_000_000_000];
    let plain = times("stamp\n1690309709.285305500\n1690309709.285305501 # next\r\n1.69030971e9\n");
    let notes = Vec::new();
    assert_eq!(plain, KeyframeTimes { ids: None, stamps_ns: stamps_ns.clone(), notes: notes.clone() });
    let with_ids = times("id,stamp\n40,1690309710\n-1,1690309709.285305500\n\n7 1690309709.285305501");
    assert_eq!(with_ids, KeyframeTimes { ids: Some(vec![-1, 7, 40]), stamps_ns: stamps_ns.clone(), notes });
    let pose = "1 2 3 0 0 0 1";
    let tum = times(&format!(
        "# timestamp tx ty tz qx qy qz qw\n1690309709.285305500 {pose}\n1690309709.285305501 {pose}\n\
        1690309710 {pose}\n"
    ));
    assert_eq!(tum, plain);
    for written in [&plain, &with_ids] {
        let mut again = Vec::new();
        write_keyframe_times(&mut again, written).unwrap();
        assert_eq!(&parse_keyframe_times(&again).unwrap(), written);
    }
    assert_eq!(plain.of_vertices(&[3, 5, 900]), Ok(stamps_ns.clone()));
    let fault = KeyframeTimesFault::OtherCount { stamps: 3, vertices: 2 };
    assert_eq!(plain.of_vertices(&[3, 5]), Err(fault));
    assert_eq!(with_ids.of_vertices(&[-1, 40]), Ok(vec![stamps_ns[0], stamps_ns[2]]));
    assert_eq!(with_ids.of_vertices(&[-1, 8]), Err(KeyframeTimesFault::NoStamp { id: 8 }));
}

#[test]
fn times_that_cannot_be_are_named_with_their_lines() {
    refusals(
        times_error,
        "",
        &[
            (
                "0.5\n1.5\n\n1.5\n",
                "line 4: | the stamp 1.500000000 s is not after that in line 2, 1.500000000 s",
            ),
            // The order is that of the ids.
            (
                "9 3\n4 3.5\n",
                "line 1: | the vertex 9 has the stamp 3.000000000 s | that of 4 in line 2, 3.500000000 s",
            ),
            ("4 1\n9 2\n4 3\n", "line 3: | the vertex 4 has a stamp in line 1 already"),
            ("1 2 3\n", "line 1: | 3 columns, expected 1"),
            ("1\n2 3\n", "line 2: | 2 columns, the lines before it have 1"),
            ("1 2\nb 3\n", "line 2: | the id `b`"),
            ("1\nsoon\n", "line 2: | not a number of seconds: `soon`"),
            ("9999999999.5\n", "line 1: | another unit"),
            ("1 2 3 4 0 0 0 x\n", "line 1: | `x` is not a number"),
            ("", "the whole file: no stamps"),
            ("# times\n", "the whole file: no stamps"),
            ("id stamp\n", "the whole file: no stamps"),
        ],
    );
}

#[test]
fn times_are_in_the_unit_that_is_found_or_given() {
    let stamps_ns = vec![1_690_309_709_285_000_000, 1_690_309_710_000_000_000];
    for (text, unit) in [
        ("1690309709285\n1690309710000\n", "milliseconds"),
        ("1690309709285000\n1690309710000000\n", "microseconds"),
        ("1690309709285000000\n1690309710000000000\n", "nanoseconds"),
        ("7 1690309710000\n-1 1690309709285\n", "milliseconds"),
        ("1690309709285000 1 2 3 0 0 0 1\n1690309710000000 1 2 3 0 0 0 1\n", "microseconds"),
    ] {
        let found = times(text);
        assert_eq!(found.stamps_ns, stamps_ns, "{text}");
        assert_eq!(found.notes.len(), 1);
        assert_says(&found.notes[0], &["stamps in", unit]);
    }
    // A clock that begins with the log is asked for.
    let own = "12000\n13500\n";
    assert_says(&times_error(own), &["line 1: stamps from 12000 to 13500", "the time unit must be given"]);
    let found = parse_keyframe_times_in(own.as_bytes(), Some(TimeUnit::Milliseconds)).unwrap();
    assert_eq!(found.stamps_ns, [12_000_000_000, 13_500_000_000]);
    assert!(found.notes.is_empty());
    // Few keyframes, minutes apart, as they are written.
    for stamps_ns in [vec![0, 600_000_000_000], vec![i64::MIN + 1, i64::MAX], vec![5]] {
        let mut text = Vec::new();
        let written = KeyframeTimes { ids: None, stamps_ns, notes: Vec::new() };
        write_keyframe_times(&mut text, &written).unwrap();
        assert_eq!(parse_keyframe_times(&text).unwrap().stamps_ns, written.stamps_ns);
    }
}

#[test]
fn files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("list.txt");
    assert_says(&read_loop_labels(&path).unwrap_err().to_string(), &["list.txt: no such file"]);
    fs::write(&path, "1 2 x\n").unwrap();
    assert_says(&read_loop_labels(&path).unwrap_err().to_string(), &["list.txt: line 1: ", "`x`"]);
    assert_says(&read_keyframe_times(&path).unwrap_err().to_string(), &["list.txt: line 1: 3 columns"]);
    fs::write(&path, "1 2 1\n").unwrap();
    assert_eq!(read_loop_labels(&path).unwrap().of(2, 1), Some(true));
    fs::write(&path, "0.1\n").unwrap();
    assert_eq!(read_keyframe_times(&path).unwrap().stamps_ns, [100_000_000]);
    assert_eq!(read_keyframe_times_in(&path, Some(TimeUnit::Milliseconds)).unwrap().stamps_ns, [100_000]);
}
