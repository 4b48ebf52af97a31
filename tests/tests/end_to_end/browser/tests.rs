//! The harness itself: a sound page, the tree of parts, and a browser that is not there or ends.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use serde_json::json;

use super::chromium::found;
use super::protocol::Connection;
use super::{Browser, Theme, pixels};
use crate::common::{text, write};

/// What lies in the body of a sound page, as a report is made: landmarks, a table, a plot, something to unfold, two themes.
pub(super) const SOUND: &str = r#"
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

pub(super) fn page_of(title: &str, body: &str) -> String {
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <style>{STYLE}</style></head><body>{body}</body></html>"
    )
}

#[test]
fn a_sound_page_is_sound_at_every_width_and_in_both_themes() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    // A name that a URL must escape.
    let path = write(folder.path(), "sound page #1, 50 % é.html", &page_of("Scores of a drive", SOUND));
    let mut grounds = Vec::new();
    for (width_px, theme) in [(320, Theme::Light), (800, Theme::Dark), (1280, Theme::Light)] {
        let page = browser.open(&path, width_px, theme);
        page.assert_sound();
        assert!(!page.text().contains("voxel 0.4 m"), "{}", page.text());
        page.unfold();
        page.assert_sound();
        assert!(page.text().contains("voxel 0.4 m"), "{}", page.text());
        assert_eq!(page.evaluate("innerWidth"), width_px);
        // The file that is saved is the picture of the page, of this width and in this theme.
        let saved = folder.path().join("page.png");
        page.save(&saved);
        let (width, height, rgb) = pixels(&std::fs::read(saved).unwrap());
        assert_eq!((width, rgb.len()), (width_px as usize, width * height));
        grounds.push(rgb[0]);
        assert!(rgb.iter().any(|colour| *colour != rgb[0]), "nothing is drawn");
    }
    assert_eq!(grounds, [[0xfa; 3], [0x10, 0x14, 0x18], [0xfa; 3]]);
    a_picture_goes_on_below_the_window(&browser, folder.path());
}

/// What is above the window's lower edge, and what is below it.
fn a_picture_goes_on_below_the_window(browser: &Browser, folder: &Path) {
    let body = "<div style='height: 3000px'></div><div style='height: 10px; background: #08f'></div>";
    let page = browser.open(&write(folder, "high.html", &page_of("High", body)), 640, Theme::Light);
    let (width, height, rgb) = pixels(&page.screenshot().0);
    assert_eq!((width, height), (640, 3010));
    assert_eq!(rgb[3005 * width + 320], [0, 0x88, 0xff]);
    assert_eq!(rgb[2995 * width + 320], [0xfa; 3]);
}

#[test]
fn a_page_is_heard_as_it_is_made() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "heard.html", &page_of("Scores of a drive", SOUND));
    let page = browser.open(&path, 800, Theme::Light);
    let nodes = page.accessible();
    assert_eq!((nodes[0].role.as_str(), nodes[0].name.as_str()), ("RootWebArea", "Scores of a drive"));
    assert!(nodes.iter().skip(1).enumerate().all(|(k, node)| node.parent.is_some_and(|parent| parent <= k)));
    for (role, name) in [
        ("region", "Runs"),
        ("columnheader", "R_cv(10)"),
        ("rowheader", "drift"),
        ("cell", "0.012 m²"),
        ("figure", ""),
        ("StaticText", "Residuals over time"),
        ("image", "residuals, falling"),
        ("image", "a dot"),
        ("DisclosureTriangle", "Settings"),
        ("StaticText", "listen"),
    ] {
        assert!(page.has(role, name), "no {role} `{name}` in {nodes:#?}");
    }
    assert!(!page.has("heading", "Residuals") && !page.has("StaticText", "voxel 0.4 m"));
    let headings: Vec<_> = page.all("heading").into_iter().map(|node| (node.level, node.name)).collect();
    let expected = [(1, "Scores"), (2, "Runs"), (2, "Plots")];
    assert_eq!(headings, expected.map(|(level, name)| (Some(level), name.to_owned())));
    // The table lies in the section of the runs.
    let mut at = nodes.iter().position(|node| node.role == "table").unwrap();
    while nodes[at].role != "region" {
        at = nodes[at].parent.unwrap();
    }
    assert_eq!(nodes[at].name, "Runs");
    assert!(nodes.iter().all(|node| node.description.is_empty()));
    // Nothing is left of a browser.
    let profile = browser.folder.as_ref().unwrap().path().to_path_buf();
    assert!(profile.join("profile").is_dir());
    drop(page);
    drop(browser);
    assert!(!profile.exists());
}

#[test]
fn a_browser_is_looked_for_where_it_may_be() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    let search_path = std::env::join_paths([&first, &second]).unwrap();
    assert_eq!(found(None, &search_path), None);
    // The name counts before the folder.
    for (place, name) in [(&second, "google-chrome"), (&first, "chromium-browser"), (&second, "chromium")] {
        std::fs::create_dir_all(place).unwrap();
        let program = write(place, name, "");
        assert_eq!(found(None, &search_path), Some(program));
    }
    let chosen = write(folder.path(), "chosen", "");
    assert_eq!(found(Some(chosen.as_os_str()), &search_path), Some(chosen));
}

#[test]
fn without_a_browser_tests_are_skipped_but_not_where_one_must_be() {
    for (ci, passes, said) in
        [("false", true, "skipped: neither chromium nor"), ("true", false, "neither chromium nor")]
    {
        // Another test of this program, where no browser can be found.
        let output = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "browser::tests::a_page_is_heard_as_it_is_made", "--nocapture"])
            .env("PATH", "")
            .env_remove("DMP_CHROMIUM")
            .env("CI", ci)
            .output()
            .unwrap();
        let all = text(&output.stdout) + &text(&output.stderr);
        assert_eq!(output.status.success(), passes, "{all}");
        assert!(all.contains("running 1 test") && all.contains(said), "{all}");
    }
}

/// The message of a panic.
fn message_of<T>(fails: impl FnOnce() -> T) -> String {
    let Err(panic) = catch_unwind(AssertUnwindSafe(fails)) else { panic!("this was to fail") };
    *panic.downcast::<String>().unwrap()
}

#[test]
fn a_browser_that_does_not_run_is_told_of_with_what_it_said() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken");
    let body = "#!/bin/sh\necho 'a library is missing' >&2\n";
    // Written by another process: one that is forked just now by another test would keep it busy.
    let script = format!("printf \"{body}\" >'{0}' && chmod +x '{0}'", broken.display());
    assert!(Command::new("sh").args(["-c", &script]).status().unwrap().success());
    let message = message_of(|| Browser::of(&broken));
    assert!(
        message.contains("`Browser.getVersion`") && message.contains("a library is missing"),
        "{message}"
    );
}

#[test]
fn nothing_is_waited_for_without_an_end() {
    let folder = tempfile::tempdir().unwrap();
    // A browser that takes everything and says nothing.
    let (from_browser, _kept_open) = std::io::pipe().unwrap();
    let stderr = folder.path().join("stderr.txt");
    let mut connection = Connection::new(Vec::new(), from_browser, stderr, Duration::from_millis(20));
    let message = message_of(|| connection.call("", "Page.enable", &json!({})));
    assert!(message.starts_with("waited 20ms for the answer to `Page.enable`"), "{message}");
    let message = message_of(|| connection.wait_for("the page to be loaded", |_| false));
    assert!(message.starts_with("waited 20ms for the page to be loaded"), "{message}");
}
