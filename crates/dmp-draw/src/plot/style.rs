//! How points, lines and letters of a plot look.

use crate::colour::{STEPS, bad_colours, hex};

/// Blue, vermilion, green, purple, orange, sky: distinct also without red or green (Okabe & Ito).
pub(crate) const SERIES_COLOURS: [&str; 6] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Each by itself.
    Points,
    /// With a line that joins them, in their order.
    Joined,
    /// As a line alone, broken where a point has no place.
    Line,
    /// As a thin line of such dashes, `6 4`; empty for none.
    Dashed(&'static str),
    /// As a broad line in a colour from good, 0, to bad; broken where a point has no place.
    Shade(usize),
    /// As a thin line of dashes without a colour, for what others are compared with.
    Reference,
    /// As the faint inside of what its points go around.
    Band,
}

impl Style {
    /// Whether its points are drawn by themselves.
    pub(super) fn has_points(self) -> bool {
        matches!(self, Self::Points | Self::Joined)
    }

    /// Stroke, width and dashes of its line.
    pub(super) fn stroke(self, colour: &str, ink: &Ink) -> (String, f64, &'static str) {
        match self {
            Self::Shade(step) => (hex(bad_colours()[step.min(STEPS - 1)]), 3.0, ""),
            Self::Dashed(dashes) => (colour.to_owned(), 1.5, dashes),
            Self::Reference => (ink.muted.to_owned(), 1.5, "5 3"),
            _ => (colour.to_owned(), 2.0, ""),
        }
    }
}

/// What lines and letters are drawn with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ink {
    /// Behind everything; `None` for what is there.
    pub(super) paper: Option<&'static str>,
    pub(super) text: &'static str,
    pub(super) muted: &'static str,
    pub(super) grid: &'static str,
    pub(super) series: [&'static str; 6],
    /// Whether title, subtitle and legend are drawn.
    pub(super) titles: bool,
}

/// A document of its own.
pub(super) const DOCUMENT: Ink = Ink {
    paper: Some("#fff"),
    text: "#222",
    muted: "#555",
    grid: "#e4e4e4",
    series: SERIES_COLOURS,
    titles: true,
};

/// In a document of several plots, which has the titles.
pub(super) const IN_PICTURE: Ink = Ink { paper: None, titles: false, ..DOCUMENT };

/// In a page, whose style sheet says what the colours are.
pub(super) const IN_PAGE: Ink = Ink {
    paper: None,
    text: "var(--ink)",
    muted: "var(--muted)",
    grid: "var(--line)",
    series: ["var(--s0)", "var(--s1)", "var(--s2)", "var(--s3)", "var(--s4)", "var(--s5)"],
    titles: false,
};
