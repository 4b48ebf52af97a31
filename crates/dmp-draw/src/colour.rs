//! Colours that tell on white and on black, and with any eyes.

use dmp_reduce::Scales;

/// Red, green, blue.
pub(crate) type Rgb = [u8; 3];

/// From good to bad: pale blue, violet, red. What is bad is seen best, on white and on black.
const BAD: [Rgb; 5] = [[150, 178, 214], [124, 142, 210], [154, 98, 192], [204, 74, 134], [228, 48, 30]];
/// From one side to the other: blue, grey, orange.
const SIDES: [Rgb; 5] = [[20, 110, 200], [98, 152, 200], [148, 148, 148], [222, 150, 80], [222, 100, 0]];

/// Colours of maps and of the bars that explain them.
pub(crate) const STEPS: usize = 15;

/// Colours from good to bad.
pub(crate) fn bad_colours() -> [Rgb; STEPS] {
    std::array::from_fn(|step| between(&BAD, step as f64 / (STEPS - 1) as f64))
}

/// Colours from one side to the other.
pub(crate) fn side_colours() -> [Rgb; STEPS] {
    std::array::from_fn(|step| between(&SIDES, step as f64 / (STEPS - 1) as f64))
}

/// The step of a share from 0 to 1; what is beyond counts as the end.
pub(crate) fn step(share: f64) -> usize {
    ((share.clamp(0.0, 1.0) * STEPS as f64) as usize).min(STEPS - 1)
}

/// What is coloured as nothing that is known, on white and on black.
const UNKNOWN: Rgb = [120, 126, 134];
/// Lengths from this on look alike, metres.
const MOST_M: f64 = 0.5;

/// The colour of how much a map is off: from pale blue over violet to red at 0.5 m; grey where that is not known.
pub fn colour_of_size(off_m: Option<f32>, scales: Scales) -> [u8; 3] {
    let most_m = MOST_M * scales.lengths().metre_m;
    off_m.map_or(UNKNOWN, |off_m| bad_colours()[step(f64::from(off_m.abs()) / most_m)])
}

/// The colour of a signed residual: blue where the map has it half a metre behind the return, orange where in front of it, grey between
/// them, darker where nothing is predicted.
pub fn colour_of_residual(residual_m: Option<f32>, scales: Scales) -> [u8; 3] {
    let widest_m = 2.0 * MOST_M * scales.lengths().metre_m;
    residual_m.map_or(UNKNOWN, |residual_m| side_colours()[step(f64::from(residual_m) / widest_m + 0.5)])
}

/// Residuals up to the first fit; those beyond the other two are drawn darker; metres of a drive.
pub(crate) const SIZES_M: [f32; 3] = [0.1, 0.3, 1.0];
/// What returns look like that a map misses, three each, by size: with the map behind them, then with something in front of them.
pub(crate) const MISSED: [Rgb; 6] =
    [[80, 150, 220], [40, 115, 205], [20, 90, 190], [236, 140, 50], [235, 120, 40], [205, 70, 10]];

/// The number of a residual in [`MISSED`]; `None` where it fits.
pub(crate) fn missed(residual_m: f32, scales: Scales) -> Option<u8> {
    let [fits_m, large_m, largest_m] = SIZES_M.map(|m| scales.lengths().metre_m as f32 * m);
    let size_m = residual_m.abs();
    let side = if residual_m > 0.0 { 3 } else { 0 };
    // What is no number counts as the largest.
    let fits = size_m <= fits_m;
    (!fits).then(|| side + u8::from(size_m > large_m) + u8::from(size_m > largest_m))
}

/// `#rrggbb`.
pub(crate) fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn between(stops: &[Rgb], share: f64) -> Rgb {
    let at = share * (stops.len() - 1) as f64;
    let stop = (at as usize).min(stops.len() - 2);
    let part = at - stop as f64;
    std::array::from_fn(|channel| {
        let [from, to] = [stops[stop][channel], stops[stop + 1][channel]].map(f64::from);
        (from + part * (to - from)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contrast as WCAG 2 has it.
    fn contrast(a: Rgb, b: Rgb) -> f64 {
        let luminance = |rgb: Rgb| {
            let linear = rgb.map(|c| {
                let c = f64::from(c) / 255.0;
                if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
            });
            0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
        };
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn colours_are_seen_on_white_and_on_black() {
        for colour in bad_colours().into_iter().chain(side_colours()) {
            assert!(contrast(colour, [255; 3]) > 1.7, "{colour:?}");
            assert!(contrast(colour, [0x16, 0x18, 0x1c]) > 2.5, "{colour:?}");
        }
        let [_, .., worst] = bad_colours();
        let papers = [[255; 3], [0xf6, 0xf7, 0xf8], [0x16, 0x18, 0x1c], [0x1f, 0x22, 0x27]];
        assert!(papers.into_iter().all(|paper| contrast(worst, paper) > 3.0));
    }

    #[test]
    fn residuals_have_colours() {
        let [best, .., worst] = bad_colours();
        assert_eq!(
            [Some(0.0), Some(-9.0), None].map(|m| colour_of_size(m, Scales::Drive)),
            [best, worst, UNKNOWN]
        );
        let [behind, .., in_front] = side_colours();
        let found = [Some(-1.0), Some(0.0), Some(0.6), None].map(|m| colour_of_residual(m, Scales::Drive));
        assert_eq!(found, [behind, side_colours()[7], in_front, UNKNOWN]);
    }

    #[test]
    fn what_is_missed_has_a_size_and_a_side() {
        let of = |scales| [-2.0, -0.5, -0.2, -0.1, 0.05, 0.2, 0.5, 2.0].map(|m| missed(m, scales));
        let expected = [Some(2), Some(1), Some(0), None, None, Some(3), Some(4), Some(5)];
        assert_eq!(of(Scales::Drive), expected);
        assert_eq!(missed(0.02, Scales::Room), Some(3));
        assert_eq!(missed(0.02, Scales::Drive), None);
    }
}
