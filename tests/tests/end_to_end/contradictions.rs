//! No two statements of one report contradict each other: the sentence, the table, the numbers, the warnings, in a terminal, as
//! JSON and on the page.

use std::path::Path;

use serde_json::Value;

use crate::common::{dmp, done, has, text, tum, unwrapped, write};

/// A report as its JSON, as a terminal has it, and as its page has it.
struct Said {
    command: String,
    json: Value,
    text: String,
    notes: String,
    page: String,
}

/// The report of a command, which may exclude a run.
fn said(folder: &Path, command: &str) -> Said {
    let shown = dmp(folder, &format!("{command} --report said.html"));
    assert!(matches!(shown.status.code(), Some(0 | 3)), "{command}\n{}", text(&shown.stderr));
    let page = std::fs::read_to_string(folder.join("said.html")).unwrap();
    let data = between(&page, "id=\"dmp-report\">", "</script>");
    Said {
        command: command.to_owned(),
        json: serde_json::from_str(data).unwrap(),
        text: text(&shown.stdout),
        notes: text(&shown.stderr),
        page,
    }
}

fn between<'a>(text: &'a str, begin: &str, end: &str) -> &'a str {
    text.split_once(begin).and_then(|(_, rest)| rest.split_once(end)).unwrap().0
}

/// What a reader of HTML sees.
fn without_tags(html: &str) -> String {
    let parts = html.split('<').enumerate();
    let shown =
        parts.map(|(k, part)| if k == 0 { part } else { part.split_once('>').map_or("", |(_, t)| t) });
    unwrapped(&shown.collect::<String>().replace("&amp;", "&"))
}

/// The metres of a cell as `16 cm` or `3.7 m`.
fn metres(cell: &str) -> Option<f64> {
    let (number, unit) = cell.split_once(' ')?;
    let number: f64 = number.parse().ok()?;
    match unit {
        "cm" => Some(number / 100.0),
        "m" => Some(number),
        _ => None,
    }
}

fn names(list: &Value) -> Vec<&str> {
    list.as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect()
}

impl Said {
    fn check(&self) {
        self.the_same_is_what_the_poses_say();
        self.who_is_best_is_best_everywhere();
        self.a_rank_follows_from_verdicts();
        self.what_comes_back_has_somewhere_to_come_back_to();
        self.what_is_thick_was_measured();
        self.terminal_and_page_say_the_same();
        self.nothing_is_said_twice();
    }

    #[track_caller]
    fn holds(&self, what: bool, why: &str) {
        assert!(what, "{why}: {}\n{}\n{}", self.command, self.text, self.notes);
    }

    fn of(&self, field: &str) -> &[Value] {
        self.json[field].as_array().unwrap()
    }

    fn order(&self) -> Vec<&str> {
        names(&self.json["order"])
    }

    fn pair(&self, one: &str, other: &str) -> Option<&Value> {
        self.of("pairs").iter().find(|pair| {
            let names = [&pair["a"], &pair["b"]].map(|name| name.as_str().unwrap());
            names == [one, other] || names == [other, one]
        })
    }

    fn beats(&self, one: &str, other: &str) -> bool {
        self.pair(one, other).is_some_and(|pair| pair["verdict"] == one)
    }

    fn drift_of(&self, name: &str) -> Option<&Value> {
        self.json["drift"]["runs"].as_array()?.iter().find(|run| run["name"] == name)
    }

    /// The first paragraph: it may be in several lines.
    fn sentence(&self) -> String {
        unwrapped(self.text.split("\n\n").next().unwrap())
    }

    /// The first table of the page, a row for each run: its cells by their heads.
    fn rows(&self) -> Vec<Vec<(String, String)>> {
        let table = between(&self.page, "<table", "</table>");
        let cells = |row: &str, close: &str| -> Vec<String> {
            row.split(close).map(without_tags).filter(|cell| !cell.is_empty()).collect()
        };
        let mut rows = table.split("<tr>").skip(1);
        let heads = cells(rows.next().unwrap(), "</th>");
        let row =
            |row: &str| heads.iter().cloned().zip(cells(&row.replace("</th>", "</td>"), "</td>")).collect();
        rows.map(row).collect()
    }

    fn the_same_is_what_the_poses_say(&self) {
        let within_m = self.json["promise"]["same_within_m"].as_f64().unwrap();
        for pair in self.of("pairs") {
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
        let sentence = self.sentence();
        let is_open =
            sentence.contains("Nothing is decided between") || sentence.contains(" share the first rank");
        let is_known = self.of("pairs").iter().all(|pair| pair["apart"].is_object());
        self.holds(
            !is_open || !is_known || sentence.contains(" apart") || sentence.contains("better everywhere"),
            "undecided without how far apart",
        );
    }

    fn who_is_best_is_best_everywhere(&self) {
        let order = self.order();
        let is_best = order.len() > 1 && order[1..].iter().all(|other| self.beats(order[0], other));
        let sentence = self.sentence();
        let claims =
            sentence.contains(" is best: ") || order.len() == 2 && sentence.contains(" is better than ");
        self.holds(!claims || sentence.contains("on the whole") || is_best, "the sentence claims more");
        self.holds(!is_best || claims, "the sentence claims less");
        self.holds(
            !sentence.contains(" are the same") || !sentence.contains("which is right"),
            "the same and undecided",
        );
        let is_lost =
            |name: &str| self.drift_of(name).is_some_and(|run| run["pairs_lost"].as_u64() > Some(0));
        self.holds(!is_best || !is_lost(order[0]) || sentence.contains("lost"), "best, and silently lost");
        for excluded in self.of("left_out") {
            let name = excluded["name"].as_str().unwrap();
            self.holds(!order.contains(&name) && !sentence.contains(name), "excluded and ranked");
            self.holds(self.text.contains(&format!("{name}  excluded")), "excluded in silence");
        }
    }

    fn a_rank_follows_from_verdicts(&self) {
        let (order, rows) = (self.order(), self.rows());
        self.holds(order.len() == rows.len(), "a row for each run");
        let ranks: Vec<usize> = rows.iter().map(|row| row[0].1.parse().unwrap()).collect();
        let verdicts: Vec<Option<&str>> = rows
            .iter()
            .map(|row| row.iter().find(|(head, _)| head == "verdict").map(|(_, cell)| cell.as_str()))
            .collect();
        for (k, name) in order.iter().enumerate() {
            self.holds(rows[k][1].1.starts_with(name), "rows in another order");
            let above = || order[..k].iter().zip(&ranks);
            self.holds(!above().any(|(other, _)| self.beats(name, other)), "a worse run stands above");
            let is_of_rank =
                |other: &str| ranks[order.iter().position(|of| *of == other).unwrap()] == ranks[k];
            self.holds(!above().any(|(o, _)| is_of_rank(o) && self.beats(o, name)), "one rank, and better");
            let is_beaten = above().any(|(other, _)| self.beats(other, name));
            let is_compared = k > 0 && self.pair(order[k - 1], name).is_some();
            self.holds(ranks[k] == 1 || is_beaten || !is_compared, "a rank without a verdict");
            let Some(verdict) = verdicts[k] else { continue };
            self.holds(
                (verdict == "best") == (k == 0 && !order[1..].iter().any(|o| !self.beats(name, o))),
                "best",
            );
            let Some(pair) = self.pair(order[0], name).filter(|_| k > 0) else { continue };
            let is_mixed = pair["better_on_the_whole"].is_string();
            let found = [verdict == "the same", verdict == "undecided", verdict.starts_with("mixed")];
            let of_json = |word: &str| pair["verdict"] == word && pair["decided_at_m"].is_null();
            self.holds(
                found == [of_json("same"), of_json("undecided"), is_mixed],
                "a verdict of another pair",
            );
            self.holds(verdict.contains(" worse") == self.beats(order[0], name) || is_mixed, "worse, or not");
        }
    }

    fn what_comes_back_has_somewhere_to_come_back_to(&self) {
        let runs = self.json["drift"]["runs"].as_array().cloned().unwrap_or_default();
        let count = |run: &Value, field: &str| run[field].as_u64().unwrap();
        let is_measured = runs.iter().any(|run| count(run, "pairs_measured") > 0);
        let flat = unwrapped(&self.text);
        self.holds(is_measured || !flat.contains("revisit error"), "an error at no revisit");
        self.holds(!is_measured || !flat.contains("revisits no place"), "it revisits places");
        for run in &runs {
            let name = run["name"].as_str().unwrap();
            let is_lost = count(run, "pairs_lost") > 0;
            self.holds(
                !is_lost || !flat.contains(&format!("{name} has a revisit error")),
                "lost, and comes back",
            );
            self.holds(!is_lost || flat.contains("lost "), "lost, and nobody says so");
            let Some(scored) = self.of("runs").iter().find(|scored| scored["name"] == name) else { continue };
            if let Some(share) = scored["coverage_revisit"].as_f64() {
                self.holds(share == 0.0 || count(run, "pairs_found") > 0, "sees another visit, and has none");
                self.holds(share <= scored["coverage"].as_f64().unwrap(), "a part is larger than the whole");
            }
        }
    }

    fn what_is_thick_was_measured(&self) {
        for run in self.of("runs") {
            let found = &run["thickness"];
            let number = |name: &str| found[name].as_f64().unwrap();
            self.holds(run["coverage"].is_f64() || found.is_null(), "a given map says nothing of the run");
            if found.is_null() {
                continue;
            }
            self.holds(number("cells") >= 30.0 && number("share_flat") <= 1.0, "a thickness without cells");
            self.holds(number("median_m") <= number("p95_m"), "a median above 95 %");
            self.holds(number("within_median_m") <= 1.05 * number("median_m"), "a visit is thicker than all");
            let layers = &found["layers"];
            let [cells, doubled] = ["cells", "doubled"].map(|name| layers[name].as_u64().unwrap());
            self.holds(doubled <= cells && cells as f64 <= number("cells"), "more layers than cells");
            self.holds((doubled > 0) == layers["median_m"].is_f64(), "layers without a distance");
            self.holds((doubled > 0) != layers["places"].as_array().unwrap().is_empty(), "layers nowhere");
            let visits = self.drift_of(run["name"].as_str().unwrap()).map(|run| run["pairs_found"] != 0);
            self.holds(doubled == 0 || visits != Some(false), "two layers of one visit");
        }
    }

    fn terminal_and_page_say_the_same(&self) {
        let answer = without_tags(between(&self.page, "<p class=\"answer\">", "</p>"));
        self.holds(answer == self.sentence(), &answer);
        let order = self.order();
        for (row, name) in self.rows().iter().zip(&order) {
            let line = self.text.lines().find(|line| {
                line.split("  ")
                    .map(str::trim)
                    .filter(|cell| !cell.is_empty())
                    .take(2)
                    .eq([&row[0].1, &row[1].1])
            });
            let cells: Vec<&str> = line.unwrap_or_default().split("  ").map(str::trim).collect();
            let run = self.of("runs").iter().find(|run| run["name"] == **name).unwrap();
            for (head, cell) in row {
                let m = match head.as_str() {
                    "verdict" => None,
                    "apart" => self.pair(order[0], name).map(|pair| {
                        let worst_m = |part: &str| pair["apart"][part]["worst_m"].as_f64().unwrap_or(0.0);
                        worst_m("within").max(worst_m("between"))
                    }),
                    "revisit error" => self.drift_of(name).and_then(|run| run["median_m"]["value"].as_f64()),
                    head if head.starts_with("thick") => run["thickness"]["median_m"].as_f64(),
                    _ => continue,
                };
                self.holds(cells.contains(&cell.as_str()), &format!("{head} {cell} of {name}"));
                let shown =
                    if head.starts_with("thick") { metres(&format!("{cell} cm")) } else { metres(cell) };
                let is_near = shown.zip(m).is_none_or(|(shown, m)| (shown - m).abs() <= 0.06 * m + 6e-4);
                self.holds(is_near, &format!("{head} {cell} of {name}, {m:?}"));
            }
        }
        let warned = without_tags(&self.page);
        for warning in self.text.split("\n\n").filter(|part| part.starts_with("warning: ")) {
            for warning in unwrapped(warning).split("warning: ").filter(|warning| !warning.is_empty()) {
                self.holds(warned.contains(&without_tags(&marked(warning.trim()))), warning);
            }
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

/// As a page writes what HTML has another meaning for.
fn marked(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Checks the report of each command; what they say.
fn check(folder: &Path, commands: &[&str]) -> String {
    let check = |command: &&str| {
        let said = said(folder, command);
        said.check();
        unwrapped(&said.text)
    };
    commands.iter().map(check).collect()
}

/// Makes a log and its wrong trajectories: each with its name.
fn drive(folder: &Path, make: &str, log: &str, errors: &[(&str, &str)]) {
    done(folder, &format!("simulate town -o {log}.mcap --azimuth-steps 240 --rate 2 {make} --quiet"));
    for (name, error) in errors {
        done(folder, &format!("simulate errors {log}.truth.tum {error} -o {log}.{name}.tum --quiet"));
    }
}

const DRIFT: (&str, &str) = ("drift", "--drift-ate 1");
const NOISE: (&str, &str) = ("noise", "--noise 3cm,0.1deg");
const NEAR: (&str, &str) = ("near", "--noise 5mm");

#[test]
fn no_report_of_a_drive_contradicts_itself() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let errors = [DRIFT, NOISE, NEAR, ("lost", "--collapse 0.5"), ("loop", "--false-loop 20")];
    drive(path, "--route loop --scans 100", "a", &errors);
    let rows: Vec<Vec<f64>> = {
        let text = std::fs::read_to_string(path.join("a.truth.tum")).unwrap();
        let rows = text.lines().filter(|line| !line.starts_with('#'));
        rows.map(|line| line.split_whitespace().map(|number| number.parse().unwrap()).collect()).collect()
    };
    let changed = |name: &str, change: &dyn Fn(&mut Vec<f64>)| {
        let mut rows = rows.clone();
        rows.iter_mut().for_each(change);
        write(path, name, &tum(&rows));
    };
    changed("moved.tum", &|row| row[1] += 432_100.25);
    changed("scaled.tum", &|row| row[1..4].iter_mut().for_each(|c| *c *= 1.01));
    changed("late.tum", &|row| row[0] += 0.2);
    changed("hour.tum", &|row| row[0] += 3600.0);
    write(path, "half.tum", &tum(&rows[..rows.len() / 2]));
    let trusted = "score a.mcap --trust";
    let all = check(
        path,
        &[
            &format!(
                "{trusted} -t a.truth.tum -t a.drift.tum -t a.noise.tum -t a.lost.tum -t a.near.tum -t a.loop.tum"
            ),
            &format!("{trusted} -t a.truth.tum -t a.drift.tum -t a.lost.tum"),
            &format!("{trusted} -t a.truth.tum"),
            &format!("{trusted} -t a.lost.tum"),
            &format!("{trusted} -t a.loop.tum"),
            &format!("{trusted} -t a.truth.tum -t moved.tum"),
            &format!("{trusted} -t a.truth.tum -t moved.tum -t a.drift.tum"),
            &format!("{trusted} -t a.truth.tum -t a.near.tum"),
            &format!("{trusted} -t a.truth.tum -t scaled.tum"),
            &format!("{trusted} -t a.truth.tum -t half.tum"),
            &format!("{trusted} -t a.truth.tum -t a.noise.tum --same-within 1m"),
            &format!("{trusted} -t a.drift.tum -t a.lost.tum"),
            &format!("{trusted} -t a.loop.tum -t a.lost.tum"),
            &format!("{trusted} -t a.truth.tum -t a.drift.tum --quick"),
            &format!("{trusted} -t a.truth.tum -t a.drift.tum --drift=none"),
            &format!("{trusted} -t a.truth.tum -t a.drift.tum --confidence 50%"),
            &format!("{trusted} -t a.truth.tum -t a.drift.tum --segment 3m"),
            "score a.mcap -t a.truth.tum -t hour.tum",
            "score a.mcap -t a.truth.tum -t late.tum --mend",
            "score a.mcap -t a.truth.tum -t late.tum",
        ],
    );
    // Every kind of answer is among them.
    for kind in [" is best: ", " are the same: ", " apart", " revisit error", "alone, "] {
        assert!(all.contains(kind), "{kind}");
    }
    for (kept, run) in [("a", "a.truth"), ("b", "moved"), ("c", "a.drift")] {
        done(path, &format!("{trusted} -t {run}.tum --keep {kept}.dmp --quiet"));
    }
    check(path, &["compare a.dmp b.dmp c.dmp", "compare a.dmp b.dmp"]);
    done(path, "map build a.mcap -t a.truth.tum -o good.dmpmap --quiet");
    done(path, "map build a.mcap -t a.noise.tum -o bad.dmpmap --quiet");
    let given = "-t good=a.truth.tum --map good=good.dmpmap";
    check(
        path,
        &[
            &format!("{trusted} {given}"),
            &format!("{trusted} {given} -t bad=a.truth.tum --map bad=bad.dmpmap"),
            &format!("{trusted} {given} -t a.drift.tum"),
        ],
    );
    done(path, &format!("shard plan {} -o work --quiet", "a.mcap -t a.truth.tum -t a.drift.tum --trust"));
    for stage in ["fuse", "merge", "cast", "drift"] {
        done(path, &format!("shard {stage} work --part 1/1 --quiet"));
    }
    write(path, "parts.json", &done(path, "shard reduce work --json --quiet"));
    check(path, &["compare parts.json"]);
}

#[test]
fn nor_does_that_of_traffic_or_of_a_street_without_revisits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    drive(path, "--route out-and-back --scans 80 --company ahead=12m,oncoming", "busy", &[DRIFT, NEAR]);
    drive(path, "--route straight --scans 60", "straight", &[NOISE, DRIFT]);
    drive(path, "--route one-way --scans 24", "short", &[NOISE]);
    drive(path, "--route one-way --scans 60", "turns", &[DRIFT]);
    drive(path, "--route out-and-back --scans 24", "brief", &[DRIFT]);
    let all = check(
        path,
        &[
            "score busy.mcap --trust -t busy.truth.tum -t busy.near.tum -t busy.drift.tum",
            "score busy.mcap --trust -t busy.drift.tum",
            "score straight.mcap --trust -t straight.truth.tum -t straight.noise.tum -t straight.drift.tum",
            "score straight.mcap --trust -t straight.truth.tum",
            "score straight.mcap --trust -t straight.truth.tum -t straight.drift.tum --quick",
            "score short.mcap --trust -t short.truth.tum -t short.noise.tum",
            "score short.mcap --trust -t short.truth.tum",
            "score turns.mcap --trust -t turns.truth.tum -t turns.drift.tum",
            "score brief.mcap --trust -t brief.truth.tum -t brief.drift.tum",
        ],
    );
    has(&all, &["revisits no place", "no point seen on two visits", " cm worse "]);
}

#[test]
fn nor_does_that_of_a_room() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    done(path, "simulate room -o room --size 80x60 --frames 90 --rate 5 --quiet");
    done(path, "simulate room -o once --size 80x60 --frames 60 --rate 10 --once --quiet");
    let estimates = ["good", "another", "odometry", "off", "false_loop"];
    let all: String = estimates.iter().map(|name| format!(" -t room/estimates/{name}.txt")).collect();
    check(
        path,
        &[
            &format!("score room --trust {all}"),
            "score room --trust -t room/groundtruth.txt",
            "score room --trust -t room/estimates/good.txt -t room/estimates/another.txt",
            "score once --trust -t once/groundtruth.txt -t once/estimates/odometry.txt",
        ],
    );
}
