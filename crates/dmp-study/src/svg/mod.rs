//! A small writer of scatter and line plots as SVG.
//!
//! # Brief overview
//! A [`Plot`] has two [`Axis`] and some [`Series`] of [`Point`]s; [`Plot::to_svg`] draws it. Ticks are at
//! round numbers; names of points are put where they cover nothing, or left out where there is no such place
//! (every point tells its name and values when pointed at). Points that are not finite, or not positive on a
//! logarithmic axis, are left out. The same plot gives the same bytes.

mod label;
mod scale;

use std::fmt::Write as _;

use label::{Boxed, Labels, text_width};
use scale::Scale;

/// Blue, vermilion, green, purple, orange, sky: told apart also without red or green (Okabe & Ito).
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
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
    /// What stands beside it; empty for nothing.
    pub name: String,
}

/// Points of one colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// For the legend, which there is with two or more.
    pub name: String,
    /// The points.
    pub points: Vec<Point>,
    /// Whether a line joins them, in their order.
    pub line: bool,
}

/// A plot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    /// What stands above.
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
        let names: Vec<String> = self.x_names.iter().map(|name| cut(name)).collect();
        let longest = names.iter().map(|name| text_width(name, FONT_PX)).fold(0.0, f64::max);
        // Names stand at 40 degrees: so much of their length is below the axis.
        let below = if names.is_empty() { 52.0 } else { 50.0 + 0.65 * longest };
        let frame =
            Frame { left: 74.0, right: 696.0, top: 64.0, bottom: 430.0, width: 720.0, height: 430.0 + below };
        let values = |of: fn(&Point) -> f64| self.series.iter().flat_map(|s| &s.points).map(of);
        let x = if names.is_empty() {
            Scale::new(values(|p| p.x), self.x.log, frame.left, frame.right)
        } else {
            Scale::places(names.len(), frame.left, frame.right)
        };
        let y = Scale::new(values(|p| p.y), self.y.log, frame.bottom, frame.top);

        let mut svg = String::new();
        // Writing to a string cannot fail.
        let _ = self
            .draw_axes(&mut svg, &frame, &x, &y, &names)
            .and_then(|()| self.draw_points(&mut svg, &frame, &x, &y));
        svg.push_str("</svg>\n");
        svg
    }

    /// Everything but the points.
    fn draw_axes(
        &self,
        svg: &mut String,
        frame: &Frame,
        x: &Scale,
        y: &Scale,
        names: &[String],
    ) -> std::fmt::Result {
        let Frame { left, right, top, bottom, width, height } = *frame;
        writeln!(
            svg,
            r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0}" height="{height:.0}" viewBox="0 0 {width:.0} {height:.0}" font-family="Helvetica, Arial, sans-serif" font-size="{FONT_PX}" fill="#222">"##
        )?;
        writeln!(svg, "<title>{}</title>", escape(&self.title))?;
        writeln!(svg, r##"<rect width="{width:.0}" height="{height:.0}" fill="#fff"/>"##)?;
        text(svg, (left, 26.0), r#"font-size="16" font-weight="bold""#, &self.title)?;
        text(svg, (left, 46.0), r##"fill="#555""##, &self.subtitle)?;

        for (at, number) in y.ticks() {
            writeln!(svg, r##"<path d="M{left:.1} {at:.1}H{right:.1}" stroke="#e4e4e4"/>"##)?;
            text(svg, (left - 8.0, at + 4.0), r#"text-anchor="end""#, &number)?;
        }
        if names.is_empty() {
            for (at, number) in x.ticks() {
                writeln!(svg, r##"<path d="M{at:.1} {top:.1}V{bottom:.1}" stroke="#e4e4e4"/>"##)?;
                text(svg, (at, bottom + 18.0), r#"text-anchor="middle""#, &number)?;
            }
        }
        for (k, name) in names.iter().enumerate() {
            let (at, below) = (x.at(k as f64).unwrap_or(left), bottom + 16.0);
            writeln!(svg, r##"<path d="M{at:.1} {bottom:.1}v5" stroke="#222"/>"##)?;
            let turned = format!(r#"text-anchor="end" transform="rotate(-40 {at:.1} {below:.1})""#);
            text(svg, (at, below), &turned, name)?;
        }
        writeln!(
            svg,
            r##"<path d="M{left:.1} {top:.1}V{bottom:.1}H{right:.1}" fill="none" stroke="#222"/>"##
        )?;
        let middle = f64::midpoint(left, right);
        text(svg, (middle, height - 12.0), r#"text-anchor="middle""#, &self.x.title)?;
        let middle = f64::midpoint(top, bottom);
        let turned = format!(r#"text-anchor="middle" transform="rotate(-90 18 {middle:.1})""#);
        text(svg, (18.0, middle), &turned, &self.y.title)
    }

    /// The points, their lines and names, the legend.
    fn draw_points(&self, svg: &mut String, frame: &Frame, x: &Scale, y: &Scale) -> std::fmt::Result {
        let Frame { left, right, top, bottom, .. } = *frame;
        let mut labels = Labels::within(Boxed { x0: left + 2.0, y0: top, x1: right, y1: bottom - 2.0 });
        let mut legend_at = right;
        let mut drawn: Vec<(&Series, Vec<Placed<'_>>)> = Vec::new();
        for series in &self.series {
            let points = series.points.iter().filter_map(|p| Some((x.at(p.x)?, y.at(p.y)?, p)));
            drawn.push((series, points.collect()));
        }
        for (_, points) in &drawn {
            points.iter().for_each(|&(px, py, _)| labels.cover(Boxed::around(px, py, 4.5)));
        }
        if drawn.iter().all(|(_, points)| points.is_empty()) {
            let centre = (f64::midpoint(left, right), f64::midpoint(top, bottom));
            text(svg, centre, r##"text-anchor="middle" fill="#555""##, "no values")?;
        }
        for (k, (series, points)) in drawn.iter().enumerate().rev() {
            let colour = COLOURS[k % COLOURS.len()];
            if self.series.len() > 1 {
                let name = cut(&series.name);
                legend_at -= text_width(&name, FONT_PX);
                text(svg, (legend_at, 46.0), "", &name)?;
                writeln!(svg, r#"<circle cx="{:.1}" cy="42" r="4" fill="{colour}"/>"#, legend_at - 9.0)?;
                legend_at -= 32.0;
            }
            if series.line && points.len() > 1 {
                let way: Vec<String> = points.iter().map(|(px, py, _)| format!("{px:.1},{py:.1}")).collect();
                let way = way.join(" ");
                writeln!(
                    svg,
                    r#"<polyline points="{way}" fill="none" stroke="{colour}" stroke-width="2" stroke-linejoin="round"/>"#
                )?;
            }
            for (px, py, point) in points {
                let told = escape(&format!("{} ({}, {})", point.name, point.x, point.y));
                writeln!(
                    svg,
                    r##"<circle cx="{px:.1}" cy="{py:.1}" r="4" fill="{colour}" stroke="#fff"><title>{told}</title></circle>"##
                )?;
            }
        }
        for (px, py, point) in drawn.iter().flat_map(|(_, points)| points) {
            let name = cut(&point.name);
            if let Some(place) = labels.place(*px, *py, text_width(&name, FONT_PX - 1.0)) {
                text(svg, (place.x0, place.y1 - 3.0), r#"font-size="11""#, &name)?;
            }
        }
        Ok(())
    }
}

fn text(svg: &mut String, (x, y): (f64, f64), attributes: &str, text: &str) -> std::fmt::Result {
    if text.is_empty() {
        return Ok(());
    }
    let space = if attributes.is_empty() { "" } else { " " };
    writeln!(svg, r#"<text x="{x:.1}" y="{y:.1}"{space}{attributes}>{}</text>"#, escape(text))
}

/// A name that is not too long.
fn cut(name: &str) -> String {
    if name.chars().count() <= LONGEST_NAME {
        return name.to_owned();
    }
    name.chars().take(LONGEST_NAME - 1).chain(['…']).collect()
}

/// Text as XML 1.0 may have it; characters that it may not have become U+FFFD.
fn escape(text: &str) -> String {
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
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: &[(f64, f64, &str)], log: bool) -> Plot {
        let point = |&(x, y, name): &(f64, f64, &str)| Point { x, y, name: name.into() };
        let series = Series { name: "one".into(), points: points.iter().map(point).collect(), line: false };
        let axis = Axis { title: "x".into(), log };
        Plot { title: "t".into(), x: axis.clone(), y: axis, series: vec![series], ..Plot::default() }
    }

    #[test]
    fn names_are_escaped_and_cut() {
        let svg = plot(&[(1.0, 2.0, "<a&\"b'\u{1}>"), (3.0, 4.0, &"n".repeat(90))], false).to_svg();
        assert!(svg.contains(">&lt;a&amp;&quot;b&#39;\u{fffd}&gt;</text>"), "{svg}");
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
        lines.series[0].line = true;
        lines.series.push(Series { name: "two".into(), ..lines.series[0].clone() });
        lines.x_names = vec!["first".into(), "second".into()];
        let svg = lines.to_svg();
        assert_eq!(svg.matches("<polyline").count(), 2);
        for name in ["one", "two", "first", "second"] {
            assert!(svg.contains(&format!(">{name}</text>")), "{name}");
        }
    }
}
