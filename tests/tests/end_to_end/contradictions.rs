//! No two statements of one report contradict each other: the sentence, the table, the numbers, the warnings.

use std::path::Path;

use serde_json::Value;

use crate::common::{done, ends, json_of, sample_rows, text, tum, unwrapped, write};

/// A report as its JSON and as a person reads it.
struct Said {
    command: String,
    json: Value,
    text: String,
    notes: String,
}

/// The report of a command.
fn said(folder: &Path, command: &str) -> Said {
    let json = ends(folder, &format!("{command} --json --quiet"), 0);
    let shown = ends(folder, command, 0);
    Said {
        command: command.to_owned(),
        json: json_of(&json),
        text: text(&shown.stdout),
        notes: text(&shown.stderr),
    }
}

impl Said {
    fn check(&self) {
        self.the_same_is_what_the_poses_say();
        self.who_is_best_is_best_everywhere();
        self.what_comes_back_has_somewhere_to_come_back_to();
        self.nothing_is_said_twice();
    }

    #[track_caller]
    fn holds(&self, what: bool, why: &str) {
        assert!(what, "{why}: {}\n{}", self.command, self.text);
    }

    fn pairs(&self) -> &[Value] {
        self.json["pairs"].as_array().unwrap()
    }

    fn the_same_is_what_the_poses_say(&self) {
        let within_m = self.json["promise"]["same_within_m"].as_f64().unwrap();
        for pair in self.pairs() {
            let apart = &pair["apart"];
            let worst_m = |part: &str| apart[part]["worst_m"].as_f64().unwrap_or(0.0);
            let is_near =
                apart.is_object() && worst_m("within") <= within_m && worst_m("between") <= 2.0 * within_m;
            let counts = ["scans", "scans_of_one"].map(|name| apart[name].as_u64().unwrap_or(0));
            let is_whole = 10 * counts[1] <= counts[0];
            let is_fused = pair["score"] == "R_cv";
            let is_same = pair["verdict"] == "same" && pair["decided_at_m"].is_null();
            self.holds(is_same == (is_near && is_whole && is_fused), "the same is not what the poses say");
            let reason = pair["reason"].as_str().unwrap();
            self.holds(is_same == reason.starts_with("the same: "), "a reason that is of another verdict");
            let is_undecided = pair["verdict"] == "undecided" && pair["decided_at_m"].is_null();
            self.holds(
                !is_undecided || apart.is_null() || reason.contains(" apart along the way"),
                "undecided without how far apart",
            );
        }
    }

    fn who_is_best_is_best_everywhere(&self) {
        let order: Vec<&str> =
            self.json["order"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
        let beats = |one: &str, other: &str| {
            let is_of = |pair: &Value| {
                let names = [&pair["a"], &pair["b"]].map(|name| name.as_str().unwrap());
                names.contains(&one) && names.contains(&other)
            };
            self.pairs().iter().any(|pair| is_of(pair) && pair["verdict"] == one)
        };
        let is_best = order.len() > 1 && order[1..].iter().all(|other| beats(order[0], other));
        let rows: Vec<&str> = self.text.lines().filter(|line| line.trim_start().starts_with("1  ")).collect();
        self.holds(is_best == rows.iter().any(|row| row.contains("  best ")), "the best in the table");
        self.holds(!is_best || rows.len() == 1, "the best shares its rank");
        let sentence = self.text.lines().next().unwrap();
        let claims =
            sentence.contains(" is best: ") || order.len() == 2 && sentence.contains(" is better than ");
        self.holds(!claims || sentence.contains("on the whole") || is_best, "the sentence claims more");
        self.holds(!is_best || claims, "the sentence claims less");
        self.holds(
            !sentence.contains(" are the same") || !sentence.contains("which is right"),
            "the same and undecided",
        );
        for (k, a) in order.iter().enumerate() {
            for b in &order[k + 1..] {
                self.holds(!beats(b, a), "a worse run stands above");
            }
        }
    }

    fn what_comes_back_has_somewhere_to_come_back_to(&self) {
        let drift = &self.json["drift"];
        let runs = drift["runs"].as_array().cloned().unwrap_or_default();
        let is_measured = runs.iter().any(|run| run["pairs_measured"].as_u64() > Some(0));
        let flat = unwrapped(&self.text);
        self.holds(is_measured || !flat.contains("revisit error"), "an error at no revisit");
        self.holds(!is_measured || !flat.contains("revisits no place"), "it revisits places");
        for run in &runs {
            let name = run["name"].as_str().unwrap();
            let is_lost = run["pairs_lost"].as_u64() > Some(0);
            self.holds(
                !is_lost || !flat.contains(&format!("{name} has a revisit error")),
                "lost, and comes back",
            );
            self.holds(!is_lost || flat.contains("lost "), "lost, and nobody says so");
        }
    }

    fn nothing_is_said_twice(&self) {
        let sentences = |text: &str| -> Vec<String> {
            let words = unwrapped(text);
            let lines =
                words.split("warning: ").skip(1).map(|line| line.chars().take(60).collect::<String>());
            lines.collect()
        };
        let warnings = sentences(&self.text);
        for (k, warning) in warnings.iter().enumerate() {
            self.holds(!warnings[..k].contains(warning), "a warning twice");
            let start: String = warning.chars().take(40).collect();
            self.holds(!unwrapped(&self.notes).contains(&start), "a warning on both streams");
        }
    }
}

#[test]
fn no_report_contradicts_itself() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let rows = sample_rows("truth.tum");
    let moved: Vec<Vec<f64>> =
        rows.iter().map(|row| [&row[..1], &[row[1] + 432_100.25], &row[2..]].concat()).collect();
    write(path, "moved.tum", &tum(&moved));
    write(path, "half.tum", &tum(&rows[..rows.len() / 2]));
    let scaled: Vec<Vec<f64>> = rows
        .iter()
        .map(|row| [&row[..1], &row[1..4].iter().map(|c| 1.01 * c).collect::<Vec<_>>(), &row[4..]].concat())
        .collect();
    write(path, "scaled.tum", &tum(&scaled));
    let town = "score @/town.mcap";
    for command in [
        format!("{town} -t @/truth.tum -t @/drift.tum -t @/noise.tum -t @/collapsed.tum"),
        format!("{town} -t @/truth.tum"),
        format!("{town} -t @/truth.tum -t moved.tum"),
        format!("{town} -t @/truth.tum -t moved.tum -t @/drift.tum"),
        format!("{town} -t @/truth.tum -t scaled.tum"),
        format!("{town} -t @/truth.tum -t half.tum"),
        format!("{town} -t @/truth.tum -t @/noise.tum --same-within 1m"),
        format!("{town} -t @/drift.tum -t @/collapsed.tum"),
        format!("{town} -t @/truth.tum -t @/drift.tum --quick=20%"),
        format!("{town} -t @/truth.tum -t @/drift.tum --sample 30"),
        format!("{town} -t @/truth.tum -t @/drift.tum --drift=none"),
    ] {
        said(path, &command).check();
    }
    done(path, &format!("{town} -t @/truth.tum --keep a.dmp --quiet"));
    done(path, &format!("{town} -t moved.tum --keep b.dmp --quiet"));
    done(path, &format!("{town} -t @/drift.tum --keep c.dmp --quiet"));
    said(path, "compare a.dmp b.dmp c.dmp").check();
}

#[test]
fn nor_does_that_of_traffic_of_a_street_without_revisits_or_of_a_room() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    done(
        path,
        "simulate town -o street.mcap --route out-and-back --scans 80 --azimuth-steps 200 --company ahead=12m,oncoming --quiet",
    );
    done(path, "simulate errors street.truth.tum --noise 5mm -o near.tum --quiet");
    done(path, "simulate errors street.truth.tum --drift-ate 1 -o drift.tum --quiet");
    said(path, "score street.mcap -t street.truth.tum -t near.tum -t drift.tum").check();
    done(path, "simulate town -o straight.mcap --route one-way --scans 50 --azimuth-steps 200 --quiet");
    done(path, "simulate errors straight.truth.tum --noise 3cm,0.1deg -o noisy.tum --quiet");
    said(path, "score straight.mcap -t straight.truth.tum -t noisy.tum").check();
    done(path, "simulate room -o room --frames 60 --quiet");
}
