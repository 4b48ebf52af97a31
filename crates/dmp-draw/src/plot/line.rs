//! Lines, dashes and bands of a plot.

use std::fmt::Write as _;

use super::style::{Ink, Style};

/// Points that are joined, pixels.
type Piece = Vec<(f64, f64)>;

/// Draws a line piece by piece.
pub(super) fn draw(
    svg: &mut String,
    style: Style,
    pieces: &[Piece],
    colour: &str,
    ink: &Ink,
) -> std::fmt::Result {
    // On a page lines of a run are switched off by their class, which is called like its colour.
    let named = colour.strip_prefix("var(--").and_then(|rest| rest.strip_suffix(')'));
    let class = named.map_or(String::new(), |name| format!(r#" class="{name}""#));
    for piece in pieces.iter().filter(|piece| piece.len() > 1) {
        if style == Style::Band {
            writeln!(
                svg,
                r#"<polygon{class} points="{}" fill="{colour}" fill-opacity="0.2"/>"#,
                places(piece)
            )?;
            continue;
        }
        let (stroke, width, dashes) = style.stroke(colour, ink);
        let dashes =
            if dashes.is_empty() { String::new() } else { format!(r#" stroke-dasharray="{dashes}""#) };
        writeln!(
            svg,
            r#"<polyline{class} points="{}" fill="none" stroke="{stroke}" stroke-width="{width}"{dashes} stroke-linejoin="round"/>"#,
            places(piece)
        )?;
    }
    Ok(())
}

fn places(piece: &[(f64, f64)]) -> String {
    let places: Vec<String> = piece.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    places.join(" ")
}
