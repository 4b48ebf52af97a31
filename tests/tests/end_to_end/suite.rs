//! `dmp suite`: versions over several logs, what is kept of them, and what ends it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use crate::command::assert_documented;
use crate::common::{
    PROGRAM, dmp, dmp_command, done, ends, has, json_of, refused, sample, scores, text, write,
};

/// A folder with runs of two versions on logs that are all the sample, with these options each.
pub(crate) fn suite(names: &[(&str, &str)], more: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (version, run) in [("good", "truth.tum"), ("bad", "drift.tum")] {
        fs::create_dir_all(folder.path().join("runs").join(version)).unwrap();
        for (name, _) in names {
            let to = folder.path().join(format!("runs/{version}/{name}.tum"));
            fs::copy(sample(run), to).unwrap();
        }
    }
    fs::copy(sample("town.mcap"), folder.path().join("town.mcap")).unwrap();
    let logs: Vec<String> = names
        .iter()
        .map(|(name, options)| format!("[[log]]\npath = \"town.mcap\"\nname = \"{name}\"\n{options}\n"))
        .collect();
    let file = format!(
        "versions = [\"bad\", \"good\"]\ntrajectories = \"runs/{{version}}/{{log}}.tum\"\n{more}\n[score]\nvoxel = 0.3\n\
         every = 2\ntrust = true\ndrift = \"none\"\n{}",
        logs.concat()
    );
    write(folder.path(), "s.toml", &file);
    folder
}

fn lines(output: &Output) -> Vec<String> {
    text(&output.stderr).lines().map(str::to_owned).collect()
}

/// How many logs were scored, by the lines that say so.
fn scored(output: &Output) -> usize {
    lines(output).iter().filter(|line| line.ends_with(": scoring 2 versions")).count()
}

const NINE: [(&str, &str); 9] = [
    ("a", ""),
    ("b", ""),
    ("c", ""),
    ("d", ""),
    ("e", ""),
    ("f", ""),
    ("g", ""),
    ("h", ""),
    ("i", "max_range = 60"),
];

#[test]
fn versions_are_compared_and_the_second_time_nothing_is_scored() {
    let folder = suite(&NINE, "");
    let first = ends(folder.path(), "suite s.toml --json", 0);
    // Eight logs are one, with the same runs and settings.
    assert_eq!(scored(&first), 2);
    let report = json_of(&first);
    assert_documented(&report);
    let pair = &report["pairs"][0];
    for (field, expected) in [
        ("a", Value::from("bad")),
        ("b", "good".into()),
        ("better", "good".into()),
        ("outcome", "better".into()),
        ("b_better", 9.into()),
        ("compared", 9.into()),
        ("p_value", (2.0 / 512.0).into()),
    ] {
        assert_eq!(pair[field], expected, "{field}");
    }
    assert!(pair["rms_difference"]["interval_m"][0].as_f64().unwrap() > 0.1, "{pair}");
    let second = dmp(folder.path(), "suite s.toml --json");
    assert_eq!((scored(&second), second.stdout == first.stdout), (0, true));
    let table = done(folder.path(), "suite s.toml --quiet");
    assert!(table.starts_with("good is better than bad, over 9 logs.\n"), "{table}");

    // Gates of the file and of the command.
    let file = fs::read_to_string(folder.path().join("s.toml")).unwrap();
    let gates = "[gates]\nexpect = [\"unbeaten:good\", \"bad:lost_logs<8\"]\n";
    write(folder.path(), "s.toml", &(file + gates));
    let command = "suite s.toml --quiet --expect best:good --junit gates.xml --report page.html";
    let output = ends(folder.path(), command, 4);
    let failed = "bad: worse than good on 9 of 9 logs: more than 8";
    let said = lines(&output);
    assert!(said.len() == 1 && said[0].starts_with(&format!("gate failed: {failed}")), "{said:?}");
    has(&text(&output.stdout), &["  passed  good: better than bad over all logs"]);
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    has(&read("gates.xml"), &["<testsuite name=\"dmp suite\" tests=\"3\" failures=\"1\""]);
    let page = read("page.html");
    has(&page, &["good is better than bad, over 9 logs.", &format!("Gate failed: {failed}")]);
    for outside in ["http:", "https:", "<script", "src=", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn a_suite_of_logs_that_cannot_be_read_fails() {
    let folder = suite(&[("a", "")], "");
    write(folder.path(), "town.mcap", "not a log");
    let said = ends(folder.path(), "suite s.toml", 1);
    has(lines(&said).last().unwrap(), &["error: s.toml: no log was scored", "town.mcap"]);
}

#[test]
fn other_programs_can_fill_the_cache() {
    let folder = suite(&[("a", ""), ("b", "max_range = 60\nquick = true"), ("same as a", "")], "");
    let path = folder.path();
    // A quick score chooses its scans, and measures no drift.
    let asked = fs::read_to_string(path.join("s.toml")).unwrap();
    write(path, "s.toml", &asked.replace("every = 2\n", "").replace("drift = \"none\"\n", ""));
    let empty = ends(path, "suite s.toml --cached", 2);
    has(lines(&empty).last().unwrap(), &["error: s.toml: no log was scored", "not in the cache"]);
    let list = json_of(&dmp(path, "suite s.toml --list"));
    let logs = list["logs"].as_array().unwrap();
    assert_eq!((&list["schema"], logs.len()), (&"dmp-suite-list/1".into(), 2));
    assert_eq!((&logs[0]["is_in_parts"], &logs[1]["is_in_parts"]), (&true.into(), &false.into()));
    let elsewhere = tempfile::tempdir().unwrap();
    let arguments =
        logs[1]["arguments"].as_array().unwrap().iter().map(|argument| argument.as_str().unwrap());
    let made = Command::new(PROGRAM).args(arguments).current_dir(elsewhere.path()).output().unwrap();
    assert_eq!(made.status.code(), Some(0), "{}", text(&made.stderr));
    let file = logs[1]["result"].as_str().unwrap();
    fs::write(file, &made.stdout).unwrap();
    assert_eq!(json_of(&dmp(path, "suite s.toml --list"))["logs"].as_array().unwrap().len(), 1);
    assert_eq!(scored(&dmp(path, "suite s.toml")), 1);
    // What the suite makes itself is the same.
    fs::remove_dir_all(path.join(".dmp-suite")).unwrap();
    assert_eq!(scored(&dmp(path, "suite s.toml")), 2);
    assert_eq!(scores(&fs::read(file).unwrap()), scores(&made.stdout));

    // Another program may only say why there is none.
    let whole = fs::read(file).unwrap();
    fs::write(file, "{\"schema\": \"dmp-suite-problem/1\", \"problem\": \"the workers died\"}").unwrap();
    let cached = ends(path, "suite s.toml --cached --json", 3);
    let problems = json_of(&cached)["logs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|log| log["problem"].clone())
        .collect::<Vec<_>>();
    assert_eq!(problems, [Value::Null, "the workers died".into(), Value::Null]);
    fs::write(file, &whole).unwrap();
    assert_eq!(scored(&ends(path, "suite s.toml --cached", 0)), 0);
    // A damaged result goes when others are to make it again.
    fs::write(file, &whole[..whole.len() / 2]).unwrap();
    let cached = json_of(&dmp(path, "suite s.toml --cached --json"));
    has(&cached["logs"][1]["problem"].to_string(), &["is damaged"]);
    let list = json_of(&dmp(path, "suite s.toml --list"));
    assert_eq!((&list["logs"][0]["result"], Path::new(file).exists()), (&file.into(), false));
}

#[test]
fn only_what_changed_is_scored_again() {
    let folder = suite(&[("a", "")], "");
    let path = folder.path();
    let again = || scored(&dmp(path, "suite s.toml"));
    assert_eq!((again(), again()), (1, 0));
    // Written again as it was: other times and names, the same content.
    let run = path.join("runs/good/a.tum");
    let bytes = fs::read(&run).unwrap();
    fs::write(&run, &bytes).unwrap();
    fs::copy(path.join("town.mcap"), path.join("moved.mcap")).unwrap();
    let file = fs::read_to_string(path.join("s.toml")).unwrap();
    write(path, "s.toml", &file.replace("town.mcap", "moved.mcap"));
    assert_eq!(again(), 0);
    // A pose less.
    let end = bytes.len() - 2 - bytes.iter().rev().skip(1).position(|&byte| byte == b'\n').unwrap();
    fs::write(&run, &bytes[..=end]).unwrap();
    assert_eq!((again(), again()), (1, 0));
    write(path, "s.toml", &(file.clone() + "max_range = 50\n"));
    assert_eq!((again(), again()), (1, 0));
    // As before: the results are still there.
    write(path, "s.toml", &file);
    fs::write(&run, &bytes).unwrap();
    assert_eq!(again(), 0);
}

#[test]
fn a_damaged_result_is_scored_again_with_a_warning() {
    let folder = suite(&[("a", "")], "");
    let path = folder.path();
    let first = dmp(path, "suite s.toml --json --quiet");
    let result = path.join(json_of(&first)["logs"][0]["result"].as_str().unwrap());
    let whole = fs::read(&result).unwrap();
    // Another digit, which is a result all the same.
    let digit = text(&whole).find("\"mean_a_m2\": 0.").unwrap() + "\"mean_a_m2\": 0.".len();
    let mut changed = whole.clone();
    changed[digit] = if changed[digit] == b'1' { b'2' } else { b'1' };
    fs::write(&result, changed).unwrap();
    let again = ends(path, "suite s.toml --json --quiet", 0);
    has(&text(&again.stderr), &["scored again"]);
    assert!(lines(&again).len() == 1 && again.stdout == first.stdout);
    // Without the index a result is taken when it is one.
    write(path, ".dmp-suite/index.json", "{");
    assert_eq!(scored(&ends(path, "suite s.toml", 0)), 0);
    fs::remove_file(path.join(".dmp-suite/index.json")).unwrap();
    fs::write(&result, &whole[..whole.len() / 2]).unwrap();
    assert_eq!(scored(&ends(path, "suite s.toml", 0)), 1);
}

#[test]
fn a_log_that_fails_and_a_missing_run_are_reported_and_the_rest_stays() {
    let folder = suite(&[("a", ""), ("b", ""), ("c", "")], "logs = [\"broken.mcap\"]");
    let path = folder.path();
    write(path, "broken.mcap", "no log");
    for version in ["good", "bad"] {
        fs::copy(sample("truth.tum"), path.join(format!("runs/{version}/broken.tum"))).unwrap();
    }
    fs::remove_file(path.join("runs/bad/c.tum")).unwrap();
    write(path, "runs/bad/b.tum", "what an odometry wrote that failed\n");
    let report = json_of(&ends(path, "suite s.toml --json", 3));
    let logs = report["logs"].as_array().unwrap();
    has(logs[0]["problem"].as_str().unwrap(), &["broken.mcap: "]);
    assert_eq!(logs[3]["missing"][0]["reason"], "no such file: runs/bad/c.tum");
    has(logs[2]["missing"][0]["reason"].as_str().unwrap(), &["run `bad` is excluded: b.tum: line 1: "]);
    let pair = &report["pairs"][0];
    assert_eq!((&pair["compared"], &pair["outcome"]), (&3.into(), &"too_few_logs".into()));
    assert_eq!(
        pair["failures"],
        serde_json::json!([{ "log": "b", "version": "bad" }, { "log": "c", "version": "bad" }])
    );
    // The broken log is tried again, and nothing else.
    assert_eq!(scored(&dmp(path, "suite s.toml")), 1);
}

#[test]
fn results_stay_where_the_suite_is_killed() {
    let folder = suite(&[("a", ""), ("b", "max_range = 60"), ("c", "max_range = 50")], "");
    let mut running = dmp_command(folder.path(), "suite s.toml --quiet").spawn().unwrap();
    let kept = || {
        let entries = fs::read_dir(folder.path().join(".dmp-suite")).into_iter().flatten();
        let stems = entries.filter_map(|entry| entry.unwrap().path().file_stem()?.to_str().map(str::len));
        // Results are named by hashes, of 64 digits.
        stems.filter(|&length| length == 64).count()
    };
    while kept() == 0 && running.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    running.kill().unwrap();
    running.wait().unwrap();
    let done = kept();
    assert!(done > 0);
    assert_eq!(scored(&dmp(folder.path(), "suite s.toml")), 3 - done);
}

#[test]
fn what_is_wrong_with_a_suite_is_one_line_with_file_key_and_value() {
    let folder = suite(&[("a", "")], "");
    let file = fs::read_to_string(folder.path().join("s.toml")).unwrap();
    for (from, to, words) in [
        ("every = 2", "evry = 2", &["s.toml: score.evry = 2: "][..]),
        ("voxel = 0.3", "voxel = \"big\"", &["s.toml: log `a`: ", "'big' for '--voxel"]),
        ("\"town.mcap\"", "\"city.mcap\"", &["s.toml: log[1].path = \"city.mcap\": no such file or folder"]),
        ("[\"bad\", \"good\"]", "[\"bad\", \"god\"]", &["`god` has no run on any log", "runs/god/a.tum"]),
        ("runs/{version}", "runs/{ver}", &["s.toml: trajectories = ", "{ver} is neither"]),
        ("voxel = 0.3", "voxel = ", &["s.toml: line 5: "]),
        ("[score]", "[gates]\nexpect = \"best:x\"\n[score]", &["no version is called `x`", "bad, good"]),
    ] {
        assert!(file.contains(from));
        write(folder.path(), "s.toml", &file.replace(from, to));
        refused(folder.path(), "suite s.toml", 2, words);
    }
    write(folder.path(), "s.toml", &file);
    refused(folder.path(), "suite s.toml --report town.mcap", 2, &["town.mcap"]);
    refused(folder.path(), "suite none.toml", 2, &["none.toml"]);
    assert!(!folder.path().join(".dmp-suite").exists());
    write(folder.path(), "example.toml", &done(folder.path(), "suite --example"));
    refused(folder.path(), "suite example.toml", 2, &["example.toml: logs[1].path = ", ": no such"]);
}
