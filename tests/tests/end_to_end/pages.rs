//! Every kind of page in a real browser: its parts by role and name, nothing covered, cut off or empty, and what its scripts do.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::browser::{Browser, Theme};
use crate::common::{TWO, dmp, dmp_command, done, ends, has, json, once, sample, sample_rows, tum, write};

/// As narrow as a telephone and as wide as a screen.
const WINDOWS: [(u32, Theme); 4] =
    [(1280, Theme::Light), (390, Theme::Dark), (1280, Theme::Dark), (390, Theme::Light)];

/// A page and parts that it must have.
struct Shown {
    path: PathBuf,
    named: &'static [(&'static str, &'static str)],
    /// Whether it has what a reader explores: tables that are sorted, runs to switch off, maps.
    is_explored: bool,
}

/// Looks at a page in these windows: all of it is there and sound, and answers when it is explored.
fn assert_sound(browser: &Browser, shown: &Shown, windows: &[(u32, Theme)]) {
    for &(width_px, theme) in windows {
        let page = browser.open(&shown.path, width_px, theme);
        for (role, name) in shown.named {
            assert!(
                page.has(role, name),
                "{} {width_px} {theme:?}: no {role} `{name}`",
                shown.path.display()
            );
        }
        let colours = page.ground();
        let red: u32 = colours.split(['(', ',']).nth(1).unwrap().parse().unwrap();
        assert_eq!(red > 200, theme == Theme::Light, "{colours}");
        page.unfold();
        page.assert_sound();
        if shown.is_explored {
            assert_answers(&page.evaluate(include_str!("browser/explored.js")));
        }
        assert!(page.requests().is_empty() && page.errors().is_empty(), "{:?}", page.errors());
    }
}

/// What exploring a page found.
fn assert_answers(found: &Value) {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let sort = &found["sort"];
    assert_eq!(sort["sorted"], "descending", "{sort}");
    assert!(sort["rows"][0].as_u64() >= Some(2) && sort["rows"][0] == sort["rows"][1], "{sort}");
    let [mut up, down] = [&sort["up"], &sort["down"]].map(list);
    // Equal cells keep their order.
    let is_reversed = up.iter().zip(down.iter().rev()).all(|(a, b)| a == b);
    up.dedup();
    assert!(is_reversed || up.len() < down.len(), "{sort}");

    let toggles = list(&found["toggles"]);
    assert!(!toggles.is_empty());
    for run in toggles {
        assert!(run[0].as_u64() > Some(0) && run[1] == 0 && run[2] == run[0], "before, off, on: {run}");
    }

    let pictures = list(&found["pictures"]);
    for kind in ["map", "way", "plot"] {
        assert!(pictures.iter().any(|picture| picture["is"] == kind), "no {kind}: {found}");
    }
    for picture in pictures {
        let number = |key: &str| picture[key].as_f64().unwrap();
        assert!((number("zoom") - 1.5).abs() < 1e-3 && number("moved") > 0.0, "{picture}");
        assert!(picture["back"] == true, "{picture}");
        let pointed = picture["pointed"].as_str().unwrap();
        match picture["is"].as_str().unwrap() {
            "map" => assert!(pointed.starts_with("x ") && pointed.contains(" m, y "), "{picture}"),
            "way" => assert!(pointed.contains(": scan "), "{picture}"),
            "plot" => assert!(pointed.split(", ").all(|value| value.parse::<f64>().is_ok()), "{picture}"),
            _ => {}
        }
    }

    assert!(found["jump"].as_f64() > Some(1.0) && found["bands"].as_u64() > Some(0), "{found}");
    let turned = &found["turned"];
    assert!(turned["drawn"].as_u64() > Some(500) && turned["moved"] == true, "{turned}");
}

/// The pages of `dmp score`, `dmp truth` and `dmp suite`.
fn pages(folder: &Path) -> Vec<Shown> {
    let report = Shown {
        path: crate::report::sample_page().join("report.html"),
        named: &[
            ("heading", "Which map of town.mcap is best?"),
            ("region", "Verdict"),
            ("region", "Pairs"),
            ("rowheader", "collapsed"),
            ("region", "Drift "),
            ("navigation", "Contents"),
            ("region", "All trajectories"),
            ("image", "Trajectories of all runs from above"),
            ("region", "Where: residuals from above"),
            ("image", "Map of collapsed from above, coloured by residual"),
            ("region", "Where the best two differ"),
            ("region", "The maps in three dimensions"),
            ("image", "Map of truth in three dimensions"),
            ("combobox", "Run"),
            ("region", "When, and how much"),
            ("image", "R_cv at 2 m over time"),
            ("region", "Worst places"),
            ("image", "Place 1 of truth from above"),
            ("image", "Place 1 of truth from the side"),
            ("region", "Inputs and settings"),
            ("heading", "The settings"),
            ("button", "Data as JSON"),
            ("button", "CSV"),
        ],
        is_explored: true,
    };
    // A name that would be an element.
    let nasty = "a <b>long & bad name of a run that goes on and on.tum";
    fs::copy(sample("drift.tum"), folder.join(nasty)).unwrap();
    fs::copy(sample("noise.tum"), folder.join("noise.tum")).unwrap();
    let mut several = dmp_command(folder, "truth ape @/truth.tum");
    let output = several.args([nasty, "noise.tum", "-a", "--plot", "plots.html"]).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let plots = Shown {
        path: folder.join("plots.html"),
        named: &[
            ("region", "Result"),
            ("columnheader", "rmse"),
            ("image", "from above, coloured by error"),
            ("image", "from the side, coloured by error"),
            ("image", "over time"),
            ("region", "What was compared"),
            ("region", "All runs"),
            ("heading", "a <b>long & bad name"),
        ],
        is_explored: false,
    };
    let suite =
        crate::suite::suite(&[("a", ""), ("2024-03-11 <b>the long drive past the harbour & back", "")], "");
    done(suite.path(), "suite s.toml --quiet --report suite.html");
    fs::copy(suite.path().join("suite.html"), folder.join("suite.html")).unwrap();
    let suite = Shown {
        path: folder.join("suite.html"),
        named: &[
            ("heading", "bad or good: which makes the better maps?"),
            ("region", "Verdict"),
            ("region", "Over all logs"),
            ("columnheader", "first better"),
            ("region", "Every log, worst first"),
            ("columnheader", "bad / good"),
            ("StaticText", "<b>the long drive past the harbour"),
            ("region", "What was scored"),
        ],
        is_explored: false,
    };
    once("score @/town.mcap -t @/truth.tum --voxel 0.5 --residuals returns.laz --json --quiet")
        .copy("returns.laz", folder);
    done(folder, "map check returns.laz --report check.html --quiet");
    let check = Shown {
        path: folder.join("check.html"),
        named: &[
            ("heading", "How good is returns.laz?"),
            ("region", "What was found"),
            ("image", "The map from above"),
            ("region", "What this does not show"),
        ],
        is_explored: false,
    };
    vec![report, plots, suite, check]
}

#[test]
fn every_kind_of_page_is_sound() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    for shown in pages(folder.path()) {
        assert_sound(&browser, &shown, &WINDOWS[..1]);
    }
}

#[test]
#[ignore = "nightly: nine pages in four windows"]
fn every_page_is_sound_in_every_window() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for shown in pages(path) {
        assert_sound(&browser, &shown, &WINDOWS);
    }
    // Poses without stamps, pairs and angles.
    for name in ["truth", "drift"] {
        done(path, &format!("convert trajectory @/{name}.tum -o {name}.txt --to kitti"));
        fs::remove_file(path.join("times.txt")).unwrap();
    }
    for (k, truth) in [
        "truth rpe @/truth.tum @/drift.tum -d 10 -u m -r angle_deg",
        "truth ape kitti truth.txt drift.txt -r full",
    ]
    .into_iter()
    .enumerate()
    {
        done(path, &format!("{truth} --plot plot{k}.html"));
        let named = &[("region", "Result"), ("image", "over path")];
        let shown = Shown { path: path.join(format!("plot{k}.html")), named, is_explored: false };
        assert_sound(&browser, &shown, &WINDOWS);
    }
    let explored = |command: &str, named: &'static [(&'static str, &'static str)]| {
        dmp(path, &format!("{command} --report report.html --quiet"));
        assert_sound(&browser, &Shown { path: path.join("report.html"), named, is_explored: true }, &WINDOWS);
        fs::read_to_string(path.join("report.html")).unwrap()
    };
    explored(TWO, &[("image", "Map of drift from above, coloured by residual")]);
    // Many runs.
    let mut runs = String::new();
    for run in 0..12 {
        let mut rows = sample_rows("truth.tum");
        let turn = 2e-4 * f64::from(run);
        for (k, row) in rows.iter_mut().enumerate() {
            row[1] += turn * k as f64;
            row[2] += 3.0 * turn * (0.3 * k as f64).sin();
        }
        write(path, &format!("run{run}.tum"), &tum(&rows));
        runs += &format!(" -t run{run}.tum");
    }
    let named = &[("rowheader", "run11"), ("image", "Map of run0 in three dimensions")];
    assert!(explored(&format!("score @/town.mcap{runs}"), named).len() < 5_000_000);
    // A run that flies off, and one that is excluded: it is of another place.
    let mut rows = sample_rows("truth.tum");
    let half = rows.len() / 2;
    rows.iter_mut().enumerate().skip(half).for_each(|(k, row)| row[1] += 1e3 * (k - half) as f64);
    write(path, "flown.tum", &tum(&rows));
    explored("score @/town.mcap -t @/truth.tum -t flown.tum", &[("rowheader", "flown")]);
    let rows = sample_rows("truth.tum");
    let reversed = rows.iter().zip(rows.iter().rev()).map(|(row, other)| [&row[..1], &other[1..]].concat());
    write(path, "other.tum", &tum(&reversed.collect::<Vec<_>>()));
    let others = "score @/town.mcap -t @/truth.tum -t @/drift.tum -t other.tum";
    explored(others, &[("region", "warning"), ("rowheader", "drift")]);
    // A room: nothing in it drives.
    let room = once("simulate room -o room --size 80x60 --frames 40 --rate 2 -q").folder.join("room");
    let [truth, odometry] = ["groundtruth.txt", "estimates/odometry.txt"].map(|name| room.join(name));
    let score =
        format!("score {} -t {} -t {} --voxel 0.1", room.display(), truth.display(), odometry.display());
    let page = explored(
        &score,
        &[("image", "R_cv at 0.2 m over time"), ("image", "Place 1 of odometry from above")],
    );
    let words = page.split("<script").next().unwrap_or_default().to_lowercase();
    for word in [" drive ", "vehicle", "street"] {
        let sentence = words.lines().find(|line| line.contains(word));
        assert_eq!(sentence.map(|line| line.split(word).next()), None, "a room has no {word}");
    }
    done(path, &format!("{score} --scene room.mcap"));
}

/// Where scripts do not run, and where they do and WebGL is not there.
#[test]
#[ignore = "nightly: two further pages in a browser"]
fn where_nothing_turns_the_map_is_a_picture() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = fs::read_to_string(crate::report::sample_page().join("report.html")).unwrap();
    let (still, scripts) = page.split_once("<script>").unwrap();
    let without_webgl = "const context = HTMLCanvasElement.prototype.getContext; \
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) { \
        return kind.startsWith('webgl') ? null : context.call(this, kind, ...more); };";
    // The page lets no scripts run but its own.
    let lenient = still.replace("Content-Security-Policy", "");
    for (name, page, has_scripts) in [
        ("still.html", still.to_owned(), false),
        ("flat.html", format!("{lenient}<script>{without_webgl}</script><script>{scripts}"), true),
    ] {
        let page = browser.open(&write(folder.path(), name, &page), 1280, Theme::Light);
        assert!(page.has("image", "Map of truth from the south-west and above"), "{name}");
        assert_eq!(page.evaluate("document.querySelectorAll('.turned, canvas').length"), 0, "{name}");
        assert_eq!(page.evaluate("document.querySelectorAll('button').length > 0"), has_scripts, "{name}");
        page.unfold();
        page.assert_sound();
        assert!(page.errors().is_empty(), "{name}: {:?}", page.errors());
    }
}

/// The picture of `dmp truth` has no page around it: it is put into one.
#[test]
fn pages_and_pictures_of_dmp_truth_have_the_numbers_of_the_json() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for command in
        ["truth ape @/truth.tum @/drift.tum -a", "truth rpe @/truth.tum @/drift.tum -d 5 -u m --all_pairs"]
    {
        let stats = json(path, command)["stats"].clone();
        for file in ["run.html", "again.html", "run.svg"] {
            done(path, &format!("{command} --plot {file}"));
        }
        let [page, again, picture] =
            ["run.html", "again.html", "run.svg"].map(|file| fs::read_to_string(path.join(file)).unwrap());
        assert_eq!(page, again, "the same bytes");
        for name in ["rmse", "mean", "median", "std", "min", "max", "sse"] {
            let value = format!(">{:.6}<", stats[name].as_f64().unwrap());
            has(&page, &[&value]);
            has(&picture, &[&value]);
        }
        for outside in ["https:", "<script", "src=", "@import", "url("] {
            assert!(!page.contains(outside) && !picture.contains(outside), "{outside}");
        }
    }
    ends(path, "truth ape @/truth.tum @/drift.tum --plot a.pdf", 2);
    let Some(browser) = Browser::start() else { return };
    let picture = fs::read_to_string(path.join("run.svg")).unwrap();
    let head =
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>runs</title></head><body>";
    let page = write(path, "framed.html", &format!("{head}{picture}</body></html>"));
    browser.open(&page, 1700, Theme::Light).assert_sound();
}
