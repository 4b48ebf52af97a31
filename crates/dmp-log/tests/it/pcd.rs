//! PCD clouds: what is read, what is refused, and that no header is trusted. Padding and LZF have tests beside their code.

use crate::cloud::{error, read};
use crate::common::{Random, assert_says, refusals};
use crate::scan_folder::{PCD, Row, pcd, rows};
use dmp_log::{CloudFormat, LengthUnit, LogError, read_cloud};
use std::fs;
use std::path::PathBuf;

/// Points at UTM coordinates.
fn far_rows(count: usize) -> Vec<Row> {
    let mut random = Random(5);
    // Eighths of a metre are the same in text and in float32.
    let mut near = || (random.next() % 800) as f32 / 8.0;
    (0..count).map(|_| (500_000.0 + f64::from(near()), 1, near(), near(), 0)).collect()
}

fn points(rows: &[Row]) -> Vec<[f64; 3]> {
    rows.iter().map(|row| [row.0, row.2.into(), row.3.into()]).collect()
}

fn write(folder: &tempfile::TempDir, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.path().join("map.pcd");
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn pcd_is_read_in_every_encoding_and_in_metres() {
    let folder = tempfile::tempdir().unwrap();
    // More than a batch, and more than the decoders keep.
    for rows in [far_rows(0), far_rows(1), far_rows(70_000)] {
        for data in PCD {
            let (summary, found) = read(&write(&folder, pcd(&rows, data))).unwrap();
            assert_eq!((summary.format, summary.unit_note), (CloudFormat::Pcd, None));
            assert!(found == points(&rows), "{} points, {data}", rows.len());
        }
    }
    let mut found = Vec::new();
    let unit = Some(LengthUnit::Foot);
    read_cloud(&write(&folder, pcd(&rows(), "binary")), unit, |batch| {
        found.extend_from_slice(batch);
        Ok::<(), LogError>(())
    })
    .unwrap();
    assert_eq!(found, points(&rows()).iter().map(|p| p.map(|c| c * 0.3048)).collect::<Vec<_>>());
}

#[test]
fn row_03_lying_headers_are_refused_before_anything_is_allocated() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |bytes: &[u8], parts: &[&str]| {
        let error = error(&write(&folder, bytes));
        assert_says(&error, &["map.pcd"]);
        assert_says(&error, parts);
    };
    // A head of so many bytes, which claims so many points, before three of 21 bytes.
    let claim = |data: &str, count: &str| {
        let good = pcd(&rows()[..3], data);
        let end = good.windows(5).position(|window| window == b"DATA ").unwrap() + 6 + data.len();
        let head = String::from_utf8(good[..end].to_vec()).unwrap();
        let head = head
            .replace("WIDTH 3", &format!("WIDTH {count}"))
            .replace("POINTS 3", &format!("POINTS {count}"));
        (head.into_bytes(), good[end..].to_vec())
    };
    let [huge, words] = ["18446744073709551615", "18,446,744,073,709,551,615"];
    for (data, count, parts) in [
        ("ascii", huge, &["byte", words][..]),
        ("binary", huge, &["byte", words]),
        ("ascii", "1000000000000", &["byte", "1,000,000,000,000 points"]),
        ("binary", "1000000000000", &["byte", "1,000,000,000,000 points"]),
        ("binary", "4", &["byte ", "4 points of 21 bytes", "63 bytes"]),
        ("ascii", "4", &["line 15", "ends after 3 of 4 points"]),
        ("binary_compressed", huge, &["unpacked", words]),
        ("binary_compressed", "4", &["63 bytes unpacked", "4 points"]),
    ] {
        let (head, body) = claim(data, count);
        refused(&[head, body].concat(), parts);
    }
    let (head, packed) = claim("binary_compressed", "3");
    let change = |at: usize, with: u32| {
        let mut changed = packed.clone();
        changed[at..at + 4].copy_from_slice(&with.to_le_bytes());
        changed
    };
    for (body, parts) in [
        (change(0, u32::MAX), &["4,294,967,295 compressed bytes"][..]),
        (change(4, u32::MAX), &["unpack to 4,294,967,295"]),
        (packed[..6].to_vec(), &["byte", "do not fit in the 6 bytes"]),
        (change(0, 20), &["cannot unpack"]),
        (
            [&packed[..8], &[0xff; 100]].concat(),
            &["cannot unpack", "a copy from 8192 bytes back, 0 are there"],
        ),
    ] {
        refused(&[head.clone(), body].concat(), parts);
    }
}

#[test]
fn row_10_fields_that_make_no_sense_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to, problem) in [
        ("FIELDS x", "FIELDS X", "lack the field `x`"),
        ("TYPE F", "TYPE I", "field `x` is int64"),
        ("COUNT 1 1", "COUNT 2 1", "field `x` has 2 numbers"),
        ("SIZE 8", "SIZE 0", "unknown type F of 0 bytes"),
        ("COUNT 1 1 1 1 1", "COUNT 1 1 1", "5 FIELDS, but 3 entries in COUNT"),
        ("HEIGHT 1", "HEIGHT 7", "WIDTH times HEIGHT is 14"),
        ("DATA ascii", "DATA octal", "`octal`"),
    ] {
        let text = String::from_utf8(pcd(&rows()[..2], "ascii")).unwrap();
        assert!(text.contains(from));
        assert_says(&error(&write(&folder, text.replace(from, to))), &["map.pcd", "line 11", problem]);
    }
    let head = String::from_utf8(pcd(&[], "ascii")).unwrap().replace(" 0\nHEIGHT", " 1\nHEIGHT");
    refusals(
        |line| error(&write(&folder, format!("{}{line}\n", head.replace("POINTS 0", "POINTS 1")))),
        "",
        &[("1 0 two 3 0", "line 12 | `two` in column 3"), ("1.25 0.5 2.75 ", "line 12 | `` in column 4")],
    );
}
