//! Scores by frame and by tile.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use dmp_log::ScoredPoint;

use super::{close, ply_rows};
use crate::common::{SCORE, TWO, json, once, open, sample};

/// A table: its rows by column.
pub(super) fn table(path: &Path) -> Vec<HashMap<String, String>> {
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
    let scored = once(&format!("{TWO} --every 3 --per-frame frames.csv --per-tile tiles.csv --json"));
    let report = scored.json();
    let [frames, tiles] = ["frames.csv", "tiles.csv"].map(|name| table(&scored.folder.join(name)));
    assert_eq!(frames.len(), 2 * 34);
    let log = open(&sample("town.mcap"));
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
fn a_map_that_was_given_predicts_by_its_nearest_surfel() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    once(crate::map_command::BUILD).copy("truth.dmpmap", path);
    let score = &format!("{SCORE} -t @/truth.tum --map truth.dmpmap --every 10");
    let report = json(path, &format!("{score} --residuals out.ply --per-frame frames.csv"));
    let rows = ply_rows(&path.join("out.ply"));
    let same = |row: &ScoredPoint| row.signed_residual_m.to_bits() == row.nearest_residual_m.to_bits();
    assert!(
        rows.iter().all(|row| same(row) || row.signed_residual_m.is_nan() && row.nearest_residual_m.is_nan())
    );
    assert!(rows.iter().any(|row| row.signed_residual_m.abs() < 0.1));
    let [scored, left_out] =
        ["returns", "returns_left_out"].map(|name| report["runs"][0][name].as_u64().unwrap());
    assert_eq!(rows.len() as u64, scored + left_out);
    let frames = table(&path.join("frames.csv"));
    assert!(frames.iter().all(|row| row["r_cv_10_m2"].is_empty() && row["coverage"].is_empty()));
    assert!(frames.iter().all(|row| row["r_near_2_m2"].parse::<f64>().is_ok()));
}
