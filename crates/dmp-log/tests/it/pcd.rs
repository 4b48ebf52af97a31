//! PCD clouds: what is read, what is refused, and that no header is trusted.

use crate::cloud::{error, read};
use crate::common::{Random, assert_says};
use dmp_log::{CloudFormat, LengthUnit, LogError, read_cloud};
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

type Points = Vec<[f64; 3]>;

/// Points at UTM coordinates, as float64 x and y and float32 z.
fn points(count: usize) -> Points {
    let mut random = Random(5);
    let mut near = || (random.next() % 100_000) as f64 / 1024.0;
    (0..count).map(|_| [500_000.0 + near(), 5_400_000.0 + near(), near()]).collect()
}

fn header(count: usize, data: &str) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS intensity x _ y normal z\n\
         SIZE 2 8 1 8 4 4\nTYPE U F U F F F\nCOUNT 1 1 3 1 3 1\nWIDTH {count}\nHEIGHT 1\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA {data}\n"
    )
}

fn text(points: &Points) -> Vec<u8> {
    let mut body = String::new();
    for [x, y, z] in points {
        writeln!(body, "7 {x} 0 0 0 {y} 0.5 0.5 nan {z}").unwrap();
    }
    body.into_bytes()
}

fn binary(points: &Points) -> Vec<u8> {
    let mut body = Vec::new();
    for [x, y, z] in points {
        body.extend([7, 0]);
        body.extend(x.to_le_bytes());
        body.extend([9; 3]);
        body.extend(y.to_le_bytes());
        body.extend([0x3f; 12]);
        body.extend((*z as f32).to_le_bytes());
    }
    body
}

/// The columns, the padding among them or not, in LZF: runs as they are, and copies of bytes that repeat.
fn compressed(points: &Points, padded: bool) -> Vec<u8> {
    let mut columns = [7, 0].repeat(points.len());
    points.iter().for_each(|p| columns.extend(p[0].to_le_bytes()));
    if padded {
        columns.extend(vec![9; 3 * points.len()]);
    }
    points.iter().for_each(|p| columns.extend(p[1].to_le_bytes()));
    columns.extend(vec![0x3f; 12 * points.len()]);
    points.iter().for_each(|p| columns.extend((p[2] as f32).to_le_bytes()));
    let packed = lzf(&columns);
    [(packed.len() as u32).to_le_bytes(), (columns.len() as u32).to_le_bytes()]
        .concat()
        .into_iter()
        .chain(packed)
        .collect()
}

fn lzf(data: &[u8]) -> Vec<u8> {
    let (mut packed, mut at) = (Vec::new(), 0);
    while at < data.len() {
        // What repeats two bytes later, as the first column does, and long runs.
        let copied = match at {
            0 | 1 => 0,
            _ => (at..data.len().min(at + 264)).take_while(|&k| data[k] == data[k - 2]).count(),
        };
        if copied >= 9 {
            packed.extend([7 << 5, (copied - 9) as u8, 1]);
            at += copied;
        } else {
            let run = &data[at..data.len().min(at + 5)];
            packed.push(run.len() as u8 - 1);
            packed.extend(run);
            at += run.len();
        }
    }
    packed
}

fn write(folder: &tempfile::TempDir, header: &str, body: &[u8]) -> PathBuf {
    let path = folder.path().join("map.pcd");
    fs::write(&path, [header.as_bytes(), body].concat()).unwrap();
    path
}

/// A whole file.
pub(crate) fn file(data: &str, count: usize) -> Vec<u8> {
    let points = points(count);
    let body = match data {
        "ascii" => text(&points),
        "binary" => binary(&points),
        _ => compressed(&points, false),
    };
    [header(count, data).into_bytes(), body].concat()
}

#[test]
fn pcd_is_read_in_every_encoding() {
    let folder = tempfile::tempdir().unwrap();
    // More than a batch, and more than the decoders keep.
    for count in [0, 1, 70_000] {
        let points = points(count);
        for (data, body) in [
            ("ascii", text(&points)),
            ("binary", binary(&points)),
            ("binary_compressed", compressed(&points, false)),
            ("binary_compressed", compressed(&points, true)),
        ] {
            let (summary, found) = read(&write(&folder, &header(count, data), &body)).unwrap();
            assert_eq!((summary.format, summary.unit_note), (CloudFormat::Pcd, None));
            assert!(found == points, "{count} points, {data}");
        }
    }
}

#[test]
fn a_unit_that_is_given_brings_to_metres() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(&folder, &header(2, "binary"), &binary(&points(2)));
    let mut found = Points::new();
    read_cloud(&path, Some(LengthUnit::Foot), |batch| {
        found.extend_from_slice(batch);
        Ok::<(), LogError>(())
    })
    .unwrap();
    assert_eq!(found, points(2).iter().map(|p| p.map(|c| c * 0.3048)).collect::<Points>());
}

#[test]
fn row_08_points_that_are_not_finite_are_handed_on() {
    let folder = tempfile::tempdir().unwrap();
    let points = vec![[1.0, 2.0, 3.0], [f64::NAN, f64::INFINITY, f64::NEG_INFINITY], [4.0, 5.0, 6.0]];
    for (data, body) in [
        ("ascii", text(&points)),
        ("binary", binary(&points)),
        ("binary_compressed", compressed(&points, false)),
    ] {
        let (summary, found) = read(&write(&folder, &header(3, data), &body)).unwrap();
        assert_eq!(summary.points, 3);
        assert!(found[1][0].is_nan() && found[1][1] == f64::INFINITY && found[1][2] == f64::NEG_INFINITY);
        assert_eq!([found[0], found[2]], [points[0], points[2]]);
    }
}

#[test]
fn row_03_lying_headers_are_refused_before_anything_is_allocated() {
    let folder = tempfile::tempdir().unwrap();
    let (good, points) = (3, points(3));
    let says = |header: &str, body: &[u8], parts: &[&str]| {
        let error = error(&write(&folder, header, body));
        assert_says(&error, &["map.pcd"]);
        assert_says(&error, parts);
    };
    let [huge, told] = ["18446744073709551615", "18,446,744,073,709,551,615"];
    let claim = |data: &str, count: &str| {
        header(good, data)
            .replace("WIDTH 3", &format!("WIDTH {count}"))
            .replace("POINTS 3", &format!("POINTS {count}"))
    };
    let claims: [(&str, Vec<u8>); 2] = [("ascii", text(&points)), ("binary", binary(&points))];
    for (data, body) in &claims {
        says(&claim(data, huge), body, &["byte", told]);
        says(&claim(data, "1000000000000"), body, &["byte", "1,000,000,000,000 points"]);
    }
    says(&claim("binary", "4"), &binary(&points), &["byte 201", "4 points of 37 bytes", "111 bytes"]);
    says(&claim("ascii", "4"), &text(&points), &["line 15", "ends after 3 of 4 points"]);
    says(&claim("binary_compressed", huge), &compressed(&points, false), &["unpacked", told]);
    says(&claim("binary_compressed", "4"), &compressed(&points, false), &["102 bytes unpacked", "4 points"]);

    let packed = compressed(&points, false);
    let change = |at: usize, with: u32| {
        let mut changed = packed.clone();
        changed[at..at + 4].copy_from_slice(&with.to_le_bytes());
        changed
    };
    let compressed_header = header(good, "binary_compressed");
    says(&compressed_header, &change(0, u32::MAX), &["4,294,967,295 compressed bytes"]);
    says(&compressed_header, &change(4, u32::MAX), &["unpack to 4,294,967,295"]);
    says(&compressed_header, &packed[..6], &["byte", "do not fit in the 6 bytes"]);
    says(&compressed_header, &change(0, 20), &["cannot unpack"]);
    let garbage = [&packed[..8], &[0xff; 100]].concat();
    says(&compressed_header, &garbage, &["cannot unpack", "a copy from 8192 bytes back, 0 are there"]);
}

#[test]
fn row_10_fields_that_make_no_sense_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("FIELDS intensity x", "FIELDS intensity X", "lack the field `x`"),
        ("TYPE U F", "TYPE U I", "field `x` is int64"),
        ("COUNT 1 1", "COUNT 1 2", "field `x` has 2 numbers"),
        ("SIZE 2 8", "SIZE 2 0", "unknown type F of 0 bytes"),
        ("COUNT 1 1 3 1 3 1", "COUNT 1 1 3", "6 FIELDS, but 3 entries in COUNT"),
        ("HEIGHT 1", "HEIGHT 7", "WIDTH times HEIGHT is 14"),
        ("DATA binary", "DATA octal", "`octal`"),
    ];
    for (from, to, problem) in cases {
        let header = header(2, "binary");
        assert!(header.contains(from));
        assert_says(
            &error(&write(&folder, &header.replace(from, to), &binary(&points(2)))),
            &["map.pcd", "line 11", problem],
        );
    }
    assert_says(
        &error(&write(&folder, &header(2, "ascii"), b"7 1 0 0 0 two 0 0 0 3\n7 1 0 0 0 2 0 0 0 3\n")),
        &["line 12", "`two` in column 6"],
    );
    let missing = error(&write(&folder, &header(1, "ascii"), b"7 1 0 0 0 2 0 0 0 \n"));
    assert_says(&missing, &["line 12", "`` in column 10"]);
    // An empty cloud is a cloud.
    assert_eq!(read(&write(&folder, &header(0, "binary"), b"")).unwrap().0.points, 0);
}
