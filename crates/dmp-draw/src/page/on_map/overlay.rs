//! What is drawn over pictures: the way, a bar of a round length, an arrow.

use std::fmt::Write as _;

use dmp_lengths::thousands;

use crate::plot::escape;

/// Points of a way at most.
const WAY_POINTS: usize = 1500;
/// Space below a picture for the bar.
const BELOW: f64 = 26.0;

/// A picture's size and scale.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) units_per_m: f64,
}

impl Frame {
    /// The drawing as an element, with a bar below it and an arrow upwards, called by a letter.
    pub(crate) fn svg(&self, label: &str, drawing: &str, arrow: Option<&str>) -> String {
        let Self { width, height, units_per_m } = *self;
        let bar_m = round_length_m(0.3 * width / units_per_m);
        let (y, end) = (height + 14.0, 2.0 + bar_m * units_per_m);
        let arrow = arrow.map_or_else(String::new, |letter| {
            let (x, from, to) = (width - 12.0, height + 22.0, height + 3.0);
            let (beside, letters) = (x - 8.0, height + 17.0);
            format!(
                "<path d=\"M{x:.1} {from:.1}V{to:.1}m-4 6l4 -7l4 7\" fill=\"none\" stroke=\"var(--ink)\" stroke-width=\"1.5\"/>\
                 <text x=\"{beside:.1}\" y=\"{letters:.1}\" text-anchor=\"end\">{letter}</text>"
            )
        });
        let (total, tick, letters) = (height + BELOW, y - 4.0, y + 4.0);
        let beside = end + 6.0;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{}\" viewBox=\"0 0 {width:.1} {total:.1}\" \
             font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"var(--ink)\">{drawing}\
             <path d=\"M2 {y:.1}H{end:.1}M2 {tick:.1}v8M{end:.1} {tick:.1}v8\" stroke=\"var(--ink)\" stroke-width=\"1.5\"/>\
             <text x=\"{beside:.1}\" y=\"{letters:.1}\">{bar}</text>{arrow}</svg>\n",
            escape(label),
            bar = round_metres(bar_m),
        )
    }
}

/// A line through some points, from a dot at the first.
pub(crate) fn way(points: impl ExactSizeIterator<Item = [f64; 2]>) -> String {
    let every = points.len().div_ceil(WAY_POINTS).max(1);
    let last = points.len().saturating_sub(1);
    let mut line = String::new();
    let mut first = None;
    for (k, [x, y]) in points.enumerate() {
        if k % every == 0 || k == last {
            first.get_or_insert([x, y]);
            // Writing to a string cannot fail.
            let _ = write!(line, "{x:.1},{y:.1} ");
        }
    }
    let Some([x, y]) = first else { return String::new() };
    format!(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"var(--ink)\" stroke-width=\"1.2\" stroke-linejoin=\"round\" class=\"way\"/>\
         <circle class=\"way\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"var(--ink)\"/>",
        line.trim_end()
    )
}

/// `0.5 m`, `200 m`, `5 km`.
fn round_metres(length_m: f64) -> String {
    if length_m < 1000.0 {
        format!("{length_m} m")
    } else {
        format!("{} km", thousands((length_m / 1e3).round()))
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is not longer, metres.
fn round_length_m(most_m: f64) -> f64 {
    let power = libm::pow(10.0, libm::floor(libm::log10(most_m.max(1e-3))));
    [5.0, 2.0, 1.0].into_iter().map(|factor| factor * power).find(|m| *m <= most_m).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_round_and_as_long_as_they_say() {
        assert_eq!(
            [0.7, 1.0, 4.9, 30.0, 99.0, 612.0].map(round_length_m),
            [0.5, 1.0, 2.0, 20.0, 50.0, 500.0]
        );
        assert_eq!([0.5, 500.0, 2e3, 1e6].map(round_metres), ["0.5 m", "500 m", "2 km", "1,000 km"]);
        let frame = Frame { width: 400.0, height: 300.0, units_per_m: 2.0 };
        let svg = frame.svg("a <map>", "", Some("y"));
        assert!(svg.contains("aria-label=\"a &lt;map&gt;\"") && svg.contains(">50 m</text>"), "{svg}");
        assert!(svg.contains("M2 314.0H102.0M2 310.0v8M102.0 310.0v8"), "{svg}");
        assert!(svg.contains("viewBox=\"0 0 400.0 326.0\""), "{svg}");
    }

    #[test]
    fn long_ways_are_thinned_but_end_where_they_end() {
        let line = way((0..10_000).map(|k| [f64::from(k), 1.0]));
        assert!(line.matches(',').count() <= WAY_POINTS + 1);
        assert!(line.contains("points=\"0.0,1.0 7.0,1.0 ") && line.contains(" 9999.0,1.0\""), "{line}");
        assert_eq!(way([].into_iter()), "");
    }
}
