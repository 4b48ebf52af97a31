//! The page of `--report`: what it names. `pages.rs` looks at it in a browser.

use std::path::Path;

use crate::common::{SAMPLE, SCORE, TWO, dmp, done, ends, has, once, refused, sample_rows, tum, write};

/// The page that a command writes to `report.html` of the folder.
fn page_of(folder: &Path, command: &str) -> String {
    done(folder, &format!("{command} --report report.html --quiet"));
    std::fs::read_to_string(folder.join("report.html")).unwrap()
}

/// A section of a page, by its anchor.
fn section<'a>(page: &'a str, anchor: &str) -> &'a str {
    let section = page.split(&format!("<h2 id=\"{anchor}\">")).nth(1).unwrap();
    section.split("</section>").next().unwrap()
}

/// Writes as `damaged.tum` the truth of the sample town with 40 m of its path, from `start_m` on, half a metre to the left;
/// when that is: seconds after the first scan.
fn damaged(folder: &Path, start_m: f64) -> [f64; 2] {
    let truth = sample_rows("truth.tum");
    let (mut rows, mut travel_m, mut when_s) = (truth.clone(), 0.0, Vec::new());
    for (k, row) in rows.iter_mut().enumerate() {
        let [before, after] = [k.saturating_sub(1), (k + 1).min(truth.len() - 1)].map(|k| &truth[k]);
        travel_m += (row[1] - before[1]).hypot(row[2] - before[2]);
        // Five metres to leave the path and five to return to it.
        let share = ((travel_m - start_m) / 5.0).min((start_m + 40.0 - travel_m) / 5.0).clamp(0.0, 1.0);
        let (dx, dy) = (after[1] - before[1], after[2] - before[2]);
        let norm = dx.hypot(dy).max(1e-9);
        if share > 0.0 {
            when_s.push(row[0] - truth[0][0]);
        }
        row[1] -= 0.5 * share * dy / norm;
        row[2] += 0.5 * share * dx / norm;
    }
    write(folder, "damaged.tum", &tum(&rows));
    [when_s[0], when_s[when_s.len() - 1]]
}

/// `MINUTES:SECONDS` in seconds.
fn seconds(clock: &str) -> f64 {
    let (minutes, seconds) = clock.split_once(':').unwrap();
    60.0 * minutes.parse::<f64>().unwrap() + seconds.parse::<f64>().unwrap()
}

/// The middle of the time that the sensor is at the worst place of a run: of its first pass, the worst.
fn worst_s(page: &str, run: usize) -> f64 {
    let heading = page.split(&format!("<h3 id=\"place-{run}-1\">1. ")).nth(1).unwrap();
    let clocks = heading.split(" (").next().unwrap();
    let (from, to) = clocks.split_once(" to ").unwrap_or((clocks, clocks));
    f64::midpoint(seconds(from), seconds(to))
}

fn damage_is_named_first(starts_m: impl Iterator<Item = u32>) {
    let folder = tempfile::tempdir().unwrap();
    for start_m in starts_m {
        let when_s = damaged(folder.path(), f64::from(start_m));
        for (runs, run) in [("-t damaged.tum", 0), ("-t @/truth.tum -t damaged.tum", 1)] {
            let at_s = worst_s(&page_of(folder.path(), &format!("{SCORE} {runs}")), run);
            assert!(
                (when_s[0]..=when_s[1]).contains(&at_s),
                "{runs}, from {start_m} m: {at_s} in {when_s:?}"
            );
        }
    }
}

#[test]
fn forty_metres_that_are_half_a_metre_off_are_named_first() {
    damage_is_named_first(std::iter::once(60));
}

#[test]
#[ignore = "nightly: nine places, 18 scores"]
fn the_worst_place_is_named_first_wherever_it_is() {
    damage_is_named_first((0..=160).step_by(20));
}

/// Where the reference was displaced another run is better, and a true reference is worse nowhere.
#[test]
fn a_reference_is_listed_where_it_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let when_s = damaged(folder.path(), 60.0);
    let page = |reference: &str, runs: &str| {
        page_of(folder.path(), &format!("{SCORE} {runs} --reference {reference}"))
    };
    let wrong = page("damaged", "-t damaged.tum -t @/truth.tum");
    let first = section(&wrong, "reference").split("<a href=\"#place-0-1\">").nth(1).unwrap();
    let from_s = seconds(first.split(' ').next().unwrap());
    assert!((when_s[0] - 5.0..=when_s[1]).contains(&from_s), "{from_s} s, off from {when_s:?}");
    has(first, &["residuals of ", "truth has "]);
    has(
        section(&page("truth", "-t @/truth.tum -t @/noise.tum"), "reference"),
        &["Nowhere is another run clearly better."],
    );
    let score = &format!("{SCORE} -t @/truth.tum");
    refused(folder.path(), &format!("{score} --report a.html --reference b"), 2, &["--reference b", "truth"]);
    ends(folder.path(), &format!("{score} --reference truth"), 2);
}

/// The page of the sample's four runs.
pub(crate) fn sample_page() -> &'static Path {
    &once(SAMPLE).folder
}

#[test]
fn the_same_command_writes_the_same_page() {
    let folder = tempfile::tempdir().unwrap();
    // The effort is what a machine makes of it, and stands at the end.
    let found = |page: &str| page.split_once("<h3>The effort</h3>").unwrap().0.to_owned();
    let one = page_of(folder.path(), &format!("{TWO} --threads 1"));
    let again = page_of(folder.path(), &format!("{TWO} --threads 4"));
    assert!(found(&one) == found(&again) && one.len() < 5_000_000, "{} bytes", one.len());
}

#[test]
fn pages_are_written_of_samples_maps_and_saved_results() {
    let folder = tempfile::tempdir().unwrap();
    let drawn = page_of(folder.path(), &format!("{TWO} --every 2 --returns 1/3"));
    has(&drawn, &["50 scans, one of 3 consecutive returns", "Worst places of drift"]);
    once(crate::map_command::BUILD).copy("truth.dmpmap", folder.path());
    let given = page_of(folder.path(), &format!("{TWO} --map truth.dmpmap"));
    assert!(given.contains("(R_near at 0.5 and 2 m)") && !given.contains("(R_cv at"));
    write(folder.path(), "a.json", &once(&format!("{TWO} --json --quiet")).stdout());
    let saved = page_of(folder.path(), "compare a.json");
    has(&saved, &["<strong>truth</strong> is better than <strong>drift</strong> by "]);
    // A failed gate stands on the page.
    let gated = dmp(folder.path(), "compare a.json --quiet --expect best:drift --report gate.html");
    assert_eq!(gated.status.code(), Some(4));
    let page = std::fs::read_to_string(folder.path().join("gate.html")).unwrap();
    has(&page, &["Gate failed: drift: worse than truth, at R_cv 10 m"]);
}

#[test]
fn a_page_that_cannot_be_written_is_refused_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "a.json", "{}");
    let score = "score no-such.mcap -t @/truth.tum";
    for (command, words) in [
        (format!("{score} --report a.pdf"), ["a.pdf", "a report is written as .html"]),
        (format!("{score} --report no/a.html"), ["no/a.html", "there is no folder no"]),
        ("compare a.json --report a.txt".to_owned(), ["a.txt", ".html"]),
    ] {
        refused(folder.path(), &command, 2, &words);
    }
}
