//! Rows 17, 18 and 23: trajectories on another clock, that do not cover the log, or make no sense. Row 19 is in
//! `conventions.rs` and `sanity.rs`.

use super::Town;
use super::table::Row;
use crate::common::text;

pub(super) const ROWS: &[Row] = &[
    Row {
        number: 17,
        made: |town| {
            for run in ["truth.tum", "drift.tum"] {
                let shifted = town.changed(run, |ns, pose| Some((ns - 1_600_000_000_000_000_000, pose)));
                town.write(&format!("own/{run}"), "");
                town.tum(&format!("own/{run}"), &shifted);
            }
        },
        lines: "
            score town.mcap -t own/truth.tum -t own/drift.tum => 1 run `truth`: 0 of 24 scans have a pose | s apart | --time-offset truth=-1600000000.000
            score town.mcap -t own/truth.tum -t own/drift.tum --time-offset -1600000000 => 0 near 1e-9 score town.mcap",
    },
    Row {
        number: 18,
        made: |town| {
            parts(town, "truth.tum", "half.tum", &|share| share <= 0.5);
            parts(town, "truth.tum", "gap.tum", &|share| !(0.3..0.8).contains(&share));
            parts(town, "truth.tum", "start.tum", &|share| share < 0.01);
            let good = "1700000000 0 0 0 0 0 0 1\n1700000060 1 0 0 0 0 0 1\n";
            let first = "1700000000 0 0 0 0 0 0 1\n";
            for (name, content) in [
                ("empty.tum", "# nothing\n\n".to_owned()),
                ("zero.tum", format!("{first}1700000001 0 0 0 0 0 0 0\n")),
                ("nan.tum", format!("{first}\n1700000001 0 nan 0 0 0 0 1\n")),
                ("cut.tum", format!("{first}1700000001 0 0 0 0 0")),
                ("empty.mcap", String::new()),
                ("words.tum", "1700000000 0 0 0 0 zero 0 1\n".to_owned()),
                ("two_runs.tum", good.to_owned() + &good.replace("000 0 0", "000 5 0")),
            ] {
                town.write(name, content);
            }
            let whole = text(&town.read("truth.tum"));
            // A cut in the last number leaves a line that could be whole, as that of a file without a last line end.
            town.write("cut_in_number.tum", &whole[..whole.len() - 3]);
            let mut lines: Vec<&str> = whole.lines().collect();
            lines.reverse();
            let again = lines[7];
            lines.push(again);
            town.write("mixed.tum", lines.join("\n") + "\n");
        },
        lines: "
            score town.mcap -t half.tum => 0 runs/0/scans_without_pose in 11..14; dropped/scan_without_pose in 1001..
            score town.mcap -t half.tum => 0 scans_used in 11..14; warnings: of 24 scans have no pose in `half`
            score town.mcap -t gap.tum => 0 runs/0/scans_without_pose in 11..14; warnings: of 24 scans have no pose in `gap`
            score town.mcap -t start.tum => 1 `start`: 1 of 24 scans have a pose | the log spans
            score town.mcap -t empty.tum => 1 empty.tum | no poses
            score town.mcap -t zero.tum => 1 zero.tum | line 2 | quaternion
            score town.mcap -t nan.tum => 1 nan.tum | line 3 | nan
            score town.mcap -t cut.tum => 1 cut.tum | line 2 | 6
            score town.mcap -t zero.tum -t truth.tum -t nan.tum -t drift.tum --pose-at nan=end => 3 as score town.mcap; left_out/1/reason: run `nan` is excluded: | line 3
            score town.mcap -t bad=empty.mcap:/odom -t truth.tum -t drift.tum --pose-at bad=end => 3 as score town.mcap; left_out/0/reason: run `bad` is excluded: empty.mcap: | no bag
            score town.mcap -t bad=empty.mcap:/odom => 1 empty.mcap | no bag
            score town.mcap -t zero.tum -t nan.tum => 1 zero.tum | line 2
            score town.mcap -t nan.tum -t gone.tum => 2 gone.tum: no such file
            score town.mcap -t words.tum => 1 words.tum | line 1 | zero
            score town.mcap -t two_runs.tum => 1 two_runs.tum | 1700000000
            info town.mcap -t zero.tum => 1 zero.tum | line 2 | quaternion
            info town.mcap -t two_runs.tum => 1 two_runs.tum | 1700000000
            score town.mcap -t cut_in_number.tum => 0 runs/0/notes: the last line has no end: it may be cut
            score town.mcap -t run=mixed.tum => 0 as score town.mcap -t run=truth.tum; prints: out of order of time, sorted | 1 repeated pose
            info town.mcap -t mixed.tum => 0 trajectories/0/repeated = 1",
    },
    Row {
        number: 23,
        made: |town| {
            parts(town, "truth.tum", "a.tum", &|share| share <= 0.8);
            parts(town, "drift.tum", "b.tum", &|share| share >= 0.3);
        },
        lines: "
            score town.mcap -t a.tum -t b.tum => 0 scans_used = 24; warnings: have no pose in `a` | it is scored on the others
            score town.mcap -t a.tum -t b.tum => 0 warnings: have no pose in `b`",
    },
];

/// The poses of a run whose share of the drive, by time, is kept.
fn parts(town: &Town, run: &str, name: &str, keep: &dyn Fn(f64) -> bool) {
    let [first, last] = [town.scans.first(), town.scans.last()].map(|scan| scan.unwrap().stamp_ns.unwrap());
    let share = |ns| (ns - first) as f64 / (last - first) as f64;
    town.tum(name, &town.changed(run, |ns, pose| keep(share(ns)).then_some((ns, pose))));
}
