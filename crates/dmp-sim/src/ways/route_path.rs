//! The lines of routes through the streets: which crossings, in which lane, with which curves.

use std::f64::consts::{FRAC_PI_2, PI};

use super::path::{Path, Piece};
use crate::parts::street::LANE_M;
use crate::route::{RUN_IN_M, Route};
use crate::town::{TownOptions, WALK};

/// Length of the curve round a corner, metres: its smallest radius is 4.8 m.
pub(crate) const CORNER_M: f64 = 14.0;
/// On foot, metres: 1 m.
const FOOT_CORNER_M: f64 = 3.0;

impl Route {
    /// The line of this route through `town`, at least `length_m` long.
    pub(crate) fn path(self, town: &TownOptions, travel_m: f64, length_m: f64) -> Path {
        let core = self.core(travel_m, town.block_m);
        let core = [0, 1].map(|k| core[k].min(town.blocks[k].saturating_sub(1)).max(1));
        // The ring of blocks around the route, where the town has one.
        let first = [0, 1].map(|k| usize::from(town.blocks[k] > core[k]));
        let node = |i: usize, j: usize| [i as f64 * town.block_m[0], j as f64 * town.block_m[1]];
        let [i0, j0] = first;
        let [i1, j1] = [i0 + core[0], j0 + core[1]];
        match self {
            Self::Loop | Self::TwoLaps | Self::Ring => {
                // From the middle of the southern side round to it again.
                let middle = [0, 1].map(|k| f64::midpoint(node(i0, j0)[k], node(i1, j0)[k]));
                let corners = lane(&[middle, node(i1, j0), node(i1, j1), node(i0, j1), node(i0, j0), middle]);
                Path::new(corners[0], 0.0, rounded(&corners, CORNER_M).into_iter().cycle(), length_m)
            }
            Self::OutAndBack => {
                there_and_back(&[west_of(node(i0, j0)), node(i1, j0), node(i1, j1)], length_m)
            }
            Self::Straight => there_and_back(&[west_of(node(i0, j0)), node(i1, j0)], length_m),
            Self::OneWay => {
                let mut nodes = vec![west_of(node(i0, j0))];
                for (leg, j) in (j0..=j1).enumerate() {
                    let ends = if leg % 2 == 0 { [i0, i1] } else { [i1, i0] };
                    nodes.extend(ends.map(|i| node(i, j)));
                }
                // The first crossing is passed straight on.
                nodes.remove(1);
                let corners = lane(&nodes);
                Path::new(corners[0], 0.0, rounded(&corners, CORNER_M), length_m)
            }
            Self::Campus => {
                let pieces = rounded(&WALK, FOOT_CORNER_M);
                Path::new(WALK[0], 0.0, pieces.into_iter().cycle(), length_m)
            }
        }
    }
}

fn west_of([x, y]: [f64; 2]) -> [f64; 2] {
    [x - RUN_IN_M, y]
}

/// Along `nodes`, the first leg to the east, round in the middle of the last of them, and back in the opposite lane.
fn there_and_back(nodes: &[[f64; 2]], length_m: f64) -> Path {
    let out = lane(nodes);
    let (u_turn, before_m) = u_turn();
    let mut there = rounded(&out, CORNER_M);
    shorten_last(&mut there, before_m);
    let back: Vec<_> = nodes.iter().rev().copied().collect();
    let mut home = rounded(&lane(&back), CORNER_M);
    if let Some(first) = home.first_mut() {
        first.length_m -= before_m;
    }
    Path::new(out[0], 0.0, there.into_iter().chain(u_turn).chain(home), length_m)
}

pub(crate) fn corner(length_m: f64, sign: f64) -> Piece {
    Piece { length_m, turn_rad: sign * FRAC_PI_2 }
}

/// From the middles of the streets to the right-hand lanes: where the lanes of two legs, at right angles,
/// cross. Both offsets add up there, each along its own axis.
pub(crate) fn lane(nodes: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let right = |a: [f64; 2], b: [f64; 2]| {
        let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
        let length = libm::hypot(dx, dy);
        [dy / length * LANE_M, -dx / length * LANE_M]
    };
    let legs: Vec<_> = nodes.windows(2).map(|pair| right(pair[0], pair[1])).collect();
    let of_node = |n: usize| match (n.checked_sub(1).map(|before| legs[before]), legs.get(n)) {
        (Some(before), Some(after)) => [before[0] + after[0], before[1] + after[1]],
        (Some(only), None) => only,
        (None, only) => only.copied().unwrap_or_default(),
    };
    nodes.iter().enumerate().map(|(n, node)| [0, 1].map(|k| node[k] + of_node(n)[k])).collect()
}

/// Straights and curves along a line of corners at right angles, from the first to the last.
fn rounded(corners: &[[f64; 2]], corner_m: f64) -> Vec<Piece> {
    let reach = corner(corner_m, 1.0).end()[0];
    let legs: Vec<_> = corners.windows(2).map(|p| [p[1][0] - p[0][0], p[1][1] - p[0][1]]).collect();
    let mut pieces = Vec::new();
    for (n, leg) in legs.iter().enumerate() {
        let curves = f64::from(n > 0) + f64::from(n + 1 < legs.len());
        let length_m = (libm::hypot(leg[0], leg[1]) - curves * reach).max(0.1);
        pieces.push(Piece { length_m, turn_rad: 0.0 });
        if let Some(next) = legs.get(n + 1) {
            pieces.push(corner(corner_m, (leg[0] * next[1] - leg[1] * next[0]).signum()));
        }
    }
    pieces
}

fn shorten_last(pieces: &mut [Piece], by_m: f64) {
    if let Some(last) = pieces.last_mut() {
        last.length_m = (last.length_m - by_m).max(0.1);
    }
}

/// Turns into the opposite lane: a swing to the right, then all round to the left, then straightened.
/// Also how far before the crossing it starts, so that it lies in the middle of it.
fn u_turn() -> ([Piece; 3], f64) {
    // Lengths in shares of a turn of 1 rad; the smallest radius becomes 2.4 m.
    let (swing, swing_length) = (0.2, 0.35);
    let round = PI + 2.0 * swing;
    let pieces = |scale: f64| {
        let piece = |turn_rad: f64, share: f64| Piece { length_m: scale * round * share, turn_rad };
        [piece(-swing, swing_length), piece(round, 1.0), piece(-swing, swing_length)]
    };
    // How far to the left it ends at scale 1; all lengths grow with the scale. The middle of the round is
    // twice as far ahead as the end of the swing.
    let (mut at, mut heading, mut ahead) = ([0.0, 0.0], 0.0, 0.0);
    for piece in pieces(1.0) {
        let (sin, cos) = libm::sincos(heading);
        let [x, y] = piece.end();
        at = [at[0] + cos * x - sin * y, at[1] + sin * x + cos * y];
        heading += piece.turn_rad;
        ahead = f64::max(ahead, at[0]);
    }
    let scale = 2.0 * LANE_M / at[1];
    (pieces(scale), 2.0 * scale * ahead)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn town(route: Route, travel_m: f64) -> TownOptions {
        let options = TownOptions::default();
        TownOptions { blocks: route.blocks(travel_m, options.block_m), ..options }
    }

    /// Distance from the middle of the nearest street.
    fn off_street(town: &TownOptions, x: f64, y: f64) -> f64 {
        let off = |at: f64, pitch: f64| (at - (at / pitch).round() * pitch).abs();
        off(x, town.block_m[0]).min(off(y, town.block_m[1]))
    }

    #[test]
    fn every_route_keeps_to_the_streets_and_to_the_right() {
        for route in
            [Route::Loop, Route::TwoLaps, Route::Ring, Route::OutAndBack, Route::Straight, Route::OneWay]
        {
            for travel_m in [100.0, 400.0, 900.0] {
                let town = town(route, travel_m);
                let path = route.path(&town, travel_m, travel_m);
                let mut in_lane = 0;
                for k in 0..travel_m as usize {
                    let at = path.at(k as f64);
                    let off = off_street(&town, at.x, at.y);
                    assert!(off < 4.4, "{route:?} {travel_m} m: {off} m off the street after {k} m");
                    in_lane += usize::from((off - LANE_M).abs() < 0.01);
                }
                let share = in_lane as f64 / travel_m;
                assert!(share > 0.3, "{route:?} {travel_m} m: {share} in lane");
            }
        }
    }

    #[test]
    fn round_routes_close_after_their_share_of_the_travel() {
        let shares = [(Route::Loop, 0.55..0.78), (Route::TwoLaps, 0.4..0.6), (Route::Ring, 0.85..1.08)];
        for (route, expected) in shares {
            for travel_m in [300.0, 500.0, 2000.0] {
                let town = town(route, travel_m);
                let path = route.path(&town, travel_m, 2.0 * travel_m);
                let start = path.at(0.0);
                let lap_m = (100..(2.0 * travel_m) as usize)
                    .map(|s| s as f64)
                    .find(|&s| libm::hypot(path.at(s).x - start.x, path.at(s).y - start.y) < 1.0)
                    .unwrap();
                assert!(expected.contains(&(lap_m / travel_m)), "{route:?} {travel_m}: lap {lap_m}");
            }
        }
    }

    #[test]
    fn the_way_back_is_in_the_opposite_lane() {
        for route in [Route::OutAndBack, Route::Straight] {
            let town = town(route, 300.0);
            let path = route.path(&town, 300.0, 350.0);
            let out = path.at(5.0);
            let places = (200..1400).map(|k| path.at(f64::from(k) * 0.25));
            let nearest = places.map(|p| libm::hypot(p.x - out.x, p.y - out.y)).fold(f64::INFINITY, f64::min);
            assert!((nearest - 2.0 * LANE_M).abs() < 0.1, "{route:?}: {nearest}");
        }
    }
}
