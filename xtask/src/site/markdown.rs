//! What the checks need of a page of Markdown: its headings, its links, its words.

use std::collections::BTreeMap;

/// A page as it was read.
#[derive(Debug)]
pub(super) struct Page {
    /// What a link behind `#` may name, in the order of the headings.
    pub(super) anchors: Vec<String>,
    pub(super) links: Vec<Link>,
    /// As `wc -w` counts them.
    pub(super) words: usize,
}

/// A link or a picture.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Link {
    /// The line it ends in, from 1.
    pub(super) line: usize,
    /// What stands between the brackets.
    pub(super) target: String,
}

impl Page {
    pub(super) fn parse(text: &str) -> Self {
        let prose = without_code(text);
        let mut seen = BTreeMap::new();
        // A heading may have code in it, which the prose has not.
        let headings = text.lines().zip(prose.lines()).filter(|(_, prose)| is_heading(prose));
        let anchors = headings.map(|(line, _)| unique(anchor(line), &mut seen)).collect();
        Self {
            anchors,
            links: links(&prose).map(|(link, _)| link).collect(),
            words: text.split_whitespace().count(),
        }
    }
}

fn is_heading(line: &str) -> bool {
    let rest = line.trim_start_matches('#');
    (1..=6).contains(&(line.len() - rest.len())) && rest.starts_with(' ')
}

/// The anchor of a heading, as GitHub and mdBook make it: letters, digits, `-` and `_`, blanks as `-`.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim();
    // Of a link its text counts.
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find("](") {
        shown.push_str(&rest[..at]);
        rest = rest[at..].find(')').map_or("", |end| &rest[at + end + 1..]);
    }
    shown.push_str(rest);
    let kept = shown.chars().filter(|&c| c.is_alphanumeric() || "-_ ".contains(c));
    kept.map(|c| if c == ' ' { '-' } else { c }).flat_map(char::to_lowercase).collect()
}

/// A second heading of the same words has `-1` behind its anchor, a third `-2`.
fn unique(anchor: String, seen: &mut BTreeMap<String, usize>) -> String {
    let before = seen.entry(anchor.clone()).or_default();
    let unique = if *before == 0 { anchor } else { format!("{anchor}-{before}") };
    *before += 1;
    unique
}

/// The links of a text without code, with the bytes that each takes from its `[` on.
pub(super) fn links(prose: &str) -> impl Iterator<Item = (Link, std::ops::Range<usize>)> + '_ {
    prose.match_indices("](").filter_map(|(at, _)| {
        let start = at + 2;
        let end = start + prose[start..].find([')', '\n'])?;
        let target = prose[start..end].split_whitespace().next().unwrap_or_default();
        let target = target.trim_start_matches('<').trim_end_matches('>').to_owned();
        let open = opening(prose, at)?;
        let line = prose[..at].matches('\n').count() + 1;
        prose[end..].starts_with(')').then_some((Link { line, target }, open..end + 1))
    })
}

/// Where the bracket opens that closes at a byte: links in pictures have brackets in brackets.
fn opening(prose: &str, close: usize) -> Option<usize> {
    let mut depth = 0_usize;
    prose[..close].bytes().enumerate().rev().find_map(|(at, byte)| match byte {
        b']' => {
            depth += 1;
            None
        }
        b'[' if depth == 0 => Some(at),
        b'[' => {
            depth -= 1;
            None
        }
        _ => None,
    })
}

/// The text with code and comments overwritten by `x` and blanks, byte for byte and line for line: what looks like a
/// link or a heading there is none.
pub(super) fn without_code(text: &str) -> String {
    let mut fence: Option<String> = None;
    let mut is_comment = false;
    let mut prose = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let mark: String = line.trim_start().chars().take_while(|c| "`~".contains(*c)).collect();
        let is_fence = mark.len() >= 3 && mark.bytes().all(|byte| Some(&byte) == mark.as_bytes().first());
        let hidden = match &fence {
            Some(open) => {
                if is_fence && mark.starts_with(open.as_str()) {
                    fence = None;
                }
                true
            }
            None if is_fence => {
                fence = Some(mark);
                true
            }
            None => {
                is_comment |= line.trim_start().starts_with("<!--");
                let hidden = is_comment;
                is_comment &= !line.contains("-->");
                hidden
            }
        };
        if hidden {
            prose.push_str(&blank(line));
        } else {
            prose.push_str(line);
        }
    }
    without_spans(&prose)
}

/// Overwrites what stands between backticks: as many that open close, within a paragraph.
fn without_spans(text: &str) -> String {
    let mut prose = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('`') {
        let ticks = rest[at..].len() - rest[at..].trim_start_matches('`').len();
        let (before, inside) = rest.split_at(at + ticks);
        prose.push_str(&before[..at]);
        prose.push_str(&"x".repeat(ticks));
        let paragraph = &inside[..inside.find("\n\n").unwrap_or(inside.len())];
        match closing(paragraph, ticks) {
            Some(end) => {
                prose.push_str(&blank(&inside[..end]));
                rest = &inside[end..];
                prose.push_str(&"x".repeat(ticks));
                rest = &rest[ticks..];
            }
            None => rest = inside,
        }
    }
    prose.push_str(rest);
    prose
}

/// Where a run of exactly so many backticks begins.
fn closing(text: &str, ticks: usize) -> Option<usize> {
    let mut at = 0;
    while let Some(found) = text[at..].find('`') {
        let start = at + found;
        let run = text[start..].len() - text[start..].trim_start_matches('`').len();
        if run == ticks {
            return Some(start);
        }
        at = start + run;
    }
    None
}

/// As many bytes, and the same ends of lines.
fn blank(text: &str) -> String {
    text.bytes().map(|byte| if byte == b'\n' { '\n' } else { 'x' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anchors_are_those_of_github_and_mdbook() {
        let cases = [
            ("## Few scans (`--quick`, `--ego`)", "few-scans---quick---ego"),
            ("## `dmp-suite/1`", "dmp-suite1"),
            ("# When it is *not* R_cv", "when-it-is-not-r_cv"),
            ("### As [the page](page.md#x) says: Ä", "as-the-page-says-ä"),
        ];
        for (heading, expected) in cases {
            assert_eq!(anchor(heading), expected, "{heading}");
        }
        let page =
            Page::parse("# One\n\n## One\n\ntext # One\n\n```sh\n# One\n```\n## One\n####### no\n#no\n");
        assert_eq!(page.anchors, ["one", "one-1", "one-2"]);
    }

    #[test]
    fn links_stand_outside_of_code_and_comments() {
        let text = "<!-- [a](a.md) -->\n[b](b.md#c) `[d](d.md)` ![e](<e.png> \"E\")\n\n~~~\n[f](f.md)\n~~~\n\
                    ``a ` [g](g.md)`` [![h](h.svg)](h.md) one ` alone\n\n[i](i.md) ` [j](j";
        let page = Page::parse(text);
        let found: Vec<(usize, &str)> =
            page.links.iter().map(|link| (link.line, link.target.as_str())).collect();
        assert_eq!(found, [(2, "b.md#c"), (2, "e.png"), (7, "h.svg"), (7, "h.md"), (9, "i.md")]);
        let prose = without_code(text);
        assert_eq!((prose.len(), prose.lines().count()), (text.len(), text.lines().count()));
        let (_, bytes) = links(&prose).last().unwrap();
        assert_eq!(&text[bytes], "[i](i.md)");
        let outer = links(&prose).nth(3).map(|(_, bytes)| &text[bytes]);
        assert_eq!(outer, Some("[![h](h.svg)](h.md)"));
    }

    #[test]
    fn words_are_counted_as_wc_does() {
        assert_eq!(Page::parse("# Two words\n\n| a | `b c` |\n").words, 9);
    }
}
