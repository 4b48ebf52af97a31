//! Every fault on a small page, caught by name.

use std::fmt::Write as _;

use super::tests::{SOUND, page_of};
use super::{Browser, Theme, pixels};
use crate::common::write;

/// Pages that are sound but for one thing: what is put into the page, and what is said of it, all of it.
/// `…` in the latter stands for anything.
const FAULTS: [(&str, &[&str]); 22] = [
    (
        "<div style='position: relative'><p>first words<p style='position: absolute; top: -10px'>second words</div>",
        &["overlap: \"first words\" and \"second words\" cover each other by … px"],
    ),
    (
        "<svg width='200' height='40'><text x='10' y='20'>one</text><text x='20' y='24'>two</text></svg>",
        &["overlap: \"one\" and \"two\" cover each other by … px"],
    ),
    (
        "<svg width='200' height='200'><g font-size='12'><text transform='translate(9 9) rotate(45)'>one askew</text>\
         <text transform='translate(12 9) rotate(45)'>two askew</text></g></svg>",
        &["overlap: \"one askew\" and \"two askew\" cover each other by … px"],
    ),
    (
        "<div id='long' style='width: 900px'><p>long</p></div>",
        &[
            "overflows: the page is 916 px wide in a window of 800 px",
            "overflows: div#long \"long\" goes from 16 to 916 px in a window of 800 px",
        ],
    ),
    (
        "<p style='white-space: nowrap'>long long long long long long long long long long long long long long long \
         long long long long long</p>",
        &["overflows: the page is … px wide in a window of 800 px", "overflows: the text \"long long…"],
    ),
    (
        "<svg width='40' height='30'><text y='20' x='60'>lost</text></svg>",
        &["overflows: the text \"lost\" is cut off by its picture"],
    ),
    (
        "<svg width='40' height='30'><text y='20'>cut off here</text></svg>",
        &["overflows: the text \"cut off here\" is cut off by its picture"],
    ),
    (
        "<img alt='gone' src='data:image/png;base64,AAAA'>",
        &["empty: img \"gone\" of data:image/png;base64,AAAA is not drawn"],
    ),
    (
        "<svg width='9' height='9'><image width='9' height='9' href='data:image/png;base64,AAAA'/></svg>",
        &["empty: image of data:image/png;base64,AAAA is not drawn"],
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
    ("<figure><figcaption>Bare</figcaption></figure>", &["empty: figure \"Bare\" has nothing but a caption"]),
    (
        "<table><tr><th>run</th></tr><tr></tr></table>",
        &["empty: table \"run\" has no cell of data", "empty: tr in table \"run\" has no cell"],
    ),
    ("<svg width='9' height='9'><g></g></svg>", &["empty: svg has nothing drawn"]),
    (
        "<svg id='flat' width='9' height='0'><rect width='9' height='9'/></svg>",
        &["empty: svg#flat is 9 × 0 px"],
    ),
    (
        "<p style='color: #555'>ink</p><h2 style='color: #777'>big ink</h2><b style='color: #777'>ink</b>",
        &[
            "contrast: \"ink\" in p: 2.48 of 4.5, rgb(85, 85, 85) on rgb(16, 20, 24)",
            "contrast: \"ink\" in b: 4.13 of 4.5, rgb(119, 119, 119) on rgb(16, 20, 24)",
        ],
    ),
    (
        "<div style='opacity: 0.5'><p style='opacity: 0.5; background: #fff8'>faint</p></div>",
        &["contrast: \"faint\" in p: 1.43 of 4.5, rgb(72, 75, 78) on rgb(48, 51, 55)"],
    ),
    (
        "<p style='background: linear-gradient(#000, #ddd)'>half lost</p>",
        &["contrast: \"half lost\" in p: … of 4.5, rgb(238, 238, 238) on rgb(221, 221, 221)"],
    ),
    (
        "<img alt='' src='http://example.invalid/x.png'>",
        &[
            "asks for: http://example.invalid/x.png",
            "error: Failed to load resource: net::ERR_NAME_NOT_RESOLVED http://example.invalid/x.png",
            "empty: img is 0 × 0 px",
            "empty: img of http://example.invalid/x.png is not drawn",
        ],
    ),
    (
        "<iframe title='far' src='https://example.invalid/in.html'></iframe>\
         <style>@import 'http://example.invalid/a.css'; p { background: url(//example.invalid/b) }</style>",
        &[
            "asks for: http://example.invalid/a.css",
            "asks for: https://example.invalid/in.html",
            "asks for: …://example.invalid/b",
            "error: …a.css",
            "error: …",
        ],
    ),
    ("<script>throw new Error('no report')</script>", &["error: Error: no report…"]),
    ("<script>console.error('no report', 7)</script>", &["error: no report 7"]),
];

/// Whether a line is as expected, `…` standing for anything.
fn is_like(line: &str, expected: &str) -> bool {
    let mut rest = line;
    let mut parts = expected.split('…');
    let begins = parts.next().is_none_or(|first| {
        rest = rest.strip_prefix(first).unwrap_or("\0");
        !rest.starts_with('\0')
    });
    let follow = parts.all(|part| match rest.find(part) {
        Some(at) => {
            rest = &rest[at + part.len()..];
            true
        }
        None => false,
    });
    begins && follow && (rest.is_empty() || expected.ends_with('…'))
}

#[test]
fn every_fault_is_caught_by_name() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut wrong = String::new();
    for (body, expected) in FAULTS {
        let path = write(folder.path(), "fault.html", &page_of("Fault", &format!("{SOUND}{body}")));
        let page = browser.open(&path, 800, Theme::Dark);
        let faults = page.faults();
        let alike = faults.len() == expected.len() && faults.iter().zip(expected).all(|(a, b)| is_like(a, b));
        if !alike {
            writeln!(wrong, "{body}\nexpected {expected:#?}\nfound {faults:#?}\n").unwrap();
        }
        // The ground that contrast is told of is painted somewhere, but for rounding.
        for fault in faults.iter().filter(|fault| fault.starts_with("contrast")) {
            let ground = fault.rsplit_once(" on rgb(").unwrap().1.trim_end_matches(')');
            let ground: Vec<u8> = ground.split(", ").map(|value| value.parse().unwrap()).collect();
            let painted = pixels(&page.screenshot().0).2;
            assert!(
                painted.iter().any(|colour| colour.iter().zip(&ground).all(|(a, b)| a.abs_diff(*b) <= 1)),
                "{fault}"
            );
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}
