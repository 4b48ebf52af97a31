//! The page of `--report` in a browser: worst places lead to the map, to its third dimension and to their time; and pages of
//! few runs, of many, of a room and of runs that are broken.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::browser::{Browser, Page, Theme};
use crate::common::{dmp, text, workspace, write};

fn page_of(folder: &Path, command: &str, code: i32) -> String {
    let output = dmp(folder, &format!("{command} --report report.html --quiet"));
    assert_eq!(output.status.code(), Some(code), "{command}: {}", text(&output.stderr));
    std::fs::read_to_string(folder.join("report.html")).unwrap()
}

/// The rows of the sample's truth.
fn truth() -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(workspace().join("data-samples/truth.tum")).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    rows.map(|line| line.split_whitespace().map(|number| number.parse().unwrap()).collect()).collect()
}

fn tum(rows: &[Vec<f64>]) -> String {
    rows.iter().fold(String::new(), |mut tum, row| {
        let rest: Vec<String> = row[1..].iter().map(f64::to_string).collect();
        writeln!(tum, "{:.9} {}", row[0], rest.join(" ")).unwrap();
        tum
    })
}

/// Does what a reader does who presses a key on the map in three dimensions, and tells how many of its pixels are drawn.
fn press(page: &Page<'_>, key: &str) -> u64 {
    let drawn = page.evaluate(&format!(
        "(async () => {{ const canvas = document.querySelector('.turned canvas'); canvas.focus(); \
         canvas.dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}' }})); \
         await new Promise((done) => requestAnimationFrame(done)); \
         const copy = document.createElement('canvas'); [copy.width, copy.height] = [canvas.width, canvas.height]; \
         const plane = copy.getContext('2d'); plane.drawImage(canvas, 0, 0); \
         const pixels = plane.getImageData(0, 0, copy.width, copy.height).data; \
         let drawn = 0; for (let k = 3; k < pixels.length; k += 4) if (pixels[k] > 0) drawn += 1; return drawn; }})()"
    ));
    drawn.as_u64().unwrap()
}

#[test]
fn a_map_is_turned_in_three_dimensions() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    page_of(folder.path(), "score @/town.mcap -t @/truth.tum -t @/drift.tum", 0);
    let page = browser.open(&folder.path().join("report.html"), 1280, Theme::Light);
    let marks =
        || page.evaluate("[...document.querySelectorAll('.turned a')].map(mark => mark.style.left).join()");
    let label = || page.evaluate("document.querySelector('.turned canvas').getAttribute('aria-label')");
    let home = press(&page, "0");
    let before = marks();
    assert!(home > 3000, "{home} pixels are drawn");
    assert_eq!(label(), "Map of truth in three dimensions");
    press(&page, "ArrowLeft");
    assert_ne!(before, marks(), "the marks turn with the map");
    let nearer = [(); 3].map(|()| press(&page, "+"))[2];
    assert!(nearer > home, "{home} pixels, nearer {nearer}");
    assert_eq!(press(&page, "0"), home);
    assert_eq!(before, marks());

    // What lies higher is hidden.
    page.evaluate("document.querySelector('figure.cloud input').value = 0");
    assert!(press(&page, "0") < home / 20);
    page.evaluate("document.querySelector('figure.cloud input').value = 1000");

    // Another run, by choice and from one of its places.
    let choose = "const chosen = document.querySelector('figure.cloud select'); chosen.value = '1'; \
                  chosen.dispatchEvent(new Event('change'))";
    page.evaluate(&format!("(() => {{ {choose}; }})()"));
    assert_eq!(label(), "Map of drift in three dimensions");
    page.evaluate("document.querySelector('a[data-cloud=\"0 1\"]').click()");
    assert_eq!(label(), "Map of truth in three dimensions");
    press(&page, "Shift");
    // The place is in the middle.
    let middle = page
        .evaluate("['left', 'top'].map(side => parseFloat(document.querySelector('.turned a').style[side]))");
    assert_eq!(middle, json!([50, 50]));
    assert!(page.errors().is_empty() && page.requests().is_empty(), "{:?}", page.errors());
}

#[test]
fn where_nothing_turns_the_map_is_a_picture() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = page_of(folder.path(), "score @/town.mcap -t @/truth.tum -t @/drift.tum", 0);
    let (still, scripts) = page.split_once("<script>").unwrap();
    assert!(scripts.starts_with("\"use strict\""), "the scripts come last");
    let without_webgl = "const context = HTMLCanvasElement.prototype.getContext; \
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) { \
        return kind.startsWith('webgl') ? null : context.call(this, kind, ...more); };";
    // The page lets no scripts run but its own.
    let lenient = still.replace("Content-Security-Policy", "");
    // As it is where scripts do not run, and where they do and WebGL is not there.
    for (name, page, has_scripts) in [
        ("still.html", still.to_owned(), false),
        ("flat.html", format!("{lenient}<script>{without_webgl}</script><script>{scripts}"), true),
    ] {
        std::fs::write(folder.path().join(name), page).unwrap();
        let page = browser.open(&folder.path().join(name), 1280, Theme::Light);
        assert!(page.has("image", "Map of truth from the south-west and above"), "{name}");
        assert_eq!(page.evaluate("document.querySelectorAll('.turned, canvas').length"), 0, "{name}");
        assert_eq!(page.evaluate("document.querySelectorAll('button').length > 0"), has_scripts, "{name}");
        page.evaluate("document.querySelector('a[data-cloud]').click()");
        page.unfold();
        page.assert_sound();
        assert!(page.errors().is_empty(), "{name}: {:?}", page.errors());
    }
}

#[test]
fn worst_places_lead_to_the_map_and_to_their_time() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    page_of(folder.path(), "score @/town.mcap -t @/truth.tum -t @/drift.tum", 0);
    let page = browser.open(&folder.path().join("report.html"), 1280, Theme::Light);
    let number = |expression: &str| page.evaluate(expression).as_f64().unwrap();
    // The window shown around the mark of the place.
    page.evaluate("document.querySelector('a[data-at][href=\"#map-1\"]').click()");
    let off = |axis: usize, side: &str| {
        number(&format!(
            "(() => {{ const map = document.querySelector('#map-1'); const view = map.viewBox.baseVal; \
             const mark = map.querySelector('a[href=\"#place-1-1\"]').parentElement.transform.baseVal[0].matrix; \
             return Math.abs([mark.e, mark.f][{axis}] - view.{} - view.{side} / 2) / view.{side}; }})()",
            ["x", "y"][axis]
        ))
    };
    assert!(off(0, "width") < 0.02 && off(1, "height") < 0.02, "{} {}", off(0, "width"), off(1, "height"));
    assert!(number("document.querySelector('#map-1').viewBox.baseVal.width") < 300.0);
    // Its time: a band where the plot has it.
    page.evaluate("document.querySelector('#place-1-1').parentElement.querySelector('a[data-span]').click()");
    let width_px = number("document.querySelector('#over-time .span').getBBox().width");
    assert!((2.0..240.0).contains(&width_px), "{width_px}");
    // From the map to a place that is folded up.
    page.evaluate("document.querySelector('#place-1-1').closest('details').open = false");
    page.evaluate("location.hash = '#place-1-1'");
    let is_open = "new Promise(done => setTimeout(() => done(document.querySelector('#place-1-1').closest('details').open), 50))";
    assert_eq!(page.evaluate(is_open), true);
    assert!(page.errors().is_empty(), "{:?}", page.errors());
}

/// Opens the page as narrow as a telephone and as wide as a screen, light and dark: all of it is there and sound, and
/// answers when it is explored.
fn assert_sound(browser: &Browser, folder: &Path, named: &[(&str, &str)]) {
    for (width_px, theme) in
        [(1280, Theme::Light), (1280, Theme::Dark), (390, Theme::Light), (390, Theme::Dark)]
    {
        let page = browser.open(&folder.join("report.html"), width_px, theme);
        for (role, name) in named {
            assert!(page.has(role, name), "{width_px} {theme:?}: no {role} `{name}`");
        }
        page.unfold();
        page.assert_sound();
        assert_answers(&page.evaluate(include_str!("browser/explored.js")));
        assert!(page.requests().is_empty() && page.errors().is_empty(), "{:?}", page.errors());
    }
}

/// What came of exploring a page.
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
        let told = picture["told"].as_str().unwrap();
        match picture["is"].as_str().unwrap() {
            "map" => assert!(told.starts_with("x ") && told.contains(" m, y "), "{picture}"),
            "way" => assert!(told.contains(": scan "), "{picture}"),
            "plot" => assert!(told.split(", ").all(|value| value.parse::<f64>().is_ok()), "{picture}"),
            _ => {}
        }
    }

    assert!(found["jump"].as_f64() > Some(1.0) && found["bands"].as_u64() > Some(0), "{found}");
    let turned = &found["turned"];
    assert!(turned["drawn"].as_u64() > Some(500) && turned["moved"] == true, "{turned}");
}

#[test]
fn pages_of_two_runs_and_of_twelve_are_sound() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    page_of(folder.path(), "score @/town.mcap -t @/truth.tum -t @/drift.tum", 0);
    assert_sound(&browser, folder.path(), &[("image", "Map of drift from above, coloured by residual")]);

    let mut runs = String::new();
    for run in 0..12 {
        let mut rows = truth();
        let turn = 2e-4 * f64::from(run);
        for (k, row) in rows.iter_mut().enumerate() {
            row[1] += turn * k as f64;
            row[2] += 3.0 * turn * (0.3 * k as f64).sin();
        }
        write(folder.path(), &format!("run{run}.tum"), &tum(&rows));
        write!(runs, " -t run{run}.tum").unwrap();
    }
    let page = page_of(folder.path(), &format!("score @/town.mcap{runs}"), 0);
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
    assert!(page.contains("The best 6 runs; 6 more are not drawn."));
    assert_sound(
        &browser,
        folder.path(),
        &[("rowheader", "run11"), ("image", "Map of run0 in three dimensions")],
    );
}

#[test]
fn a_room_is_drawn() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let made = dmp(folder.path(), "simulate room -o room --size 80x60 --frames 40 --rate 2 -q");
    assert_eq!(made.status.code(), Some(0), "{}", text(&made.stderr));
    let runs = "-t room/groundtruth.txt -t room/estimates/odometry.txt";
    let page = page_of(folder.path(), &format!("score room {runs} --voxel 0.1"), 0);
    assert!(page.contains("at 0.05 and 0.2 m)") && page.contains("returns predicted to 1 cm"));
    let named = [
        ("image", "Map of groundtruth from above, coloured by residual"),
        ("image", "R_cv at 0.2 m over time"),
        ("image", "Place 1 of odometry from above"),
        ("image", "Map of groundtruth in three dimensions"),
    ];
    assert_sound(&browser, folder.path(), &named);
    // Nothing in it drives, and lengths are told to a centimetre.
    let page = browser.open(&folder.path().join("report.html"), 1280, Theme::Light);
    page.unfold();
    let words = page.evaluate("document.body.innerText.toLowerCase()").as_str().unwrap().to_owned();
    assert!(!["drive", "vehicle", "street"].iter().any(|word| words.contains(word)), "{words}");
    assert!(words.contains("other parts of the recording") && words.contains("14 segments of 3 scans"));
    let told = |svg: &str| {
        let told = page.evaluate(&format!(
            "(() => {{ const svg = document.querySelector('{svg}'); const box = svg.getBoundingClientRect(); \
             svg.dispatchEvent(new PointerEvent('pointermove', {{ clientX: box.left + box.width / 2, \
             clientY: box.top + box.height / 2 }})); return svg.nextElementSibling.textContent; }})()"
        ));
        told.as_str().unwrap().to_owned()
    };
    let decimals = |text: &str, of: &str| {
        let number = text.split(of).nth(1).unwrap().trim_start().split(' ').next().unwrap().to_owned();
        number.split_once('.').map_or(0, |(_, decimals)| decimals.len())
    };
    let place = told("#map-0");
    assert_eq!([" x", ", y"].map(|axis| decimals(&format!(" {place}"), axis)), [2, 2], "{place}");
    let line = "document.querySelector('polyline[data-scans]').dataset.scans.split(';')[7]";
    let scan = page.evaluate(line).as_str().unwrap().to_owned();
    assert_eq!(decimals(&scan, " s,"), 2, "{scan}");
    drop(page);

    let scene = dmp(folder.path(), &format!("score room {runs} --voxel 0.1 --scene room.mcap"));
    assert_eq!(scene.status.code(), Some(0), "{}", text(&scene.stderr));
    assert!(text(&scene.stderr).contains(" surfels and "), "{}", text(&scene.stderr));
}

/// A run that flies off, and one that is left out as it is of another place.
#[test]
fn broken_runs_do_not_break_the_page() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut rows = truth();
    let half = rows.len() / 2;
    for (k, row) in rows.iter_mut().enumerate().skip(half) {
        row[1] += 1e3 * (k - half) as f64;
    }
    write(folder.path(), "flown.tum", &tum(&rows));
    let page = page_of(folder.path(), "score @/town.mcap -t @/truth.tum -t flown.tum", 0);
    assert!(page.contains("truth") && page.contains("flown"));
    assert_sound(&browser, folder.path(), &[("rowheader", "flown"), ("region", "Worst places")]);

    let reversed: Vec<Vec<f64>> = truth()
        .iter()
        .zip(truth().iter().rev())
        .map(|(row, other)| [&row[..1], &other[1..]].concat())
        .collect();
    write(folder.path(), "other.tum", &tum(&reversed));
    let output = dmp(
        folder.path(),
        "score @/town.mcap -t @/truth.tum -t @/drift.tum -t other.tum --report report.html -q",
    );
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("other"), "{}", text(&output.stderr));
    assert_sound(&browser, folder.path(), &[("region", "Warnings"), ("rowheader", "drift")]);
}
