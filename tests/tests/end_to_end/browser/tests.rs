//! The harness itself: a sound page, every fault on it by name, and a browser that is not there.

use std::process::Command;

use super::{Browser, Theme};
use crate::common::{text, write};

/// What lies in the body of a sound page, as a report is made: landmarks, a table, a plot, something to unfold, two themes.
const SOUND: &str = r#"
<main>
<h1>Scores</h1>
<section aria-labelledby="runs"><h2 id="runs">Runs</h2>
<p class="lead"><span class="unseen">Only for those who <b>listen</b></span>Two runs of one log,<br>the better one first.</p>
<div class="scroll"><table><thead><tr><th scope="col">run</th><th scope="col">R_cv(10)</th></tr></thead>
<tbody><tr><th scope="row">truth</th><td class="bar">0.012 m²</td></tr>
<tr><th scope="row">drift</th><td class="faint">0.240 m²</td></tr></tbody></table>
<p class="wide">A line that is longer than the window and scrolls in a part of its own, wherever it ends</p>
</div><div class="row"><div class="scroll"><p class="wide">Another that scrolls, and ends below what is beside it</p>
</div><p>beside it</p></div></section>
<section aria-labelledby="plots"><h2 id="plots">Plots</h2>
<figure><figcaption>Residuals over time</figcaption>
<svg role="img" aria-label="residuals, falling" viewBox="0 0 200 120" width="200" height="120">
<path d="M40 10 L190 80" stroke="currentColor" fill="none"/><path d="M-50 90 H900" stroke="currentColor"/>
<g font-size="10" fill="currentColor"><text x="40" y="104">0 s</text><text x="160" y="104">60 s</text>
<text transform="translate(14 80) rotate(-90)">residual, m</text>
<text transform="translate(60 40) rotate(45)">one label askew</text>
<text transform="translate(76 40) rotate(45)">another askew</text></g></svg></figure>
<img alt="a dot" width="16" height="16" src="data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 1 1'%3E%3Crect width='1' height='1'/%3E%3C/svg%3E">
<details><summary>Settings</summary><p>voxel 0.4 m</p></details></section>
</main>"#;

const STYLE: &str = "
:root { color-scheme: light dark; --ground: #fafafa; --ink: #222; --faint: #666; --bar: #cde; }
@media (prefers-color-scheme: dark) { :root { --ground: #101418; --ink: #eee; --faint: #9a9a9a; --bar: #245; } }
body { margin: 0 1em; background: var(--ground); color: var(--ink); font: 16px/1.1 'DejaVu Sans', sans-serif;
  font-variant-numeric: tabular-nums; }
.scroll { overflow-x: auto; } .wide { white-space: nowrap; width: 900px; }
.row { display: flex; } .row .scroll { width: 8em; }
.faint { color: var(--faint); } .bar { background: linear-gradient(90deg, var(--bar) 40%, transparent 40%); }
.lead { font-size: 32px; line-height: 1; }
.unseen { position: absolute; width: 1px; height: 1px; overflow: hidden; white-space: nowrap; }
";

fn page_of(title: &str, body: &str) -> String {
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <style>{STYLE}</style></head><body>{body}</body></html>"
    )
}

/// Faults of every kind: what is put into the page, and what must be reported of it, all of it, with `…` for anything.
const FAULTS: [(&str, &[&str]); 9] = [
    (
        "<div style='position: relative'><p>first words<p style='position: absolute; top: -10px'>second words</div>",
        &["overlap: \"first words\" and \"second words\" cover each other by … px"],
    ),
    (
        "<div id='long' style='width: 900px'><p>long</p></div>",
        &[
            "overflows: the page is 916 px wide in a window of 800 px",
            "overflows: div#long \"long\" goes from 16 to 916 px in a window of 800 px",
        ],
    ),
    (
        "<svg width='40' height='30'><text y='20'>cut off here</text></svg>",
        &["overflows: the text \"cut off here\" is cut off by its picture"],
    ),
    (
        "<img alt='gone' src='missing.png'>",
        &[
            "asks for: file://…/missing.png",
            "error: Failed to load resource: net::ERR_FILE_NOT_FOUND file://…/missing.png",
            "empty: img \"gone\" of missing.png is not drawn",
        ],
    ),
    (
        "<section class='bare'><h2>Bare</h2><div></div></section>",
        &["empty: section.bare \"Bare\" has nothing but a heading"],
    ),
    ("<svg width='9' height='9'><g></g></svg>", &["empty: svg has nothing drawn"]),
    (
        "<p style='color: #555'>ink</p>",
        &["contrast: \"ink\" in p: 2.48 of 4.5, rgb(85, 85, 85) on rgb(16, 20, 24)"],
    ),
    (
        "<img alt='' width='9' height='9' src='http://example.invalid/x.png'>",
        &[
            "asks for: http://example.invalid/x.png",
            "error: Failed to load resource: net::ERR_NAME_NOT_RESOLVED http://example.invalid/x.png",
            "empty: img of http://example.invalid/x.png is not drawn",
        ],
    ),
    ("<script>throw new Error('no report')</script>", &["error: Error: no report…"]),
];

/// Whether a line is as expected, `…` standing for anything.
fn is_like(line: &str, expected: &str) -> bool {
    let mut parts = expected.split('…');
    let Some(mut rest) = line.strip_prefix(parts.next().unwrap_or_default()) else { return false };
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.is_empty() || expected.ends_with('…')
}

#[test]
fn a_sound_page_is_sound_and_every_fault_is_caught_by_name() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    // A name that a URL must escape.
    let path = write(folder.path(), "sound page #1, 50 % é.html", &page_of("Scores of a drive", SOUND));
    let mut grounds = Vec::new();
    for (width_px, theme) in [(320, Theme::Light), (800, Theme::Dark)] {
        let page = browser.open(&path, width_px, theme);
        page.assert_sound();
        assert!(!page.text().contains("voxel 0.4 m"), "{}", page.text());
        page.unfold();
        page.assert_sound();
        assert!(page.text().contains("voxel 0.4 m"), "{}", page.text());
        assert_eq!(page.evaluate("innerWidth"), width_px);
        grounds.push(page.ground());
    }
    assert_eq!(grounds, ["rgb(250, 250, 250)", "rgb(16, 20, 24)"]);
    let page = browser.open(&path, 800, Theme::Light);
    for (role, name) in [
        ("RootWebArea", "Scores of a drive"),
        ("region", "Runs"),
        ("columnheader", "R_cv(10)"),
        ("cell", "0.012 m²"),
        ("image", "residuals, falling"),
        ("DisclosureTriangle", "Settings"),
        ("StaticText", "listen"),
    ] {
        assert!(page.has(role, name), "no {role} `{name}` in {:#?}", page.accessible());
    }
    assert!(!page.has("heading", "Residuals") && !page.has("StaticText", "voxel 0.4 m"));
    drop(page);

    for (body, expected) in FAULTS {
        let path = write(folder.path(), "fault.html", &page_of("Fault", &format!("{SOUND}{body}")));
        let faults = browser.open(&path, 800, Theme::Dark).faults();
        let alike = faults.len() == expected.len() && faults.iter().zip(expected).all(|(a, b)| is_like(a, b));
        assert!(alike, "{body}\nexpected {expected:#?}\nfound {faults:#?}");
    }
}

#[test]
fn without_a_browser_tests_are_skipped_but_not_where_one_must_be() {
    for (ci, passes, reason) in
        [("false", true, "skipped: neither chromium nor"), ("true", false, "neither chromium nor")]
    {
        // Another test of this program, where no browser can be found.
        let output = Command::new(std::env::current_exe().unwrap())
            .args([
                "--exact",
                "browser::tests::a_sound_page_is_sound_and_every_fault_is_caught_by_name",
                "--nocapture",
            ])
            .env("PATH", "")
            .env_remove("DMP_CHROMIUM")
            .env("CI", ci)
            .output()
            .unwrap();
        let all = text(&output.stdout) + &text(&output.stderr);
        assert_eq!(output.status.success(), passes, "{all}");
        assert!(all.contains("running 1 test") && all.contains(reason), "{all}");
    }
}
