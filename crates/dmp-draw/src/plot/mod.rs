//! A small writer of scatter and line plots as SVG.
//!
//! # Brief overview
//! A [`Plot`] has two [`Axis`] and some [`Series`] of [`Point`]s; [`Plot::to_svg`] draws it. Ticks are at
//! round numbers; every point shows its name and values when pointed at. Points that are not finite, or not positive on a
//! logarithmic axis, are left out. The same plot gives the same bytes.

mod line;
mod scale;
mod style;

use std::fmt::Write as _;

use dmp_log::is_printable;
use scale::Scale;
pub(crate) use style::SERIES_COLOURS;
pub use style::Style;
use style::{DOCUMENT, IN_PAGE, IN_PICTURE, Ink};

/// Longer names are cut, characters.
const LONGEST_NAME: usize = 28;
const FONT_PX: f64 = 12.0;

/// An axis.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Axis {
    /// What stands beside it.
    pub title: String,
    /// Whether decades are equally long.
    pub log: bool,
}

/// A value, perhaps with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Along the horizontal axis.
    pub x: f64,
    /// Along the vertical axis.
    pub y: f64,
    /// Shown when it is pointed at; empty for nothing.
    pub name: String,
}

/// Points of one colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// For the legend, which there is with two or more.
    pub name: String,
    /// The points.
    pub points: Vec<Point>,
    /// How they are drawn.
    pub style: Style,
}

/// A plot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    /// What stands above, and what a reader of screens calls it.
    pub title: String,
    /// A second, smaller line.
    pub subtitle: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Names of the places 0, 1, 2 … of the horizontal axis, instead of numbers; empty for numbers.
    pub x_names: Vec<String>,
    /// What is drawn.
    pub series: Vec<Series>,
}

/// A point and its pixels.
type Placed<'a> = (f64, f64, &'a Point);

/// Where the axes are, pixels.
#[derive(Debug, Clone, Copy)]
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    width: f64,
    height: f64,
}

impl Plot {
    /// The plot as a document of its own.
    pub fn to_svg(&self) -> String {
        let below = self.below_axis_px();
        let frame =
            Frame { left: 74.0, right: 696.0, top: 64.0, bottom: 430.0, width: 720.0, height: 430.0 + below };
        self.draw(&frame, &DOCUMENT, false)
    }

    /// The plot as an element of a page, without title and legend: the page has both. Colours are variables of the
    /// page's style sheet: `--ink`, `--muted`, `--line`, and `--s0` to `--s5` for the series.
    pub(crate) fn to_element(&self, width: f64, height: f64) -> String {
        self.element(width, height, false)
    }

    /// The same with one scale on both axes.
    pub(crate) fn to_map_element(&self, width: f64, height: f64) -> String {
        self.element(width, height, true)
    }

    fn element(&self, width: f64, height: f64, as_map: bool) -> String {
        let bottom = height - self.below_axis_px();
        let frame = Frame { left: 58.0, right: width - 10.0, top: 10.0, bottom, width, height };
        self.draw(&frame, &IN_PAGE, as_map)
    }

    /// The plot as a part of a document, its corner at a place, all in pixels; without title and legend, and as a map with one
    /// scale on both axes.
    pub(crate) fn to_part(&self, [x, y]: [f64; 2], [width, height]: [f64; 2], as_map: bool) -> String {
        let bottom = height - self.below_axis_px();
        let frame = Frame { left: 58.0, right: width - 10.0, top: 10.0, bottom, width, height };
        format!(
            "<g transform=\"translate({x:.0} {y:.0})\">\n{}</g>\n",
            self.draw(&frame, &IN_PICTURE, as_map)
        )
    }

    /// What the horizontal axis needs for its names, pixels.
    fn below_axis_px(&self) -> f64 {
        let names = self.x_names.iter().map(|name| text_width(&cut(name), FONT_PX));
        // Names stand at 40 degrees: so much of their length is below the axis.
        if self.x_names.is_empty() { 52.0 } else { 50.0 + 0.65 * names.fold(0.0, f64::max) }
    }

    fn draw(&self, frame: &Frame, ink: &Ink, as_map: bool) -> String {
        let names: Vec<String> = self.x_names.iter().map(|name| cut(name)).collect();
        let values = |of: fn(&Point) -> f64| self.series.iter().flat_map(|s| &s.points).map(of);
        let scales = |left: f64| {
            let mut x = if names.is_empty() {
                Scale::new(values(|p| p.x), self.x.log, left, frame.right)
            } else {
                Scale::places(names.len(), left, frame.right)
            };
            let mut y = Scale::new(values(|p| p.y), self.y.log, frame.bottom, frame.top);
            if as_map {
                Scale::equal(&mut x, &mut y);
            }
            (x, y)
        };
        // Numbers never reach the title beside them.
        let numbers =
            scales(frame.left).1.ticks().into_iter().map(|(_, number)| text_width(&number, FONT_PX));
        let frame = &Frame { left: frame.left.max(34.0 + numbers.fold(0.0, f64::max)), ..*frame };
        let (x, y) = scales(frame.left);

        let mut svg = String::new();
        // Writing to a string cannot fail.
        let _ = self
            .draw_axes(&mut svg, frame, ink, (&x, &y), &names)
            .and_then(|()| self.draw_points(&mut svg, frame, ink, (&x, &y)));
        svg.push_str("</svg>\n");
        svg
    }

    /// Everything but the points.
    fn draw_axes(
        &self,
        svg: &mut String,
        frame: &Frame,
        ink: &Ink,
        (x, y): (&Scale, &Scale),
        names: &[String],
    ) -> std::fmt::Result {
        let Frame { left, right, top, bottom, width, height } = *frame;
        let Ink { text: letters, muted, grid, .. } = *ink;
        let role = if ink.titles {
            String::new()
        } else {
            format!(r#" role="img" data-plot="{},{}""#, x.ends(), y.ends())
        };
        writeln!(
            svg,
            r#"<svg xmlns="http://www.w3.org/2000/svg"{role} width="{width:.0}" height="{height:.0}" viewBox="0 0 {width:.0} {height:.0}" font-family="Helvetica, Arial, sans-serif" font-size="{FONT_PX}" fill="{letters}">"#
        )?;
        writeln!(svg, "<title>{}</title>", escape(&self.title))?;
        if let Some(paper) = ink.paper {
            writeln!(svg, r#"<rect width="{width:.0}" height="{height:.0}" fill="{paper}"/>"#)?;
        }
        if ink.titles {
            text(svg, (left, 26.0), r#"font-size="16" font-weight="bold""#, &self.title)?;
            text(svg, (left, 46.0), &format!(r#"fill="{muted}""#), &self.subtitle)?;
        }

        for (at, number) in y.ticks() {
            writeln!(svg, r#"<path d="M{left:.1} {at:.1}H{right:.1}" stroke="{grid}"/>"#)?;
            text(svg, (left - 8.0, at + 4.0), r#"text-anchor="end""#, &number)?;
        }
        if names.is_empty() {
            for (at, number) in x.ticks() {
                writeln!(svg, r#"<path d="M{at:.1} {top:.1}V{bottom:.1}" stroke="{grid}"/>"#)?;
                // The last one stays in the picture.
                let middle = at.min(width - 0.5 * text_width(&number, FONT_PX) - 2.0);
                text(svg, (middle, bottom + 18.0), r#"text-anchor="middle""#, &number)?;
            }
        }
        for (k, name) in names.iter().enumerate() {
            let (at, below) = (x.at(k as f64).unwrap_or(left), bottom + 16.0);
            writeln!(svg, r#"<path d="M{at:.1} {bottom:.1}v5" stroke="{letters}"/>"#)?;
            let turned = format!(r#"text-anchor="end" transform="rotate(-40 {at:.1} {below:.1})""#);
            text(svg, (at, below), &turned, name)?;
        }
        writeln!(
            svg,
            r#"<path d="M{left:.1} {top:.1}V{bottom:.1}H{right:.1}" fill="none" stroke="{letters}"/>"#
        )?;
        let middle = f64::midpoint(left, right);
        text(svg, (middle, height - 12.0), r#"text-anchor="middle""#, &self.x.title)?;
        let middle = f64::midpoint(top, bottom);
        let turned = format!(r#"text-anchor="middle" transform="rotate(-90 18 {middle:.1})""#);
        text(svg, (18.0, middle), &turned, &self.y.title)
    }

    /// The points, their lines and names, the legend.
    fn draw_points(
        &self,
        svg: &mut String,
        frame: &Frame,
        ink: &Ink,
        (x, y): (&Scale, &Scale),
    ) -> std::fmt::Result {
        let Frame { left, right, top, bottom, .. } = *frame;
        let mut legend_at = right;
        let mut drawn: Vec<(&Series, Vec<Placed<'_>>)> = Vec::new();
        for series in &self.series {
            let points = series.points.iter().filter_map(|p| Some((x.at(p.x)?, y.at(p.y)?, p)));
            drawn.push((series, points.collect()));
        }
        if drawn.iter().all(|(_, points)| points.is_empty()) {
            let centre = (f64::midpoint(left, right), f64::midpoint(top, bottom));
            text(svg, centre, &format!(r#"text-anchor="middle" fill="{}""#, ink.muted), "no values")?;
        }
        for (k, (series, points)) in drawn.iter().enumerate().rev() {
            let colour = ink.series[k % ink.series.len()];
            if self.series.len() > 1 && ink.titles {
                let name = cut(&series.name);
                legend_at -= text_width(&name, FONT_PX);
                text(svg, (legend_at, 46.0), "", &name)?;
                writeln!(svg, r#"<circle cx="{:.1}" cy="42" r="4" fill="{colour}"/>"#, legend_at - 9.0)?;
                legend_at -= 32.0;
            }
            let pieces = match series.style {
                Style::Points => Vec::new(),
                Style::Joined => vec![points.iter().map(|&(px, py, _)| (px, py)).collect()],
                _ => pieces(series, x, y),
            };
            line::draw(svg, series.style, &pieces, colour, ink)?;
            if !series.style.has_points() {
                continue;
            }
            for (px, py, point) in points {
                let title = escape(&format!("{} ({}, {})", point.name, point.x, point.y));
                writeln!(
                    svg,
                    r##"<circle cx="{px:.1}" cy="{py:.1}" r="4" fill="{colour}" stroke="#fff"><title>{title}</title></circle>"##
                )?;
            }
        }
        Ok(())
    }
}

pub(crate) fn text(svg: &mut String, (x, y): (f64, f64), attributes: &str, text: &str) -> std::fmt::Result {
    if text.is_empty() {
        return Ok(());
    }
    let space = if attributes.is_empty() { "" } else { " " };
    writeln!(svg, r#"<text x="{x:.1}" y="{y:.1}"{space}{attributes}>{}</text>"#, escape(text))
}

/// The parts of a line between points that have no place.
fn pieces(series: &Series, x: &Scale, y: &Scale) -> Vec<Vec<(f64, f64)>> {
    let places: Vec<Option<(f64, f64)>> =
        series.points.iter().map(|p| Some((x.at(p.x)?, y.at(p.y)?))).collect();
    places.split(Option::is_none).map(|piece| piece.iter().copied().flatten().collect()).collect()
}

/// A name that is not too long.
pub(crate) fn cut(name: &str) -> String {
    if name.chars().count() <= LONGEST_NAME {
        return name.to_owned();
    }
    name.chars().take(LONGEST_NAME - 1).chain(['…']).collect()
}

/// Text as XML 1.0 and HTML may have it, also in an attribute; characters that it may not have become U+FFFD.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\t' | '\n' | '\r' => escaped.push(' '),
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            c if !is_printable(c) => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// About how wide a text is in a usual sans-serif face, pixels.
fn text_width(text: &str, font_px: f64) -> f64 {
    let em = |c: char| match c {
        'i' | 'j' | 'l' | '.' | ',' | ' ' | '\'' | '|' => 0.3,
        'f' | 't' | 'r' | '-' | '(' | ')' => 0.4,
        'm' | 'w' | 'M' | 'W' | '…' => 0.9,
        c if c.is_ascii_uppercase() => 0.72,
        c if c.is_ascii() => 0.57,
        _ => 0.8,
    };
    font_px * text.chars().map(em).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: &[(f64, f64, &str)], log: bool) -> Plot {
        let point = |&(x, y, name): &(f64, f64, &str)| Point { x, y, name: name.into() };
        let series =
            Series { name: "one".into(), points: points.iter().map(point).collect(), style: Style::Points };
        let axis = Axis { title: "x".into(), log };
        Plot { title: "t".into(), x: axis.clone(), y: axis, series: vec![series], ..Plot::default() }
    }

    #[test]
    fn names_are_escaped_and_cut() {
        let mut odd = plot(&[(1.0, 2.0, "<a&\"b'\u{1}>"), (3.0, 4.0, "")], false);
        odd.x_names = vec!["a".into(), "n".repeat(90)];
        let svg = odd.to_svg();
        assert!(svg.contains("<title>&lt;a&amp;&quot;b&#39;\u{fffd}&gt; (1, 2)</title>"), "{svg}");
        assert!(svg.contains(&format!(">{}…</text>", "n".repeat(27))));
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    }

    #[test]
    fn points_without_a_place_are_left_out() {
        let circles =
            |points: &[(f64, f64, &str)], log| plot(points, log).to_svg().matches("<circle").count();
        let points = [(1.0, 1.0, ""), (f64::NAN, 1.0, ""), (2.0, f64::INFINITY, ""), (0.0, 3.0, "")];
        assert_eq!(circles(&points, false), 2);
        assert_eq!(circles(&points, true), 1);
        assert_eq!(circles(&[], false), 0);
        assert!(plot(&[], true).to_svg().contains("no values"));
    }

    #[test]
    fn lines_legend_and_named_places() {
        let mut lines = plot(&[(0.0, 1.0, "a"), (1.0, 0.5, "b")], false);
        lines.series[0].style = Style::Joined;
        lines.series.push(Series { name: "two".into(), ..lines.series[0].clone() });
        lines.x_names = vec!["first".into(), "second".into()];
        let svg = lines.to_svg();
        assert_eq!(svg.matches("<polyline").count(), 2);
        for name in ["one", "two", "first", "second"] {
            assert!(svg.contains(&format!(">{name}</text>")), "{name}");
        }
    }

    #[test]
    fn an_element_has_the_colours_of_its_page_and_broken_lines() {
        let points: Vec<_> =
            (0..9).map(|k| (f64::from(k), if k == 4 { f64::NAN } else { 1.0 }, "")).collect();
        let mut lines = plot(&points, false);
        lines.series[0].style = Style::Line;
        let svg = lines.to_element(480.0, 300.0);
        assert_eq!((svg.matches("<polyline").count(), svg.matches("<circle").count()), (2, 0));
        assert!(svg.contains(r#"stroke="var(--s0)""#) && !svg.contains("#fff"), "{svg}");
        assert!(
            svg.starts_with("<svg ") && svg.contains(r#"role="img""#) && svg.contains("<title>t</title>")
        );
        assert!(!svg.contains(">t</text>"), "the page says what it is");
    }
}
