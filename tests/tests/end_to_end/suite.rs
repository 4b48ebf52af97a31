//! `dmp suite`: versions over several logs, what is kept of them, and what ends it.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use crate::browser::{Browser, Theme};
use crate::common::{dmp, dmp_command, refused, text, workspace, write};

/// A folder with runs of two versions on logs that are all the sample, with these options each.
fn suite(names: &[(&str, &str)], more: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let samples = workspace().join("data-samples");
    for (version, run) in [("good", "truth.tum"), ("bad", "drift.tum")] {
        fs::create_dir_all(folder.path().join("runs").join(version)).unwrap();
        for (name, _) in names {
            let to = folder.path().join(format!("runs/{version}/{name}.tum"));
            fs::copy(samples.join(run), to).unwrap();
        }
    }
    fs::copy(samples.join("town.mcap"), folder.path().join("town.mcap")).unwrap();
    let logs: Vec<String> = names
        .iter()
        .map(|(name, options)| format!("[[log]]\npath = \"town.mcap\"\nname = \"{name}\"\n{options}\n"))
        .collect();
    let file = format!(
        "versions = [\"bad\", \"good\"]\ntrajectories = \"runs/{{version}}/{{log}}.tum\"\n{more}\n[score]\nvoxel = 0.3\n\
         every = 2\n{}",
        logs.concat()
    );
    write(folder.path(), "s.toml", &file);
    folder
}

fn lines(output: &Output) -> Vec<String> {
    text(&output.stderr).lines().map(str::to_owned).collect()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", text(&output.stderr)))
}

/// How many logs were scored, by what was said.
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
    let first = dmp(folder.path(), "suite s.toml --json");
    assert_eq!(first.status.code(), Some(0), "{}", text(&first.stderr));
    // Eight logs are one, with the same runs and settings.
    assert_eq!(scored(&first), 2);
    let report = json(&first);
    let pair = &report["pairs"][0];
    assert_eq!((&pair["a"], &pair["b"], &pair["better"]), (&"bad".into(), &"good".into(), &"good".into()));
    assert_eq!(
        (&pair["outcome"], &pair["b_better"], &pair["compared"]),
        (&"better".into(), &9.into(), &9.into())
    );
    assert_eq!(pair["p_value"].as_f64(), Some(2.0 / 512.0));
    assert!(pair["rms_difference"]["interval_m"][0].as_f64().unwrap() > 0.1, "{pair}");
    let second = dmp(folder.path(), "suite s.toml --json");
    assert_eq!((scored(&second), second.stdout == first.stdout), (0, true));
    let table = text(&dmp(folder.path(), "suite s.toml --quiet").stdout);
    assert!(table.starts_with("good is better than bad, over 9 logs.\n"), "{table}");
    assert!(table.lines().all(|line| line.chars().count() <= 80), "{table}");
    let documented = fs::read_to_string(workspace().join("docs/json.md")).unwrap();
    let documented = &documented[documented.find("## `dmp-suite/1`").unwrap()..];
    let fields =
        [&report, pair, &pair["rms_difference"], &pair["logs"][0], &report["logs"][0], &report["promise"]];
    let fields = fields.into_iter().flat_map(|value| value.as_object().unwrap().keys());
    let missing: Vec<&String> = fields.filter(|field| !documented.contains(&format!("`{field}`"))).collect();
    assert!(missing.is_empty(), "not in docs/json.md: {missing:?}");
}

/// A result without what differs from one time to the next.
fn comparable(bytes: &[u8]) -> Value {
    let mut json: Value = serde_json::from_slice(bytes).unwrap();
    let object = json.as_object_mut().unwrap();
    assert!(object.remove("timing").is_some() && object.remove("memory").is_some());
    json
}

#[test]
fn other_programs_can_fill_the_cache() {
    let folder = suite(&[("a", ""), ("b", "max_range = 60")], "");
    let list = json(&dmp(folder.path(), "suite s.toml --list"));
    assert_eq!((&list["schema"], list["logs"].as_array().unwrap().len()), (&"dmp-suite-list/1".into(), 2));
    let log = &list["logs"][1];
    let arguments: Vec<&str> =
        log["arguments"].as_array().unwrap().iter().map(|a| a.as_str().unwrap()).collect();
    let elsewhere = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_dmp-under-test"));
    let made = command.args(&arguments).current_dir(elsewhere.path()).output().unwrap();
    assert_eq!(made.status.code(), Some(0), "{}", text(&made.stderr));
    let result = Path::new(log["result"].as_str().unwrap()).to_path_buf();
    fs::write(&result, &made.stdout).unwrap();
    let list = json(&dmp(folder.path(), "suite s.toml --list"));
    assert_eq!(list["logs"].as_array().unwrap().len(), 1);
    assert_eq!(scored(&dmp(folder.path(), "suite s.toml")), 1);
    // What the suite makes itself is the same.
    fs::remove_dir_all(folder.path().join(".dmp-suite")).unwrap();
    assert_eq!(scored(&dmp(folder.path(), "suite s.toml")), 2);
    assert_eq!(comparable(&fs::read(&result).unwrap()), comparable(&made.stdout));
}

#[test]
fn what_is_cached_is_told_without_scoring_and_so_is_why_something_is_not() {
    let more = ("b", "max_range = 60\nfree_space = true");
    let folder = suite(&[("a", ""), more, ("same as a", "")], "");
    let empty = dmp(folder.path(), "suite s.toml --cached");
    let why = "error: s.toml: no log was scored, the first because: its result is not in the cache";
    assert_eq!((empty.status.code(), lines(&empty).last().map(String::as_str)), (Some(2), Some(why)));
    let list = json(&dmp(folder.path(), "suite s.toml --list"));
    let listed: Vec<(&str, bool)> = list["logs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|log| (log["name"].as_str().unwrap(), log["is_in_parts"].as_bool().unwrap()))
        .collect();
    assert_eq!(listed, [("a", true), ("b", false)]);
    // One is made by this program, of the other another one could only say why it is not.
    assert_eq!(scored(&dmp(folder.path(), "suite s.toml")), 2);
    let file = list["logs"][1]["result"].as_str().unwrap();
    let problem = "{\"schema\": \"dmp-suite-problem/1\", \"problem\": \"the workers died\"}";
    let whole = fs::read(file).unwrap();
    fs::write(file, problem).unwrap();
    let cached = dmp(folder.path(), "suite s.toml --cached --json");
    assert_eq!((cached.status.code(), scored(&cached)), (Some(3), 0));
    let logs = &json(&cached)["logs"];
    assert_eq!(
        (&logs[0]["problem"], &logs[1]["problem"], &logs[2]["problem"]),
        (&Value::Null, &"the workers died".into(), &Value::Null)
    );
    // A result in its place is taken, and a damaged one goes when others are to make it again.
    fs::write(file, &whole).unwrap();
    let there = dmp(folder.path(), "suite s.toml --cached");
    assert_eq!((there.status.code(), scored(&there)), (Some(0), 0), "{}", text(&there.stderr));
    fs::write(file, &whole[..whole.len() / 2]).unwrap();
    let cached = json(&dmp(folder.path(), "suite s.toml --cached --json"));
    assert!(
        cached["logs"][1]["problem"].as_str().unwrap().contains("is damaged: it is not as it was written")
    );
    let list = json(&dmp(folder.path(), "suite s.toml --list"));
    assert_eq!((&list["logs"][0]["result"], Path::new(file).exists()), (&file.into(), false));
    // Made again elsewhere it has other times; without those it is what it was.
    fs::write(file, String::from_utf8(whole).unwrap() + "\n").unwrap();
    assert_eq!(dmp(folder.path(), "suite s.toml --cached").status.code(), Some(0));
    fs::write(file, problem).unwrap();
    assert_eq!(scored(&dmp(folder.path(), "suite s.toml")), 1);
}

#[test]
fn only_what_changed_is_scored_again() {
    let folder = suite(&[("a", ""), ("b", "max_range = 60")], "");
    let again = || scored(&dmp(folder.path(), "suite s.toml"));
    assert_eq!((again(), again()), (2, 0));
    // Written again as it was: other times, the same content.
    let run = folder.path().join("runs/good/a.tum");
    let bytes = fs::read(&run).unwrap();
    fs::write(&run, &bytes).unwrap();
    fs::copy(folder.path().join("town.mcap"), folder.path().join("moved.mcap")).unwrap();
    let file = fs::read_to_string(folder.path().join("s.toml")).unwrap();
    write(folder.path(), "s.toml", &file.replace("town.mcap", "moved.mcap"));
    assert_eq!(again(), 0);
    // A pose less.
    let end = bytes.len() - 2 - bytes.iter().rev().skip(1).position(|&byte| byte == b'\n').unwrap();
    fs::write(&run, &bytes[..=end]).unwrap();
    assert_eq!((again(), again()), (1, 0));
    write(folder.path(), "s.toml", &file.replace("max_range = 60", "max_range = 50"));
    assert_eq!((again(), again()), (1, 0));
    // As before: both results are still there.
    write(folder.path(), "s.toml", &file);
    fs::write(&run, &bytes).unwrap();
    assert_eq!(again(), 0);
}

#[test]
fn a_damaged_result_is_scored_again_and_that_is_said() {
    let folder = suite(&[("a", "")], "");
    let first = dmp(folder.path(), "suite s.toml --json --quiet");
    let result = folder.path().join(json(&first)["logs"][0]["result"].as_str().unwrap());
    let whole = fs::read(&result).unwrap();
    // Another digit, which is a result all the same.
    let digit = text(&whole).find("\"mean_a_m2\": 0.").unwrap() + "\"mean_a_m2\": 0.".len();
    let mut changed = whole.clone();
    changed[digit] = if changed[digit] == b'1' { b'2' } else { b'1' };
    for (bytes, why) in
        [(&changed[..], "it is not as it was written"), (&whole[..whole.len() / 2], "written")]
    {
        fs::write(&result, bytes).unwrap();
        let again = dmp(folder.path(), "suite s.toml --json --quiet");
        let said = lines(&again);
        assert!(said.len() == 1 && said[0].contains("scored again") && said[0].contains(why), "{said:?}");
        assert_eq!((again.status.code(), again.stdout == first.stdout), (Some(0), true));
    }
    // Without the index a result is taken when it is one.
    let index = folder.path().join(".dmp-suite/index.json");
    fs::write(&index, "{").unwrap();
    let again = dmp(folder.path(), "suite s.toml");
    assert!(lines(&again)[0].contains("index.json: no index, so all files are read once more"));
    assert_eq!(scored(&again), 0);
    fs::remove_file(&index).unwrap();
    fs::write(&result, &whole[..whole.len() / 2]).unwrap();
    let again = dmp(folder.path(), "suite s.toml --quiet");
    assert!(
        lines(&again)[0].contains("damaged: no result of `dmp score --json`: EOF"),
        "{:?}",
        lines(&again)
    );
}

#[test]
fn a_log_that_fails_and_a_run_that_is_missing_are_told_and_the_rest_stays() {
    let folder = suite(&[("a", ""), ("b", ""), ("c", "")], "logs = [\"broken.mcap\"]");
    write(folder.path(), "broken.mcap", "no log");
    for version in ["good", "bad"] {
        fs::copy(
            workspace().join("data-samples/truth.tum"),
            folder.path().join(format!("runs/{version}/broken.tum")),
        )
        .unwrap();
    }
    fs::remove_file(folder.path().join("runs/bad/c.tum")).unwrap();
    let output = dmp(folder.path(), "suite s.toml --json");
    assert_eq!(output.status.code(), Some(3));
    let report = json(&output);
    let logs = report["logs"].as_array().unwrap();
    assert!(logs[0]["problem"].as_str().unwrap().starts_with("broken.mcap: "), "{}", logs[0]);
    assert_eq!(logs[3]["missing"][0]["reason"], "no such file: runs/bad/c.tum");
    assert_eq!(logs[3]["problem"], "only good has a run on it");
    assert_eq!(
        (&report["pairs"][0]["compared"], &report["pairs"][0]["outcome"]),
        (&2.into(), &"too_few_logs".into())
    );
    let warnings: BTreeSet<&str> =
        report["warnings"].as_array().unwrap().iter().map(|warning| warning.as_str().unwrap()).collect();
    assert!(warnings.contains("c was not scored: only good has a run on it"), "{warnings:?}");
    assert_eq!(
        scored(&dmp(folder.path(), "suite s.toml")),
        1,
        "the broken log is tried again, and nothing else"
    );
}

#[test]
fn what_is_done_stays_where_the_suite_is_killed() {
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
fn gates_of_the_file_and_of_the_command_end_it_with_4() {
    let folder = suite(&NINE, "");
    let mut file = fs::read_to_string(folder.path().join("s.toml")).unwrap();
    file.push_str("[gates]\nexpect_unbeaten = \"good\"\nfail_worse_on = { bad = 8 }\n");
    write(folder.path(), "s.toml", &file);
    let output =
        dmp(folder.path(), "suite s.toml --quiet --expect-best good --junit gates.xml --report page.html");
    assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
    let failed = "bad: worse than good on 9 of 9 logs: more than 8 (--fail-worse-on bad=8)";
    assert_eq!(lines(&output), [format!("gate failed: {failed}")]);
    let table = text(&output.stdout);
    assert!(table.contains("  passed  good: better than bad over all logs (--expect-best good)"), "{table}");
    let junit = fs::read_to_string(folder.path().join("gates.xml")).unwrap();
    assert!(junit.contains("<testsuite name=\"dmp suite\" tests=\"3\" failures=\"1\""), "{junit}");
    let page = fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(
        page.contains("good is better than bad, over 9 logs.")
            && page.contains(&format!("Gate failed: {failed}"))
    );
    for outside in ["http:", "https:", "<script", "src=", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn what_is_wrong_with_a_suite_is_one_line_with_file_key_and_value() {
    let folder = suite(&[("a", "")], "");
    let file = fs::read_to_string(folder.path().join("s.toml")).unwrap();
    let change = |from: &str, to: &str| {
        assert!(file.contains(from));
        write(folder.path(), "s.toml", &file.replace(from, to));
    };
    for (from, to, words) in [
        ("every = 2", "evry = 2", &["s.toml: score.evry = 2: ", "is not one"][..]),
        ("voxel = 0.3", "voxel = \"big\"", &["s.toml: log `a`: ", "'big' for '--voxel"]),
        ("\"town.mcap\"", "\"city.mcap\"", &["s.toml: log[1].path = \"city.mcap\": no such file or folder"]),
        ("[\"bad\", \"good\"]", "[\"bad\", \"god\"]", &["`god` has no run on any log", "runs/god/a.tum"]),
        (
            "runs/{version}",
            "runs/{ver}",
            &["s.toml: trajectories = ", "{ver} is neither {version} nor {log}"],
        ),
        ("versions = ", "version = ", &["s.toml: versions: two names"]),
        ("voxel = 0.3", "voxel = ", &["s.toml: line 5: "]),
        ("[score]", "[gates]\nexpect_bst = \"good\"\n[score]", &["s.toml: gates.expect_bst = \"good\": "]),
        ("[score]", "[gates]\nexpect_best = \"x\"\n[score]", &["no version is called `x`", "bad, good"]),
    ] {
        change(from, to);
        refused(folder.path(), "suite s.toml", 2, words);
    }
    write(folder.path(), "s.toml", &file);
    refused(folder.path(), "suite s.toml --report town.mcap", 2, &["town.mcap"]);
    refused(folder.path(), "suite none.toml", 2, &["none.toml"]);
    assert!(!folder.path().join(".dmp-suite").exists());
    let example = dmp(folder.path(), "suite --example");
    assert_eq!(example.status.code(), Some(0));
    write(folder.path(), "example.toml", &text(&example.stdout));
    refused(
        folder.path(),
        "suite example.toml",
        2,
        &["example.toml: logs[1].path = \"logs/campus.mcap\": no such"],
    );
}

/// Names as people have them: long ones, and such that would be elements.
#[test]
fn a_browser_shows_every_part_of_the_page() {
    let Some(browser) = Browser::start() else { return };
    let folder = suite(&[("a", ""), ("2024-03-11 <b>the long drive past the harbour & back", "")], "");
    let written = dmp(folder.path(), "suite s.toml --quiet --report page.html --expect-best good");
    assert_eq!(written.status.code(), Some(4), "{}", text(&written.stderr));
    for (width_px, theme) in [(1280, Theme::Light), (390, Theme::Dark)] {
        let page = browser.open(&folder.path().join("page.html"), width_px, theme);
        for (role, name) in [
            ("heading", "bad or good: which makes the better maps?"),
            ("region", "Verdict"),
            ("region", "Over all logs"),
            ("columnheader", "first better"),
            ("region", "Every log, worst first"),
            ("columnheader", "bad / good"),
            ("region", "What was scored"),
        ] {
            assert!(page.has(role, name), "{width_px} {theme:?}: no {role} `{name}`");
        }
        let told = page.text();
        assert!(told.contains("Too few logs to decide anything: 2 logs."), "{told}");
        assert!(told.contains("<b>the long drive past the harbour & back"), "{told}");
        assert!(told.contains("8 needed, even if all of them agree, and 2 compare both"), "{told}");
        page.assert_sound();
        assert!(page.requests().is_empty(), "{:?}", page.requests());
    }
}
