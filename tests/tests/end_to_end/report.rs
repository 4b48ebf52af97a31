//! The page of `--report`: what it names, and how it looks in a browser.

use std::fmt::Write as _;
use std::path::Path;

use crate::browser::{Browser, Theme, pixels};
use crate::common::{dmp, refused, text, workspace, write};

const ALL: &str = "-t @/truth.tum -t @/drift.tum -t @/noise.tum -t @/collapsed.tum";

/// The page that a command writes to `report.html` of the folder.
fn page_of(folder: &Path, command: &str) -> String {
    let output = dmp(folder, &format!("{command} --report report.html --quiet"));
    assert_eq!(output.status.code(), Some(0), "{command}: {}", text(&output.stderr));
    std::fs::read_to_string(folder.join("report.html")).unwrap()
}

/// The truth of the sample town with `length_m` of its way, from `start_m` on, `offset_m` to the left, and when that is:
/// seconds after the first scan.
fn damaged(start_m: f64, length_m: f64, offset_m: f64) -> (String, [f64; 2]) {
    let truth = std::fs::read_to_string(workspace().join("data-samples/truth.tum")).unwrap();
    let rows: Vec<Vec<f64>> = truth
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split_whitespace().map(|number| number.parse().unwrap()).collect())
        .collect();
    let (mut tum, mut travel_m, mut when_s) = (String::new(), 0.0, Vec::new());
    for (k, row) in rows.iter().enumerate() {
        let [before, after] = [k.saturating_sub(1), (k + 1).min(rows.len() - 1)].map(|k| &rows[k]);
        let step_m = ((row[1] - before[1]).powi(2) + (row[2] - before[2]).powi(2)).sqrt();
        travel_m += step_m;
        // Five metres to leave the way and five to come back to it.
        let share = ((travel_m - start_m) / 5.0).min((start_m + length_m - travel_m) / 5.0).clamp(0.0, 1.0);
        let (dx, dy) = (after[1] - before[1], after[2] - before[2]);
        let norm = dx.hypot(dy).max(1e-9);
        if share > 0.0 {
            when_s.push(row[0] - rows[0][0]);
        }
        let (x, y) = (row[1] - offset_m * share * dy / norm, row[2] + offset_m * share * dx / norm);
        let rest: Vec<String> = row[3..].iter().map(f64::to_string).collect();
        writeln!(tum, "{:.9} {x} {y} {}", row[0], rest.join(" ")).unwrap();
    }
    (tum, [when_s[0], when_s[when_s.len() - 1]])
}

/// When the sensor is at the worst place of a run: seconds of its first pass, the worst.
fn worst_s(page: &str, run: usize) -> [f64; 2] {
    let heading = page.split(&format!("<h3 id=\"place-{run}-1\">1. ")).nth(1).unwrap();
    let clocks = heading.split(" (").next().unwrap();
    let seconds = |clock: &str| {
        let (minutes, seconds) = clock.split_once(':').unwrap();
        60.0 * minutes.parse::<f64>().unwrap() + seconds.parse::<f64>().unwrap()
    };
    let (from, to) = clocks.split_once(" to ").unwrap_or((clocks, clocks));
    [seconds(from), seconds(to)]
}

#[test]
fn forty_metres_that_are_half_a_metre_off_are_named_first() {
    let folder = tempfile::tempdir().unwrap();
    for start_m in (0..=160).step_by(20) {
        let (tum, when_s) = damaged(f64::from(start_m), 40.0, 0.5);
        write(folder.path(), "damaged.tum", &tum);
        for (runs, run) in [("-t damaged.tum", 0), ("-t @/truth.tum -t damaged.tum", 1)] {
            let page = page_of(folder.path(), &format!("score @/town.mcap {runs}"));
            let [from_s, to_s] = worst_s(&page, run);
            let middle_s = f64::midpoint(from_s, to_s);
            assert!(
                (when_s[0]..=when_s[1]).contains(&middle_s),
                "{runs}, from {start_m} m: {from_s} to {to_s} s, but it is off from {} to {} s",
                when_s[0],
                when_s[1]
            );
        }
    }
}

/// A run that is taken to be true: where it was displaced another run is better, and a true one loses nowhere.
#[test]
fn a_reference_is_told_where_it_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let (tum, when_s) = damaged(60.0, 40.0, 0.5);
    write(folder.path(), "damaged.tum", &tum);
    let section = |reference: &str, runs: &str| {
        let page = page_of(folder.path(), &format!("score @/town.mcap {runs} --reference {reference}"));
        page.split("<h2 id=\"reference\">").nth(1).unwrap().split("</section>").next().unwrap().to_owned()
    };
    let wrong = section("damaged", "-t damaged.tum -t @/truth.tum");
    let first = wrong.split("<a href=\"#place-0-1\">").nth(1).unwrap();
    let minutes =
        first.split([' ', ':']).take(2).map(|text| text.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let from_s = 60.0 * minutes[0] + minutes[1];
    assert!((when_s[0] - 5.0..=when_s[1]).contains(&from_s), "{from_s} s, off from {when_s:?}");
    assert!(first.contains(", truth by "), "{first}");
    // Against itself with a little noise the truth is worse nowhere.
    let right = section("truth", "-t @/truth.tum -t @/noise.tum");
    assert!(right.contains("Nowhere is another run clearly better."), "{right}");
    let score = "score @/town.mcap -t @/truth.tum";
    refused(folder.path(), &format!("{score} --report a.html --reference b"), 2, &["--reference b", "truth"]);
    assert_eq!(dmp(folder.path(), &format!("{score} --reference truth")).status.code(), Some(2));
}

#[test]
fn the_same_command_writes_the_same_page() {
    let folder = tempfile::tempdir().unwrap();
    // The effort is what a machine makes of it, and stands at the end.
    let found = |threads: usize| {
        let page =
            page_of(folder.path(), &format!("score @/town.mcap {ALL} --threads {threads} --memory 300MiB"));
        let (found, effort) = page.split_once("<h3>The effort</h3>").unwrap();
        assert!(effort.contains("thread"));
        found.to_owned()
    };
    let one = found(1);
    assert!(one == found(4));
    assert!(one.len() < 5_000_000, "{}", one.len());
}

#[test]
fn pages_are_written_of_samples_maps_and_saved_results() {
    let folder = tempfile::tempdir().unwrap();
    let two = "score @/town.mcap -t @/truth.tum -t @/drift.tum";
    let sampled = page_of(folder.path(), &format!("{two} --sample 28 --seed 3"));
    assert!(sampled.contains("28 scans of 100, seed 3"));
    assert!(sampled.contains("Worst places of drift"));

    let quick = page_of(folder.path(), &format!("{two} --quick=100%"));
    assert!(quick.contains("makes a map for each place") && !quick.contains("<figure"));

    let output = dmp(folder.path(), &format!("{two} --save-maps maps --quiet"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let given = page_of(folder.path(), &format!("{two} --map maps/truth.dmpmap"));
    assert!(given.contains("(R_near at 0.5 and 2 m)") && !given.contains("(R_cv at"));

    let json = dmp(folder.path(), &format!("{two} --json --quiet")).stdout;
    std::fs::write(folder.path().join("a.json"), json).unwrap();
    let page = page_of(folder.path(), "compare a.json");
    assert!(page.contains("<strong>truth</strong> is better than <strong>drift</strong> by "));
    assert!(page.contains("saved results, which hold no maps"));
}

#[test]
fn a_failed_gate_stands_on_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let command =
        "score @/town.mcap -t @/truth.tum -t @/drift.tum --quiet --expect-best drift --report a.html";
    assert_eq!(dmp(folder.path(), command).status.code(), Some(4));
    let page = std::fs::read_to_string(folder.path().join("a.html")).unwrap();
    assert!(page.contains("Gate failed: drift: worse than truth, at R_cv 10 m"));
}

#[test]
fn what_cannot_be_written_is_told_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let score = "score no-such.mcap -t @/truth.tum";
    refused(folder.path(), &format!("{score} --report a.pdf"), 2, &["a.pdf", "a report is written as .html"]);
    refused(
        folder.path(),
        &format!("{score} --report no/a.html"),
        2,
        &["no/a.html", "there is no folder no"],
    );
    write(folder.path(), "a.json", "{}");
    refused(folder.path(), "compare a.json --report a.txt", 2, &["a.txt", ".html"]);
}

/// The parts by role and text, at two widths, light and dark; nothing covered, cut off or empty.
#[test]
fn a_browser_shows_every_part() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    page_of(folder.path(), &format!("score @/town.mcap {ALL}"));
    let path = folder.path().join("report.html");
    let mut backgrounds = Vec::new();
    for (width_px, theme) in
        [(1280, Theme::Light), (1280, Theme::Dark), (390, Theme::Light), (390, Theme::Dark)]
    {
        let page = browser.open(&path, width_px, theme);
        for (role, name) in [
            ("heading", "Which map of town.mcap is best?"),
            ("region", "Verdict"),
            ("region", "Ranking"),
            ("rowheader", "collapsed"),
            ("region", "Drift where the drive comes back"),
            ("image", "Way of truth from above, with drift"),
            ("image", "Way of collapsed from above, with drift"),
            ("navigation", "Contents"),
            ("region", "All trajectories"),
            ("image", "Trajectories of all runs from above"),
            ("image", "Height over way"),
            ("image", "R_cv at 2 m over the way"),
            ("region", "Where: residuals from above"),
            ("image", "Map of truth from above, coloured by residual"),
            ("image", "Map of collapsed from above, coloured by residual"),
            ("region", "Where the best two differ"),
            ("image", "Map from above of where truth and"),
            ("region", "The maps in three dimensions"),
            ("image", "Map of truth in three dimensions"),
            ("combobox", "Run"),
            ("region", "What the maps can tell"),
            ("image", "Map of truth from above, coloured by what predicts the returns"),
            ("region", "When, and how much"),
            ("image", "R_cv at 2 m over time"),
            ("image", "How many returns have which residual"),
            ("region", "Worst places"),
            ("image", "Place 1 of truth from above"),
            ("image", "Place 1 of truth from the side"),
            ("region", "What went in"),
            ("heading", "The settings"),
        ] {
            assert!(page.has(role, name), "{width_px} {theme:?}: no {role} `{name}`");
        }
        assert!(
            page.text().contains("truth is best: better than noise, drift and collapsed."),
            "{}",
            page.text()
        );
        let (shot, smaller) = page.screenshot();
        page.unfold();
        page.assert_sound();
        assert!(page.requests().is_empty(), "{:?}", page.requests());
        let (width, height, rgb) = pixels(&shot);
        assert_eq!(width * smaller, width_px as usize, "the page is as wide as the window");
        assert!(height * smaller > 2000);
        backgrounds.push(rgb[0]);
    }
    assert_eq!(backgrounds[0], backgrounds[2]);
    assert_eq!(backgrounds[1], backgrounds[3]);
    assert!(backgrounds[0][0] > 200 && backgrounds[1][0] < 60, "{backgrounds:?}");
}

/// Everything that the page's script does, done as a reader would: it is told by what is then shown.
#[test]
fn the_page_is_explored_in_a_browser() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    page_of(folder.path(), &format!("score @/town.mcap {ALL}"));
    let path = folder.path().join("report.html");
    let page = browser.open(&path, 1280, Theme::Light);
    let told = |expression: &str| page.evaluate(expression).as_str().unwrap_or_default().to_owned();

    // A table sorted by a column, one way and the other.
    let table = "document.querySelector('#ranking').parentElement.querySelector('table')";
    let names =
        || told(&format!("[...{table}.tBodies[0].rows].map(row => row.cells[1].textContent).join(' ')"));
    let click = |head: &str| {
        let heads = format!("[...{table}.querySelectorAll('thead th')]");
        page.evaluate(&format!(
            "{heads}.find(th => th.textContent.startsWith('{head}')).querySelector('button').click()"
        ));
    };
    assert_eq!(names(), "truth noise drift collapsed");
    click("miss");
    assert_eq!(names(), "truth noise collapsed drift");
    click("miss");
    assert_eq!(names(), "drift noise collapsed truth");
    click("rank");
    assert_eq!(names(), "truth noise drift collapsed");

    // A run switched off is drawn nowhere in its section.
    let shown = |run: usize| {
        page.evaluate(&format!(
            "[...document.querySelector('#trajectories').parentElement.querySelectorAll('.s{run}')].filter(e => \
             getComputedStyle(e).display !== 'none').length"
        ))
    };
    let toggle = "document.querySelector('ul.keys[data-runs] li:nth-child(3) button').click()";
    assert_eq!((shown(2), shown(1)), (3.into(), 3.into()));
    page.evaluate(toggle);
    assert_eq!((shown(2), shown(1)), (0.into(), 3.into()));
    page.evaluate(toggle);
    assert_eq!(shown(2), 3);

    // The pointer over a way, a map and a plot.
    let hover = |section: &str, across: f64, up: f64| {
        told(&format!(
            "(() => {{ const svg = document.querySelector('#{section}').parentElement.querySelector('figure > svg'); \
             svg.scrollIntoView(); const box = svg.getBoundingClientRect(); svg.dispatchEvent(new PointerEvent('pointermove', \
             {{ clientX: box.left + {across} * box.width, clientY: box.top + {up} * box.height }})); \
             return svg.nextElementSibling.textContent; }})()"
        ))
    };
    let ways = told(
        "(() => { const line = document.querySelector('polyline[data-run=\"drift\"]'); const svg = line.ownerSVGElement; \
         svg.scrollIntoView(); const at = line.points[50].matrixTransform(svg.getScreenCTM()); svg.dispatchEvent(new \
         PointerEvent('pointermove', { clientX: at.x, clientY: at.y })); return svg.nextElementSibling.textContent; })()",
    );
    assert!(ways.contains(": scan 50, ") && ways.contains(" m of way, off by "), "{ways}");
    let map = hover("maps", 0.5, 0.5);
    assert!(map.starts_with("x ") && map.contains(" m, y ") && map.ends_with(" m"), "{map}");
    let plot = hover("profile", 0.5, 0.5);
    assert!(plot.split(", ").all(|value| value.parse::<f64>().is_ok()), "{plot}");

    // A map by keys: nearer, aside, and back.
    let view = |keys: &[&str]| {
        for key in keys {
            page.evaluate(&format!(
                "document.querySelector('#maps').parentElement.querySelector('figure > svg').dispatchEvent(new \
                 KeyboardEvent('keydown', {{ key: '{key}' }}))"
            ));
        }
        told(
            "document.querySelector('#maps').parentElement.querySelector('figure > svg').getAttribute('viewBox')",
        )
    };
    let home = view(&[]);
    let number = |view: &str, k: usize| view.split(' ').nth(k).unwrap().parse::<f64>().unwrap();
    let near = view(&["+", "+"]);
    assert!((number(&home, 2) / number(&near, 2) - 2.25).abs() < 1e-3, "{home}: {near}");
    let aside = view(&["ArrowRight"]);
    assert!(number(&aside, 0) > number(&near, 0), "{near}: {aside}");
    assert_eq!(
        view(&["0"]).split(' ').map(|n| n.parse::<f64>().unwrap()).collect::<Vec<_>>(),
        home.split(' ').map(|n| n.parse::<f64>().unwrap()).collect::<Vec<_>>()
    );

    // Contents lead to sections; nothing was asked of a network, and nothing went wrong.
    let links =
        page.evaluate("[...document.querySelectorAll('nav a')].every(a => document.querySelector(a.hash))");
    assert_eq!(links, true);
    assert!(page.has("button", "Data as JSON") && page.has("button", "CSV"));
    page.assert_sound();
    assert!(page.requests().is_empty() && page.errors().is_empty(), "{:?}", page.errors());
}
