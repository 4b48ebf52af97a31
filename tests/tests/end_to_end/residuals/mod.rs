//! Scored returns, and scores by frame and by tile, as files: read back, they give the report.

mod tables;

use std::fs;
use std::path::Path;

use dmp_log::{LogError, LogOptions, PoseTopic, ScoredPoint, open_log, read_cloud, read_topic_trajectory};
use dmp_sensor::{Point3, Scan, Vector3};
use serde_json::Value;

use crate::common::{TWO, done, json, once, refused, write};

/// Rows of a binary file whose head ends in a line.
fn rows_behind(path: &Path, last_line: &str) -> Vec<ScoredPoint> {
    let bytes = fs::read(path).unwrap();
    let at = bytes.windows(last_line.len()).position(|part| part == last_line.as_bytes()).unwrap();
    let (rows, rest) = bytes[at + last_line.len()..].as_chunks();
    assert!(rest.is_empty());
    rows.iter().map(ScoredPoint::of_bytes).collect()
}

fn ply_rows(path: &Path) -> Vec<ScoredPoint> {
    let rows = rows_behind(path, "end_header\n");
    let mut places = Vec::new();
    let sink = |batch: &[[f64; 3]]| {
        places.extend_from_slice(batch);
        Ok::<(), LogError>(())
    };
    read_cloud(path, None, sink).unwrap();
    assert!(rows.iter().map(|row| row.point_in_world_m).eq(places));
    rows
}

fn close(found: f64, report: &Value, what: &str) {
    let expected = report.as_f64().unwrap();
    assert!((found - expected).abs() <= 1e-6 * expected.abs(), "{what}: {found}, in the report {expected}");
}

#[test]
fn the_report_follows_from_the_returns_that_were_written() {
    let scored = once(&format!("{TWO} --residuals out.ply --json"));
    let report = scored.json();
    let price_m2 = 100.0 * report["config"]["miss_price"].as_f64().unwrap();
    for run in report["runs"].as_array().unwrap() {
        let mut rows = ply_rows(&scored.folder.join(format!("out.{}.ply", run["name"].as_str().unwrap())));
        let [scored, left_out] = ["returns", "returns_left_out"].map(|name| run[name].as_u64().unwrap());
        assert_eq!(rows.len() as u64, scored + left_out);
        assert!(rows.iter().filter(|row| row.kind == 4).all(|row| row.first_residual_m.is_nan()));
        rows.retain(|row| row.kind != 4);
        assert_eq!(rows.len() as u64, scored);
        // The definitions once more, over the columns of the file.
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            sum / count
        };
        let square = |m: f32, limit_m: f64| (f64::from(m).powi(2)).min(limit_m * limit_m);
        let r_cv_10 = |row: &ScoredPoint| match row.signed_residual_m {
            m if m.is_nan() => price_m2,
            m => square(m, 10.0),
        };
        close(mean(&mut rows.iter().map(r_cv_10)), &run["r_cv_m2"]["10"], "R_cv(10)");
        for (name, limit_m) in [("2", 2.0), ("0.5", 0.5), ("0.2", 0.2)] {
            let predicted = rows.iter().filter(|row| !row.signed_residual_m.is_nan());
            let found = mean(&mut predicted.map(|row| square(row.signed_residual_m, limit_m)));
            close(found, &run["r_cv_m2"][name], name);
        }
        let hits = || rows.iter().filter(|row| row.kind != 0);
        for (name, limit_m) in [("5", 5.0_f64), ("2", 2.0), ("0.5", 0.5)] {
            let near = |row: &ScoredPoint| match row.nearest_residual_m {
                m if m.is_nan() => limit_m * limit_m,
                m => square(m, limit_m),
            };
            close(mean(&mut hits().map(near)), &run["r_near_m2"][name], name);
        }
        close(mean(&mut hits().map(|row| square(row.first_residual_m, 1e9))), &run["dmp_mean_m2"], "DMP");
        let share = |is: &dyn Fn(&ScoredPoint) -> bool| {
            rows.iter().filter(|row| is(row)).count() as f64 / rows.len() as f64
        };
        close(share(&|row| row.kind == 0), &run["miss_rate"], "misses");
        close(share(&|row| row.kind == 2), &run["blocked_rate"], "blocked");
        close(share(&|row| !row.signed_residual_m.is_nan()), &run["coverage"], "coverage");
        close(share(&|row| row.revisited), &run["coverage_revisit"], "revisits");
        // What a row says of itself.
        for row in &rows {
            let first_m = row.first_residual_m;
            let kind = match row.kind {
                0 => first_m.is_nan(),
                1 => first_m.abs() <= 0.5,
                2 => first_m >= 0.5,
                _ => first_m <= -0.5,
            };
            assert!(kind && (1.5..=100.0).contains(&row.range_m), "{row:?}");
            let sum_m = row.map_range_m + row.signed_residual_m;
            assert!(sum_m.is_nan() || (sum_m - row.range_m).abs() < 2e-5, "{row:?}");
        }
        assert!(rows.windows(2).all(|pair| pair[0].frame <= pair[1].frame));
        assert_eq!(rows.last().unwrap().frame, 99);
    }
}

#[test]
fn every_format_holds_the_same_whatever_the_threads() {
    let folder = tempfile::tempdir().unwrap();
    let (one, four) = (folder.path().join("one"), folder.path().join("four"));
    let formats = ["ply", "pcd", "las", "laz", "mcap"];
    for (path, threads) in [(&one, 1), (&four, 4)] {
        fs::create_dir(path).unwrap();
        for format in formats {
            let tables = if format == "ply" { "--per-frame frames.csv --per-tile tiles.csv" } else { "" };
            done(path, &format!("{TWO} --every 10 --residuals out.{format} {tables} --threads {threads}"));
        }
    }
    let mut names: Vec<_> = fs::read_dir(&one).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names.len(), 2 * formats.len() + 2, "{names:?}");
    for name in &names {
        let [a, b] = [&one, &four].map(|folder| fs::read(folder.join(name)).unwrap());
        assert!(a == b, "{}", name.display());
    }
    let rows = ply_rows(&one.join("out.drift.ply"));
    let bytes = |rows: &[ScoredPoint]| rows.iter().flat_map(ScoredPoint::to_bytes).collect::<Vec<u8>>();
    assert!(bytes(&rows) == bytes(&rows_behind(&one.join("out.drift.pcd"), "DATA binary\n")));
    for format in ["las", "laz"] {
        let records =
            las::Reader::from_path(one.join(format!("out.drift.{format}"))).unwrap().read_all().unwrap();
        assert_eq!(records.len(), rows.len());
        for (record, row) in records.points().map(Result::unwrap).zip(&rows) {
            assert_eq!(record.extra_bytes, row.to_bytes()[24..]);
            let apart = Vector3::new(record.x, record.y, record.z) - Vector3::from(row.point_in_world_m);
            assert!(apart.amax() < 0.501e-4, "{apart}");
        }
    }
    played(&one.join("out.drift.mcap"), &rows);
}

/// The scans of an MCAP file lie where the rows do, by the poses that the file has beside them.
fn played(path: &Path, rows: &[ScoredPoint]) {
    let log = open_log(path, &LogOptions::default()).unwrap();
    let topic =
        PoseTopic { topic: Some("/tf".into()), world: Some("map".into()), body: Some("drift".into()) };
    let run = read_topic_trajectory(path, &topic, None).unwrap().trajectory;
    assert_eq!((log.frames().len(), run.len()), (10, 10));
    let (mut reader, mut scan) = (log.reader().unwrap(), Scan::default());
    let mut rest = rows;
    for frame in 0..10 {
        reader.read(frame, &mut scan).unwrap();
        let world_from_sensor = run.world_from_body_at(scan.stamp_ns.unwrap(), 1).unwrap();
        let (of_scan, behind) = rest.split_at(scan.len());
        rest = behind;
        for (place, row) in scan.points_in_sensor_m.iter().zip(of_scan) {
            assert_eq!(row.frame, of_scan[0].frame);
            let in_world = world_from_sensor * Point3::from(place.map(f64::from));
            assert!((in_world.coords - Vector3::from(row.point_in_world_m)).norm() < 2e-5);
        }
    }
    assert!(rest.is_empty());
}

#[test]
fn what_cannot_be_written_is_refused_before_the_log_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(path, "log.mcap", "not a log");
    fs::copy(crate::common::sample("truth.tum"), path.join("truth.tum")).unwrap();
    fs::create_dir(path.join("taken.ply")).unwrap();
    for (outputs, words) in [
        ("--residuals out.xyz", &["out.xyz", ".laz, .las, .ply, .pcd, .mcap"][..]),
        ("--residuals no/out.laz", &["no/out.laz", "no folder no"]),
        ("--residuals truth=./log.mcap", &["log.mcap", "take the place of the input"]),
        ("--residuals other=out.laz", &["other", "the runs are truth"]),
        ("--residuals taken.ply", &["taken.ply", "a folder has this name"]),
        ("--per-frame a.csv --per-tile a.csv", &["a.csv", "two outputs"]),
        ("--per-frame a.parquet", &["a.parquet", "written as .csv"]),
    ] {
        refused(path, &format!("score log.mcap -t truth.tum {outputs}"), 2, words);
    }
}

/// Neither a log with time for each scan nor a scene can be made of scans without.
#[test]
fn scans_without_stamps_are_written_as_points_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    done(path, "convert log @/town.mcap -o town --to bin --quiet");
    fs::remove_file(path.join("town/times.txt")).unwrap();
    write(path, "run.txt", &"1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(100));
    let score = "score town -t run.txt --point-time ignore --every 20";
    refused(path, &format!("{score} --residuals out.mcap"), 2, &["out.mcap", "no stamps", ".laz"]);
    refused(path, &format!("{score} --scene out.mcap"), 2, &["out.mcap", "no stamps", "--report"]);
    json(path, &format!("{score} --residuals out.ply --per-frame frames.csv"));
    assert!(ply_rows(&path.join("out.ply")).iter().all(|row| row.time_s == 0.0));
    let frames = tables::table(&path.join("frames.csv"));
    assert!(frames.len() == 5 && frames.iter().all(|row| row["stamp_ns"].is_empty()));
}
