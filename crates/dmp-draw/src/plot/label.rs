//! Places for names beside points.

/// A rectangle, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Boxed {
    pub(super) x0: f64,
    pub(super) y0: f64,
    pub(super) x1: f64,
    pub(super) y1: f64,
}

impl Boxed {
    pub(super) fn around(x: f64, y: f64, radius: f64) -> Self {
        Self { x0: x - radius, y0: y - radius, x1: x + radius, y1: y + radius }
    }

    fn meets(&self, other: &Self) -> bool {
        self.x0 < other.x1 && other.x0 < self.x1 && self.y0 < other.y1 && other.y0 < self.y1
    }

    fn holds(&self, other: &Self) -> bool {
        self.x0 <= other.x0 && other.x1 <= self.x1 && self.y0 <= other.y0 && other.y1 <= self.y1
    }
}

/// How high a name is, pixels.
const HEIGHT_PX: f64 = 13.0;
/// Between a point's centre and its name, pixels.
const GAP_PX: f64 = 7.0;

/// What is taken already.
#[derive(Debug)]
pub(super) struct Labels {
    within: Boxed,
    taken: Vec<Boxed>,
}

impl Labels {
    pub(super) fn within(within: Boxed) -> Self {
        Self { within, taken: Vec::new() }
    }

    /// Nothing may be written here.
    pub(super) fn cover(&mut self, place: Boxed) {
        self.taken.push(place);
    }

    /// A free place for a name beside a point: right, left, above, below, or at a corner; then a little
    /// further away. `None` where all are taken, or there is no name.
    pub(super) fn place(&mut self, x: f64, y: f64, width: f64) -> Option<Boxed> {
        if width <= 0.0 {
            return None;
        }
        let half = HEIGHT_PX / 2.0;
        let candidates = [1.0, 1.9].into_iter().flat_map(|far| {
            let gap = GAP_PX * far;
            let corner = 0.7 * gap;
            [
                (x + gap, y - half),
                (x - gap - width, y - half),
                (x - width / 2.0, y - gap - HEIGHT_PX),
                (x - width / 2.0, y + gap),
                (x + corner, y - corner - HEIGHT_PX),
                (x + corner, y + corner),
                (x - corner - width, y - corner - HEIGHT_PX),
                (x - corner - width, y + corner),
            ]
        });
        let boxes = candidates.map(|(x0, y0)| Boxed { x0, y0, x1: x0 + width, y1: y0 + HEIGHT_PX });
        let free = |place: &Boxed| self.within.holds(place) && !self.taken.iter().any(|t| t.meets(place));
        let place = boxes.into_iter().find(free)?;
        self.taken.push(place);
        Some(place)
    }
}

/// About how wide a text is in a usual sans-serif face, pixels.
pub(super) fn text_width(text: &str, font_px: f64) -> f64 {
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

    #[test]
    fn names_never_cover_anything() {
        let page = Boxed { x0: 0.0, y0: 0.0, x1: 300.0, y1: 200.0 };
        let mut labels = Labels::within(page);
        let points: Vec<(f64, f64)> =
            (0..60).map(|k| (f64::from(k * 37 % 300), f64::from(k * 53 % 200))).collect();
        points.iter().for_each(|&(x, y)| labels.cover(Boxed::around(x, y, 4.0)));
        let placed: Vec<Boxed> = points.iter().filter_map(|&(x, y)| labels.place(x, y, 30.0)).collect();
        assert!(placed.len() > 20 && placed.len() < 60, "{}", placed.len());
        for (k, a) in placed.iter().enumerate() {
            assert!(page.holds(a));
            assert!(placed[..k].iter().all(|b| !a.meets(b)));
            assert!(points.iter().all(|&(x, y)| !a.meets(&Boxed::around(x, y, 4.0))));
        }
    }

    #[test]
    fn the_first_choice_is_to_the_right() {
        let mut labels = Labels::within(Boxed { x0: 0.0, y0: 0.0, x1: 100.0, y1: 100.0 });
        assert_eq!(labels.place(50.0, 50.0, 20.0).map(|b| (b.x0, b.y0)), Some((57.0, 43.5)));
        assert_eq!(labels.place(50.0, 50.0, 20.0).map(|b| b.x1), Some(43.0));
        assert_eq!(labels.place(50.0, 50.0, 200.0), None);
        assert_eq!(labels.place(50.0, 50.0, 0.0), None);
        assert!(text_width("Wide", 12.0) > text_width("ill.", 12.0));
    }
}
