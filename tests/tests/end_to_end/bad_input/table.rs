//! Rows as tables: what is made, and commands with their ends.

use std::path::Path;
use std::sync::Mutex;

use serde_json::Value;

use super::{
    GATE, KEEPING_WORK, Town, clouds, contents, logs, outputs, report, run, runs, scores, stopping, texts,
};
use crate::common::{text, unwrapped};

/// A row of `docs/bad-input.md`. Each of `lines` is
///
/// ```text
/// [LIMITS] COMMAND => CODE END
/// ```
///
/// `score` without a run gets both runs of the town. With the codes 1 and 2 the end is ` | ` between words of the only line on
/// standard error; nothing is printed, and nothing in the folder changes. With 0 and 3 it is `; ` between checks of the report:
///
/// - `PATH: WORD | WORD`: the text there, or one of those there, contains the words; `PATH lacks WORD | WORD`: none of them.
/// - `PATH = JSON`, `PATH in FROM..TO`.
/// - `as COMMAND`: its scores; `near T COMMAND`: within that share of them, with the same verdicts; `far T COMMAND`: not within.
/// - `truth first`: the truth is the best run.
/// - `prints: WORD | WORD`: so does the table; `page: WORD`: so does the page of `--report`.
///
/// `0/1/3` is any of these codes, with one line where it is 1.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub(super) number: usize,
    pub(super) made: fn(&Town),
    pub(super) lines: &'static str,
}

/// All rows, or that of `DMP_ROW`.
#[test]
fn rows_of_the_table() {
    let only: Option<usize> = std::env::var("DMP_ROW").ok().map(|number| number.parse().unwrap());
    let all = [clouds::ROWS, logs::ROWS, runs::ROWS, outputs::ROWS, stopping::ROWS, texts::ROWS].concat();
    let queue = Mutex::new(all.into_iter().filter(|row| only.is_none_or(|only| only == row.number)));
    let work = || {
        loop {
            let Some(row) = queue.lock().unwrap().next() else { break };
            let town = Town::new();
            (row.made)(&town);
            let made = town.lines.borrow();
            for line in row.lines.lines().chain(made.iter().map(String::as_str)).map(str::trim) {
                if !line.is_empty() {
                    check(&town, line);
                }
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
}

/// Runs a line of a table.
fn check(town: &Town, line: &str) {
    let folder = town.root();
    let (command, end) = line.split_once(" => ").unwrap_or_else(|| panic!("no end: {line}"));
    let limited = command.strip_prefix('[').and_then(|rest| rest.split_once("] "));
    let (limits, command) = limited.unwrap_or(("", command));
    let command = with_runs(command);
    let (code, end) = end.split_once(' ').unwrap_or((end, ""));
    match code {
        "1" | "2" => refused(folder, limits, &command, code.parse().unwrap(), end),
        "0" | "3" => {
            let found = report(folder, limits, &command, code.parse().unwrap());
            end.split("; ")
                .filter(|check| !check.is_empty())
                .for_each(|check| holds(town, &command, &found, check));
        }
        _ => {
            let output = run(folder, limits, &format!("{command} --quiet"));
            let (found, stderr) = (output.status.code(), text(&output.stderr));
            let is_one = code.split('/').any(|code| found == code.parse().ok());
            assert!(
                is_one && (found != Some(1) || stderr.lines().count() == 1),
                "{line}: {found:?}\n{stderr}"
            );
        }
    }
}

fn with_runs(command: &str) -> String {
    let runs = if command.starts_with("score ") && !command.contains(" -t ") {
        " -t truth.tum -t drift.tum"
    } else {
        ""
    };
    // Drift is a promise of no row, and half of the time.
    let means =
        if command.starts_with("score ") && !command.contains(" --quick") { " --drift=none" } else { "" };
    format!("{command}{runs}{means}").replace("{gate}", GATE).replace("{keeping work}", KEEPING_WORK)
}

/// Refused in one line with all the words; nothing is printed, nothing changes.
fn refused(folder: &Path, limits: &str, command: &str, code: i32, words: &str) {
    let before = contents(folder);
    let output = run(folder, limits, &format!("{command} --quiet"));
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{command}\n{stderr}");
    assert!(stderr.lines().count() == 1 && stderr.starts_with("error: "), "{command}\n{stderr}");
    assert!(words.split(" | ").all(|word| stderr.contains(word)), "{command}: {words} not in\n{stderr}");
    assert_eq!(text(&output.stdout), "", "{command}");
    assert!(contents(folder) == before, "{command} changed the folder");
}

/// A value of a report: `damage` is that of a score or of `dmp info`.
fn value<'a>(report: &'a Value, path: &str) -> &'a Value {
    let places = ["", "/inputs", "/streams/0", "/streams/0/scans", "/inputs/runs/0"];
    places.iter().find_map(|place| report.pointer(&format!("{place}/{path}"))).unwrap_or(&Value::Null)
}

fn holds(town: &Town, command: &str, found: &Value, check: &str) {
    let folder = town.root();
    let other = |command: &str| town.report(&with_runs(command));
    let assert =
        |is_so: bool, found: &dyn std::fmt::Display| assert!(is_so, "{command}: not {check}:\n{found}");
    if check == "truth first" {
        // Where nothing is decided, runs are listed by name.
        let is_worse =
            |pair: &Value| ["drift", "noise", "collapsed"].iter().any(|other| pair["verdict"] == *other);
        let is_beaten = found["pairs"]
            .as_array()
            .unwrap()
            .iter()
            .any(|pair| (pair["a"] == "truth" || pair["b"] == "truth") && is_worse(pair));
        assert(!is_beaten, &found["pairs"]);
    } else if let Some(words) = check.strip_prefix("prints: ") {
        let output = run(folder, "", command);
        let printed = unwrapped(&(text(&output.stdout) + &text(&output.stderr)));
        assert(words.split(" | ").all(|word| printed.contains(word)), &printed);
    } else if let Some(word) = check.strip_prefix("page: ") {
        run(folder, "", &format!("{command} --quiet --report page.html"));
        assert(std::fs::read_to_string(folder.join("page.html")).unwrap().contains(word), &"page.html");
    } else if let Some(command) = check.strip_prefix("as ") {
        assert(scores(found) == scores(&other(command)), &found["runs"]);
    } else if let Some((tolerance, command)) =
        check.strip_prefix("near ").or(check.strip_prefix("far ")).and_then(|rest| rest.split_once(' '))
    {
        let other = other(command);
        let apart = numbers(found).zip(numbers(&other)).map(|(a, b)| (a / b - 1.0).abs());
        let is_near = apart.fold(0.0, f64::max) < tolerance.parse().unwrap();
        assert(is_near == check.starts_with("near"), &format!("{}\n{}", found["runs"], other["runs"]));
        assert(!is_near || verdicts(found) == verdicts(&other), &found["pairs"]);
    } else if let Some((path, json)) = check.split_once(" = ") {
        assert(*value(found, path) == serde_json::from_str::<Value>(json).unwrap(), value(found, path));
    } else if let Some((path, (from, to))) =
        check.split_once(" in ").and_then(|(path, range)| Some((path, range.split_once("..")?)))
    {
        let number = value(found, path).as_u64().unwrap_or_else(|| panic!("{command}: no number {path}"));
        assert((from.parse().unwrap()..to.parse().unwrap_or(u64::MAX)).contains(&number), &number);
    } else if let Some((path, words)) = check.split_once(" lacks ") {
        let there = value(found, path).to_string();
        assert(!words.split(" | ").any(|word| there.contains(word)), &there);
    } else {
        let (path, words) = check.split_once(": ").unwrap_or_else(|| panic!("no check: {check}"));
        let there = value(found, path);
        let has = |item: &Value| {
            words.split(" | ").all(|word| item.as_str().unwrap_or(&item.to_string()).contains(word))
        };
        assert(there.as_array().map_or_else(|| has(there), |list| list.iter().any(has)), there);
    }
}

/// The scores in numbers, of each run.
fn numbers(report: &Value) -> impl Iterator<Item = f64> {
    let fields = ["dmp_sum_m2", "r_near_m2/5", "r_near_m2/2", "r_near_m2/0.5", "miss_rate"];
    let runs = report["runs"].as_array().unwrap().iter();
    runs.flat_map(move |run| fields.map(|field| run.pointer(&format!("/{field}")).unwrap().as_f64().unwrap()))
}

fn verdicts(report: &Value) -> Vec<&Value> {
    let pairs =
        report["pairs"].as_array().unwrap().iter().flat_map(|pair| [&pair["verdict"], &pair["decided_at_m"]]);
    pairs.chain([&report["order"]]).collect()
}
