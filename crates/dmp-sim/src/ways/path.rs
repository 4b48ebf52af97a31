//! The line on the ground that a drive follows.

/// Distance between the stations of the table, metres.
pub(crate) const STEP_M: f64 = 0.25;

/// A stretch of the line: `turn_rad` to the left (negative: right) spread over `length_m`.
///
/// The heading follows 6u⁵ − 15u⁴ + 10u³, so that heading, curvature and its change have no jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    pub(crate) length_m: f64,
    pub(crate) turn_rad: f64,
}

impl Piece {
    /// Heading gained after the share `u` of the piece.
    fn heading_rad(&self, u: f64) -> f64 {
        self.turn_rad * smooth_step(u)
    }

    /// Turn per metre at the share `u` of the piece.
    fn curvature(&self, u: f64) -> f64 {
        let v = u * (1.0 - u);
        self.turn_rad * (30.0 * v * v) / self.length_m
    }

    /// Where a piece that starts at the origin along x ends.
    pub(crate) fn end(&self) -> [f64; 2] {
        let steps = 256;
        let du = 1.0 / f64::from(steps);
        let mut at = [0.0; 2];
        for k in 0..steps {
            let (sin, cos) = libm::sincos(self.heading_rad((f64::from(k) + 0.5) * du));
            at = [at[0] + cos * du * self.length_m, at[1] + sin * du * self.length_m];
        }
        at
    }
}

/// Rises from 0 at `u` = 0 to 1 at `u` = 1, without a jump of slope or curvature.
pub(crate) fn smooth_step(u: f64) -> f64 {
    u * u * u * (u * (6.0 * u - 15.0) + 10.0)
}

/// A point of the line, on the map plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Station {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Direction of travel, counted on through full turns.
    pub(crate) heading_rad: f64,
    /// Change of the heading per metre, positive to the left.
    pub(crate) curvature: f64,
}

/// A smooth line, known at stations `STEP_M` apart and interpolated between them.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    stations: Vec<Station>,
}

impl Path {
    /// Follows `pieces` from `start` along `heading_rad` for `length_m`; straight on after the last.
    pub(crate) fn new(
        start: [f64; 2],
        heading_rad: f64,
        pieces: impl IntoIterator<Item = Piece>,
        length_m: f64,
    ) -> Self {
        let mut pieces = pieces.into_iter();
        let straight = Piece { length_m: f64::INFINITY, turn_rad: 0.0 };
        let (mut piece, mut piece_start, mut piece_heading) =
            (pieces.next().unwrap_or(straight), 0.0, heading_rad);
        let count = (length_m / STEP_M).ceil() as usize + 2;
        let mut at = start;
        let mut stations = Vec::with_capacity(count);
        for k in 0..count {
            // Gauss's two points in each of four parts: the place is exact to 1e-9 m.
            for part in 0..8 {
                let s =
                    (k as f64 - 1.0 + (f64::from(part / 2) + 0.5 + GAUSS[part as usize % 2]) / 4.0) * STEP_M;
                if k == 0 || s < 0.0 {
                    break;
                }
                while s >= piece_start + piece.length_m {
                    piece_start += piece.length_m;
                    piece_heading += piece.turn_rad;
                    piece = pieces.next().unwrap_or(straight);
                }
                let (sin, cos) =
                    libm::sincos(piece_heading + piece.heading_rad((s - piece_start) / piece.length_m));
                at = [at[0] + cos * STEP_M / 8.0, at[1] + sin * STEP_M / 8.0];
            }
            let u = ((k as f64 * STEP_M - piece_start) / piece.length_m).clamp(0.0, 1.0);
            let heading_rad = piece_heading + piece.heading_rad(u);
            let curvature = if piece.turn_rad == 0.0 { 0.0 } else { piece.curvature(u) };
            stations.push(Station { x: at[0], y: at[1], heading_rad, curvature });
        }
        Self { stations }
    }

    pub(crate) fn stations(&self) -> &[Station] {
        &self.stations
    }

    /// The point after `travel_m`, by cubic interpolation; clamped to the ends.
    pub(crate) fn at(&self, travel_m: f64) -> Station {
        let last = self.stations.len() - 2;
        let k = (travel_m / STEP_M).clamp(0.0, last as f64) as usize;
        let u = (travel_m / STEP_M - k as f64).clamp(0.0, 1.0);
        let [a, b] = [self.stations[k], self.stations[k + 1]];
        let (tangent_a, tangent_b) = (libm::sincos(a.heading_rad), libm::sincos(b.heading_rad));
        Station {
            x: hermite(a.x, tangent_a.1, b.x, tangent_b.1, u, STEP_M),
            y: hermite(a.y, tangent_a.0, b.y, tangent_b.0, u, STEP_M),
            heading_rad: hermite(a.heading_rad, a.curvature, b.heading_rad, b.curvature, u, STEP_M),
            curvature: a.curvature + (b.curvature - a.curvature) * u,
        }
    }
}

/// Offsets of Gauss's two points from the middle of an interval of length 1.
const GAUSS: [f64; 2] = [-0.288_675_134_594_812_9, 0.288_675_134_594_812_9];

/// Cubic between two values with given derivatives, `span` apart, at the share `u` of the span.
pub(crate) fn hermite(a: f64, da: f64, b: f64, db: f64, u: f64, span: f64) -> f64 {
    let v = 1.0 - u;
    a * v * v * (1.0 + 2.0 * u) + b * u * u * (3.0 - 2.0 * u) + span * u * v * (da * v - db * u)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, TAU};

    const CORNER: Piece = Piece { length_m: 14.0, turn_rad: FRAC_PI_2 };

    #[test]
    fn a_quarter_turn_ends_on_the_diagonal() {
        let [x, y] = CORNER.end();
        assert!((x - y).abs() < 1e-9 && (8.0..9.0).contains(&x), "{x} {y}");
    }

    #[test]
    fn four_corners_close_and_laps_repeat() {
        let side = Piece { length_m: 20.0, turn_rad: 0.0 };
        let lap = [side, CORNER, side, CORNER, side, CORNER, side, CORNER];
        let path = Path::new([3.0, 4.0], 0.5, lap.into_iter().cycle(), 300.0);
        for s in [0.0, 11.1, 77.7] {
            let (first, second) = (path.at(s), path.at(s + 136.0));
            assert!(libm::hypot(first.x - second.x, first.y - second.y) < 1e-6, "{first:?} {second:?}");
            assert!((second.heading_rad - first.heading_rad - TAU).abs() < 1e-9);
        }
    }

    #[test]
    fn travel_is_length_and_heading_its_direction() {
        let path = Path::new([0.0, 0.0], 0.0, [CORNER], 30.0);
        let step = 0.01;
        for k in 0..2900 {
            let (a, b) = (path.at(f64::from(k) * step), path.at(f64::from(k + 1) * step));
            assert!((libm::hypot(b.x - a.x, b.y - a.y) / step - 1.0).abs() < 1e-4);
            let heading = libm::atan2(b.y - a.y, b.x - a.x);
            assert!((heading - f64::midpoint(a.heading_rad, b.heading_rad)).abs() < 1e-4, "{k}");
        }
    }
}
