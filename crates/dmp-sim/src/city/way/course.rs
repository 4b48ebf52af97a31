//! The line of a drive through a city and when each of its points is passed, in closed form: a few dozen bytes
//! a corner.

use std::f64::consts::FRAC_PI_2;

use crate::random::Random;
use crate::ways::{FORWARD_M_S2, Path, Piece, SIDEWAYS_M_S2, Station, WAVER};

/// Where a curve starts.
const STRAIGHT: Station = Station { x: 0.0, y: 0.0, heading_rad: 0.0, curvature: 0.0 };

/// A straight leg and the curve after it.
#[derive(Debug, Clone, Copy)]
struct Leg {
    /// Path length and time from the start of the line to the start of the leg.
    start_m: f64,
    start_s: f64,
    at: [f64; 2],
    /// Quarter turns to the left from east, counted on.
    quarters: i32,
    length_m: f64,
    /// To the left (1) or right (−1) after it; 0 at the end.
    turn: i32,
    /// Speed at its start, at most, and at its end.
    speeds_m_s: [f64; 3],
}

/// A smooth line along right-angled corners.
#[derive(Debug, Clone)]
pub(crate) struct Course {
    legs: Vec<Leg>,
    corner: Piece,
    /// The curve to the left from the origin, heading east.
    curve: Path,
    curve_m_s: f64,
}

impl Course {
    /// Along `corners`, with curves of such a `corner`, at about `speed_m_s` where it is straight.
    pub(crate) fn new(corners: &[[f64; 2]], corner: Piece, speed_m_s: f64, random: &mut Random) -> Self {
        // The largest curvature of a piece is 15/8 of its mean.
        let curvature = corner.turn_rad * 1.875 / corner.length_m;
        let slowest = speed_m_s * (1.0 - WAVER);
        let curve_m_s = libm::sqrt(SIDEWAYS_M_S2 / curvature).min(slowest);
        let curve = Path::new([0.0; 2], 0.0, [corner], corner.length_m);
        let reach_m = corner.end()[0];
        let steps: Vec<[f64; 2]> =
            corners.windows(2).map(|pair| [0, 1].map(|k| pair[1][k] - pair[0][k])).collect();
        let (mut start_m, mut start_s, mut quarters) = (0.0, 0.0, 0);
        let mut legs = Vec::with_capacity(steps.len());
        for (n, step) in steps.iter().enumerate() {
            let length_m = step[0].abs() + step[1].abs();
            let unit = step.map(|s| s / length_m);
            if n == 0 {
                quarters =
                    [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]].iter().position(|u| *u == unit).unwrap_or(3) as i32;
            }
            let turn =
                steps.get(n + 1).map_or(0, |next| (step[0] * next[1] - step[1] * next[0]).signum() as i32);
            let cut_m = if n > 0 { reach_m } else { 0.0 };
            let end_cut_m = if turn == 0 { 0.0 } else { reach_m };
            let wanted = speed_m_s * (1.0 + random.between(-WAVER, WAVER));
            let leg = Leg {
                start_m,
                start_s,
                at: [0, 1].map(|k| corners[n][k] + unit[k] * cut_m),
                quarters,
                length_m: (length_m - cut_m - end_cut_m).max(0.1),
                turn,
                speeds_m_s: [
                    if n > 0 { curve_m_s } else { wanted },
                    wanted,
                    if turn == 0 { wanted } else { curve_m_s },
                ],
            };
            let leg = leg.within_reach();
            start_s += leg.duration_s();
            start_m += leg.length_m;
            if turn != 0 {
                start_s += corner.length_m / curve_m_s;
                start_m += corner.length_m;
            }
            quarters += turn;
            legs.push(leg);
        }
        Self { legs, corner, curve, curve_m_s }
    }

    /// Length of the line, metres.
    #[cfg(test)]
    fn length_m(&self) -> f64 {
        self.legs.last().map_or(0.0, |leg| leg.start_m + leg.length_m)
    }

    /// When the point after `path_m` is passed, seconds after the start of the line.
    pub(crate) fn time_s(&self, path_m: f64) -> f64 {
        let Some(leg) = self.leg(|leg| leg.start_m <= path_m) else { return 0.0 };
        let along_m = path_m - leg.start_m;
        if along_m <= leg.length_m {
            leg.time_s(along_m.max(0.0))
        } else {
            leg.duration_s() + (along_m - leg.length_m) / self.curve_m_s
        }
        .max(0.0)
            + leg.start_s
    }

    /// How far the line has been followed after `time_s`, and where that is. Clamped to the ends.
    pub(crate) fn at(&self, time_s: f64) -> (f64, Station) {
        let Some(leg) = self.leg(|leg| leg.start_s <= time_s) else { return (0.0, STRAIGHT) };
        let since_s = (time_s - leg.start_s).max(0.0);
        let straight_s = leg.duration_s();
        let (straight_m, curve_m) = if since_s <= straight_s {
            (leg.path_m(since_s), 0.0)
        } else {
            (leg.length_m, ((since_s - straight_s) * self.curve_m_s).min(self.corner.length_m))
        };
        let ahead = if leg.turn == 0 { STRAIGHT } else { self.curve.at(curve_m) };
        let side = f64::from(leg.turn);
        // Quarter turns are exact.
        let (sin, cos) =
            [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][leg.quarters.rem_euclid(4) as usize];
        let (u, v) = (straight_m + ahead.x, side * ahead.y);
        let station = Station {
            x: leg.at[0] + cos * u - sin * v,
            y: leg.at[1] + sin * u + cos * v,
            heading_rad: f64::from(leg.quarters) * FRAC_PI_2 + side * ahead.heading_rad,
            curvature: side * ahead.curvature,
        };
        (leg.start_m + straight_m + curve_m, station)
    }

    /// The last leg of which `begun` is true, or the first.
    fn leg(&self, begun: impl Fn(&Leg) -> bool) -> Option<&Leg> {
        self.legs.get(self.legs.partition_point(begun).saturating_sub(1))
    }
}

impl Leg {
    /// Lowers the speeds to what the length of the leg allows.
    fn within_reach(mut self) -> Self {
        let [first, most, last] = self.speeds_m_s.map(|v| v * v);
        let gain = 2.0 * FORWARD_M_S2 * self.length_m;
        let most = most.min((gain + first + last) / 2.0).max(first.max(last));
        self.speeds_m_s[1] = libm::sqrt(most);
        self
    }

    /// Path length and time of speeding up, and of slowing down.
    fn ramps(&self) -> [(f64, f64); 2] {
        let [first, most, last] = self.speeds_m_s;
        [first, last].map(|v| ((most * most - v * v) / (2.0 * FORWARD_M_S2), (most - v) / FORWARD_M_S2))
    }

    fn duration_s(&self) -> f64 {
        let [(up_m, up_s), (down_m, down_s)] = self.ramps();
        up_s + down_s + (self.length_m - up_m - down_m).max(0.0) / self.speeds_m_s[1]
    }

    fn path_m(&self, since_s: f64) -> f64 {
        let [first, most, last] = self.speeds_m_s;
        let [(up_m, up_s), (_, down_s)] = self.ramps();
        let left_s = self.duration_s() - since_s;
        if since_s < up_s {
            since_s * (first + 0.5 * FORWARD_M_S2 * since_s)
        } else if left_s < down_s {
            self.length_m - left_s * (last + 0.5 * FORWARD_M_S2 * left_s)
        } else {
            up_m + (since_s - up_s) * most
        }
    }

    fn time_s(&self, along_m: f64) -> f64 {
        let [first, most, last] = self.speeds_m_s;
        let [(up_m, up_s), (down_m, _)] = self.ramps();
        let ramp_s =
            |v: f64, path_m: f64| (libm::sqrt(v * v + 2.0 * FORWARD_M_S2 * path_m) - v) / FORWARD_M_S2;
        let left_m = self.length_m - along_m;
        if along_m < up_m {
            ramp_s(first, along_m)
        } else if left_m < down_m {
            self.duration_s() - ramp_s(last, left_m)
        } else {
            up_s + (along_m - up_m) / most
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course() -> Course {
        let corners = [[0.0, 0.0], [200.0, 0.0], [200.0, 90.0], [120.0, 90.0], [120.0, 300.0]];
        Course::new(&corners, Piece { length_m: 14.0, turn_rad: FRAC_PI_2 }, 10.0, &mut Random::new(1, &[]))
    }

    #[test]
    fn the_line_is_as_long_as_it_says_and_passed_in_time() {
        let course = course();
        let end_s = course.time_s(course.length_m());
        let (mut travel_m, mut before) = (0.0, course.at(0.0));
        for k in 1..=20_000 {
            let now = course.at(end_s * f64::from(k) / 20_000.0);
            let step_m = libm::hypot(now.1.x - before.1.x, now.1.y - before.1.y);
            travel_m += step_m;
            assert!((now.0 - travel_m).abs() < 1e-3, "{} {travel_m}", now.0);
            assert!((course.time_s(now.0) - end_s * f64::from(k) / 20_000.0).abs() < 1e-6);
            let heading = libm::atan2(now.1.y - before.1.y, now.1.x - before.1.x);
            let off = (heading - now.1.heading_rad).rem_euclid(std::f64::consts::TAU);
            assert!(off.min(std::f64::consts::TAU - off) < 2e-3, "{k}: {heading} {now:?}");
            before = now;
        }
        assert!((travel_m - course.length_m()).abs() < 1e-3);
    }
}
