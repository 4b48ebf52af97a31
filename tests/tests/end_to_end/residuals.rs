//! Scored returns, and scores by frame and by tile, as files: read back, they give the report.

use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use dmp::{Config, FrameSums, ScoredReturns, Watch, evaluate};
use dmp_log::{LogError, LogOptions, PoseTopic, ScoredPoint, open_log, read_cloud, read_topic_trajectory};
use dmp_sensor::{Point3, Scan, Vector3};
use serde_json::Value;

use crate::common::{comparable, dmp, drift, open, refused, runs_of, small_town, text, write_mcap};
use crate::resume::{in_pieces, write_in_small_chunks};

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

fn json_of(folder: &Path, arguments: &str) -> Value {
    let output = dmp(folder, &format!("{arguments} --json"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

const SCORE: &str = "score @/town.mcap -t @/truth.tum -t @/drift.tum";

fn close(found: f64, report: &Value, what: &str) {
    let expected = report.as_f64().unwrap();
    assert!((found - expected).abs() <= 1e-6 * expected.abs(), "{what}: {found}, in the report {expected}");
}

#[test]
fn the_report_follows_from_the_returns_that_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let report = json_of(folder.path(), &format!("{SCORE} --residuals out.ply"));
    let price_m2 = 100.0 * report["config"]["miss_price"].as_f64().unwrap();
    for run in report["runs"].as_array().unwrap() {
        let rows = ply_rows(&folder.path().join(format!("out.{}.ply", run["name"].as_str().unwrap())));
        assert_eq!(rows.len() as u64, run["returns"].as_u64().unwrap());
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
    let mut reports = Vec::new();
    for (path, threads) in [(&one, 1), (&four, 4)] {
        fs::create_dir(path).unwrap();
        for format in formats {
            let tables = if format == "ply" { "--per-frame frames.csv --per-tile tiles.csv" } else { "" };
            let arguments = format!("{SCORE} --residuals out.{format} {tables} --threads {threads}");
            reports.push(json_of(path, &arguments)["runs"].clone());
        }
    }
    assert!(reports.windows(2).all(|pair| pair[0] == pair[1]));
    let mut names: Vec<_> = fs::read_dir(&one).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names.len(), 2 * formats.len() + 2, "{names:?}");
    for name in &names {
        assert!(
            fs::read(one.join(name)).unwrap() == fs::read(four.join(name)).unwrap(),
            "{}",
            name.display()
        );
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
    assert_eq!((log.frames().len(), run.len()), (100, 100));
    let (mut reader, mut scan) = (log.reader().unwrap(), Scan::default());
    let mut rest = rows;
    for frame in 0..100 {
        reader.read(frame, &mut scan).unwrap();
        let world_from_sensor = run.world_from_body_at(scan.stamp_ns.unwrap(), 1).unwrap();
        let (of_scan, behind) = rest.split_at(scan.len());
        rest = behind;
        for (place, row) in scan.points_in_sensor_m.iter().zip(of_scan) {
            assert_eq!(row.frame, frame as i32);
            let in_world = world_from_sensor * Point3::from(place.map(f64::from));
            assert!((in_world.coords - Vector3::from(row.point_in_world_m)).norm() < 2e-5);
        }
    }
    assert!(rest.is_empty());
}

/// A table: its rows by column.
fn table(path: &Path) -> Vec<HashMap<String, String>> {
    let csv = fs::read_to_string(path).unwrap();
    let mut lines = csv.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let head = lines.next().unwrap();
    lines
        .map(|line| {
            assert_eq!(line.len(), head.len());
            head.iter().cloned().zip(line).collect()
        })
        .collect()
}

#[test]
fn frames_and_tiles_add_up_to_the_report() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = format!("{SCORE} --every 3 --per-frame frames.csv --per-tile tiles.csv");
    let report = json_of(folder.path(), &arguments);
    let (frames, tiles) = (table(&folder.path().join("frames.csv")), table(&folder.path().join("tiles.csv")));
    assert_eq!(frames.len(), 2 * 34);
    let log = open(&crate::common::workspace().join("data-samples/town.mcap"));
    for row in &frames {
        let frame: usize = row["frame"].parse().unwrap();
        assert_eq!(frame % 3, 0);
        assert_eq!(row["stamp_ns"].parse::<i64>().ok(), log.frames()[frame].stamp_ns);
    }
    let edge_m = report["config"]["tile_edge_m"].as_f64().unwrap();
    for row in &tiles {
        let number = |name: &str| row[name].parse::<f64>().unwrap();
        assert_eq!((number("edge_m"), number("x_min_m")), (edge_m, number("column") * edge_m));
        assert_eq!(number("y_min_m"), number("row") * edge_m);
    }
    for run in report["runs"].as_array().unwrap() {
        for rows in [&frames, &tiles] {
            let rows = || rows.iter().filter(|row| row["run"] == run["name"].as_str().unwrap());
            let number = |row: &HashMap<String, String>, name: &str| row[name].parse().unwrap_or(0.0);
            let sum = |name: &str| rows().map(|row| number(row, name)).sum::<f64>();
            let weighted = |name: &str, by: &str| {
                rows().map(|row| number(row, name) * number(row, by)).sum::<f64>() / sum(by)
            };
            close(sum("returns"), &run["returns"], "returns");
            close(sum("dmp_sum_m2"), &run["dmp_sum_m2"], "DMP");
            close(weighted("dmp_mean_m2", "returns_with_z1"), &run["dmp_mean_m2"], "mean DMP");
            close(weighted("r_cv_10_m2", "returns"), &run["r_cv_m2"]["10"], "R_cv(10)");
            for scale in ["2", "0.5", "0.2"] {
                let found = weighted(&format!("r_cv_{scale}_m2"), "returns_with_zc");
                close(found, &run["r_cv_m2"][scale], scale);
            }
            for scale in ["5", "2", "0.5"] {
                let found = weighted(&format!("r_near_{scale}_m2"), "returns_with_z1");
                close(found, &run["r_near_m2"][scale], scale);
            }
            for rate in ["miss_rate", "blocked_rate", "coverage", "coverage_revisit"] {
                close(weighted(rate, "returns"), &run[rate], rate);
            }
        }
    }
}

#[test]
fn one_return_of_several_is_the_same_for_all_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    json_of(path, &format!("{SCORE} --sample 10 --residuals all.ply"));
    json_of(path, &format!("{SCORE} --sample 10 --residuals few.ply --residuals-every 7 --threads 3"));
    let key = |row: &ScoredPoint| (row.frame, row.time_s.to_bits(), row.range_m.to_bits());
    let [all, few] = ["all", "few"].map(|name| ply_rows(&path.join(format!("{name}.truth.ply"))));
    let other = ply_rows(&path.join("few.drift.ply"));
    assert!(few.iter().map(key).eq(other.iter().map(key)));
    // What is there is there in full, in the same order.
    let mut rest = all.iter();
    assert!(few.iter().all(|row| rest.any(|other| other.to_bytes() == row.to_bytes())));
    assert!((all.len() / 7).abs_diff(few.len()) <= 10, "{} of {}", few.len(), all.len());
}

#[test]
fn a_map_that_was_given_predicts_by_its_nearest_surfel() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let output = dmp(path, "map build @/town.mcap -t @/truth.tum -o truth.dmpmap --quiet");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let score = "score @/town.mcap -t @/truth.tum --map truth.dmpmap --sample 10";
    let report = json_of(path, &format!("{score} --residuals out.ply --per-frame frames.csv"));
    let rows = ply_rows(&path.join("out.ply"));
    let same = |row: &ScoredPoint| row.signed_residual_m.to_bits() == row.nearest_residual_m.to_bits();
    assert!(
        rows.iter().all(|row| same(row) || row.signed_residual_m.is_nan() && row.nearest_residual_m.is_nan())
    );
    assert!(rows.iter().any(|row| row.signed_residual_m.abs() < 0.1));
    assert_eq!(rows.len() as u64, report["runs"][0]["returns"].as_u64().unwrap());
    let frames = table(&path.join("frames.csv"));
    assert!(frames.iter().all(|row| row["r_cv_10_m2"].is_empty() && row["coverage"].is_empty()));
    assert!(frames.iter().all(|row| row["r_near_2_m2"].parse::<f64>().is_ok()));
}

#[test]
fn what_cannot_be_written_is_told_before_the_log_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("log.mcap"), "not a log").unwrap();
    fs::copy(crate::common::workspace().join("data-samples/truth.tum"), path.join("truth.tum")).unwrap();
    fs::create_dir(path.join("taken.ply")).unwrap();
    for (outputs, words) in [
        ("--residuals out.xyz", &["out.xyz", ".laz, .las, .ply, .pcd, .mcap"][..]),
        ("--residuals no/out.laz", &["no/out.laz", "no folder no"]),
        ("--residuals log.mcap", &["log.mcap", "take the place of the input"]),
        ("--residuals truth=./log.mcap", &["log.mcap", "take the place of the input"]),
        ("--residuals other=out.laz", &["other", "the runs are truth"]),
        ("--residuals taken.ply", &["taken.ply", "a folder has this name"]),
        ("--per-frame a.csv --per-tile a.csv", &["a.csv", "two outputs"]),
        ("--per-frame a.parquet", &["a.parquet", "written as .csv"]),
        ("--per-tile no/a.csv", &["no/a.csv", "no folder no"]),
    ] {
        refused(path, &format!("score log.mcap -t truth.tum {outputs}"), 2, words);
    }
    let every = dmp(path, "score log.mcap -t truth.tum --residuals out.ply --residuals-every 0");
    assert_eq!(every.status.code(), Some(2), "{}", text(&every.stderr));
}

#[test]
fn scans_without_stamps_are_no_mcap() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let output = dmp(path, "convert log @/town.mcap -o town --to bin --quiet");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    fs::remove_file(path.join("town/times.txt")).unwrap();
    let truth = open(&crate::common::workspace().join("data-samples/town.mcap"));
    let lines = "1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(truth.frames().len());
    fs::write(path.join("run.txt"), lines).unwrap();
    let score = "score town -t run.txt --point-time ignore --sample 5";
    refused(path, &format!("{score} --residuals out.mcap"), 2, &["out.mcap", "no stamps", ".laz"]);
    json_of(path, &format!("{score} --residuals out.ply --per-frame frames.csv"));
    assert!(ply_rows(&path.join("out.ply")).iter().all(|row| row.time_s == 0.0));
    assert!(table(&path.join("frames.csv")).iter().all(|row| row["stamp_ns"].is_empty()));
}

/// Counts the returns and frames that come by.
#[derive(Default)]
struct Counting {
    returns: AtomicU64,
    frames: AtomicU64,
}

impl Watch for Counting {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        assert_eq!(returns.rays[0].len(), returns.offsets_ns.len());
        assert_eq!(returns.rays.len(), returns.world_from_sensor.len());
        self.returns.fetch_add(returns.rays[0].len() as u64, Ordering::Relaxed);
    }

    fn frame_scored(&self, _: usize, _: &FrameSums) {
        self.frames.fetch_add(1, Ordering::Relaxed);
    }

    fn wants_every_return(&self) -> bool {
        true
    }
}

/// Asks to stop once so many returns were scored.
struct StopInCast(AtomicU64);

impl Watch for StopInCast {
    fn returns_scored(&self, returns: &ScoredReturns<'_>) {
        self.0.fetch_add(returns.rays[0].len() as u64, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed) > 20_000
    }
}

#[test]
fn every_return_comes_by_also_where_an_evaluation_is_taken_up() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(60, 180);
    write_in_small_chunks(&path, &scans);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let config = Config {
        work_folder: folder.path().to_path_buf(),
        checkpoint_every: Some(Duration::ZERO),
        resume: true,
        ..Config::default()
    };
    let log = open(&path);
    let stopped = evaluate(log.as_ref(), &runs, &config, &StopInCast(AtomicU64::new(0)));
    assert!(stopped.is_err(), "it was to stop while it casts");
    let watch = Counting::default();
    let report = evaluate(log.as_ref(), &runs, &config, &watch).unwrap();
    assert_eq!(watch.returns.into_inner(), report.runs[0].returns);
    assert_eq!(watch.frames.into_inner(), report.sampling.frames_scored);
    let (whole, _) = in_pieces(&path, &runs, &Config { resume: false, ..config }, u64::MAX / 4);
    assert_eq!(comparable(&report), comparable(&whole));
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_scores_and_no_half_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (scans, truth) = small_town(24, 150);
    write_mcap(&path.join("town.mcap"), &scans);
    let mut lines = Vec::new();
    dmp_log::write_tum(&mut lines, &truth).unwrap();
    fs::write(path.join("truth.tum"), lines).unwrap();
    fs::create_dir(path.join("disk")).unwrap();
    let dmp = env!("CARGO_BIN_EXE_dmp-under-test");
    // Once the files have no room, once what waits to be written.
    let script = format!(
        "mount -t tmpfs -o size=200k none disk || exit 99; \
         {dmp} score town.mcap -t truth.tum --residuals disk/out.ply --work . --json --quiet >out.json 2>out.txt; \
         echo $? >out.code; ls -A disk >left.txt; \
         {dmp} score town.mcap -t truth.tum --residuals out.ply --work disk --quiet 2>work.txt; echo $? >work.code"
    );
    let output = Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-c", &script])
        .current_dir(path)
        .output();
    match output {
        Ok(output) if output.status.code() != Some(99) && path.join("work.code").exists() => {}
        _ => {
            println!("skipped: this system does not let us mount a disk of our own");
            return;
        }
    }
    let read = |name: &str| fs::read_to_string(path.join(name)).unwrap();
    assert_eq!((read("out.code").trim(), read("left.txt").as_str()), ("1", ""), "{}", read("out.txt"));
    assert!(read("out.txt").contains("disk/out.ply: cannot write"), "{}", read("out.txt"));
    let report: Value = serde_json::from_str(&read("out.json")).unwrap();
    assert_eq!(report["runs"][0]["name"], "truth");
    assert_eq!(read("work.code").trim(), "1");
    assert!(read("work.txt").contains("No space left on device"), "{}", read("work.txt"));
    assert!(!path.join("out.ply").exists());
}
