//! A terminal, drawn: text with the escape sequences of colours (ECMA-48, SGR) as SVG.

use std::fmt::Write as _;

/// A cell, pixels.
const CELL: [f64; 2] = [8.43, 19.0];
const MARGIN: f64 = 16.0;
/// Behind the text, and the text itself.
const GROUND: &str = "#16181d";
const PLAIN: &str = "#d8dee9";
/// Those of the sequences 30 to 37; 90 to 97 are drawn alike.
const COLOURS: [&str; 8] =
    ["#5c6370", "#e06c75", "#98c379", "#e5c07b", "#61afef", "#c678dd", "#56b6c2", "#d8dee9"];

/// How what follows looks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Style {
    bold: bool,
    dim: bool,
    colour: Option<&'static str>,
}

/// The picture of a command and of what it prints.
pub(super) fn picture(command: &str, printed: &str) -> String {
    let prompt = format!("\u{1b}[32m$\u{1b}[0m \u{1b}[1m{command}\u{1b}[0m");
    let lines: Vec<Vec<(Style, String)>> =
        std::iter::once(prompt.as_str()).chain(printed.lines()).map(parts).collect();
    let columns = lines.iter().map(|line| line.iter().map(|(_, text)| text.chars().count()).sum::<usize>());
    let (columns, rows) = (columns.max().unwrap_or(0), lines.len());
    let (width, height) = (columns as f64 * CELL[0] + 2.0 * MARGIN, rows as f64 * CELL[1] + 2.0 * MARGIN);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\" \
         aria-label=\"What dmp score prints\">\n\
         <rect width=\"100%\" height=\"100%\" rx=\"8\" fill=\"{GROUND}\"/>\n\
         <g font-family=\"ui-monospace, SFMono-Regular, Menlo, Consolas, 'DejaVu Sans Mono', monospace\" font-size=\"14\" fill=\"{PLAIN}\">\n"
    );
    for (row, line) in lines.iter().enumerate() {
        let y = MARGIN + (row as f64 + 0.75) * CELL[1];
        let mut column = 0;
        for (style, text) in line {
            // Every part has its place and its width: fonts differ.
            let (x, count) = (MARGIN + column as f64 * CELL[0], text.chars().count());
            column += count;
            if text.trim().is_empty() {
                continue;
            }
            let length = count as f64 * CELL[0];
            let _ = writeln!(
                out,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" textLength=\"{length:.1}\" xml:space=\"preserve\"{}>{}</text>",
                attributes(*style),
                escaped(text)
            );
        }
    }
    out + "</g>\n</svg>\n"
}

fn attributes(style: Style) -> String {
    let fill = style.colour.map_or(String::new(), |colour| format!(" fill=\"{colour}\""));
    let weight = if style.bold { " font-weight=\"bold\"" } else { "" };
    let opacity = if style.dim { " opacity=\"0.6\"" } else { "" };
    format!("{fill}{weight}{opacity}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A line in parts of one style each.
fn parts(line: &str) -> Vec<(Style, String)> {
    let mut found: Vec<(Style, String)> = Vec::new();
    let mut style = Style::default();
    let mut rest = line;
    while let Some(at) = rest.find("\u{1b}[") {
        found.push((style, rest[..at].to_owned()));
        let sequence = &rest[at + 2..];
        let Some(end) = sequence.find('m') else { break };
        style = sequence[..end].split(';').fold(style, turned);
        rest = &sequence[end + 1..];
    }
    found.push((style, rest.to_owned()));
    found.retain(|(_, text)| !text.is_empty());
    found
}

/// The style after a number of a sequence.
fn turned(style: Style, number: &str) -> Style {
    match number.parse::<usize>() {
        Ok(1) => Style { bold: true, ..style },
        Ok(2) => Style { dim: true, ..style },
        Ok(22) => Style { bold: false, dim: false, ..style },
        Ok(39) => Style { colour: None, ..style },
        Ok(code @ (30..=37 | 90..=97)) => Style { colour: COLOURS.get(code % 10).copied(), ..style },
        // None at all is a reset, too.
        Ok(0) | Err(_) => Style::default(),
        Ok(_) => style,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequences_are_styles_and_text_is_escaped() {
        let red = Style { colour: Some(COLOURS[1]), bold: true, dim: false };
        let expected = vec![
            (Style::default(), "a ".to_owned()),
            (red, "b<".to_owned()),
            (Style::default(), " c".to_owned()),
        ];
        assert_eq!(parts("a \u{1b}[1;31mb<\u{1b}[0m c"), expected);
        assert_eq!(parts("\u{1b}[2m\u{1b}[m"), vec![]);
        let drawn = picture("dmp", "a \u{1b}[1;31mb<\u{1b}[0m c\n\nd");
        assert!(drawn.contains("fill=\"#e06c75\" font-weight=\"bold\">b&lt;</text>"), "{drawn}");
        assert!(!drawn.contains('\u{1b}'));
        assert_eq!(drawn.matches("<text").count(), 2 + 3 + 1);
    }
}
