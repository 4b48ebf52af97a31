//! Which crossings a drive through a city turns at.

use crate::city::plan::{PITCH_M, Plan};

/// Approximate distance between one round and the next, metres.
const STAGE_M: f64 = 3000.0;
/// Blocks that are driven straight on between two rounds, at most.
const STRAIGHT: usize = 4;

const EAST: [i64; 2] = [1, 0];
const NORTH: [i64; 2] = [0, 1];

/// A line along streets.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tour {
    /// Middles of the first crossing, of all those at which it turns, and of the last, metres.
    pub(crate) corners: Vec<[f64; 2]>,
    /// Share of the requested path length that is driven twice or more, in the same lane.
    pub(crate) revisited: f64,
}

/// Rounds, and paths to new ground between them.
///
/// Every stage is round a rectangle of blocks, some laps and half a lap more, so that it ends at the corner
/// opposite to its start; then up a staircase of streets to new ground. All that follows lies north-east of
/// it. Without revisits it is the staircase alone: two places of it lie at least 1/√2 of the path between
/// them apart.
struct Walker {
    plan: Plan,
    node: [i64; 2],
    /// Steps of the last leg, to merge legs that go on straight.
    heading: Option<[i64; 2]>,
    corners: Vec<[f64; 2]>,
    wanted_m: f64,
    length_m: f64,
    revisited_m: f64,
}

impl Walker {
    fn done(&self) -> bool {
        self.length_m >= self.wanted_m
    }

    fn go(&mut self, heading: [i64; 2], blocks: usize, again: bool) {
        for _ in 0..blocks {
            let from = self.plan.crossing(self.node);
            self.node = [0, 1].map(|k| self.node[k] + heading[k]);
            let to = self.plan.crossing(self.node);
            let step_m = (to[0] - from[0]).abs() + (to[1] - from[1]).abs();
            if again {
                self.revisited_m += step_m.min((self.wanted_m - self.length_m).max(0.0));
            }
            self.length_m += step_m;
            if self.heading == Some(heading) {
                self.corners.pop();
            }
            self.heading = Some(heading);
            self.corners.push(to);
        }
    }
}

/// A tour of at least `length_m`, and one leg more; `share` of it is driven for a second time.
pub(crate) fn tour(plan: Plan, length_m: f64, share: f64) -> Tour {
    let mut random = plan.random(b'r', &[]);
    let mut walker = Walker {
        plan,
        node: [0, 0],
        heading: None,
        corners: vec![plan.crossing([0, 0])],
        wanted_m: length_m,
        length_m: 0.0,
        revisited_m: 0.0,
    };
    // Of `laps` and a half, `laps` − ½ are revisits: the fewest laps with as many as are asked for.
    let mut laps = 1;
    while ((2 * laps - 1) as f64) < share * (2 * laps + 1) as f64 {
        laps += 1;
    }
    let (stages, again) = ((length_m / STAGE_M).round().max(1.0), (2 * laps - 1) as f64);
    // East and north sides together, blocks.
    let half_round = ((share * length_m / stages / again / PITCH_M).round() as usize).max(2);
    let mut staircase = 0.0;
    let mut north = false;
    while !walker.done() {
        if share > 0.0 {
            let east =
                ((half_round as f64 * random.between(0.35, 0.65)).round() as usize).clamp(1, half_round - 1);
            for half in 0..=2 * laps {
                let sign = if half % 2 == 0 { 1 } else { -1 };
                walker.go(EAST.map(|step| step * sign), east, half >= 2);
                walker.go(NORTH.map(|step| step * sign), half_round - east, half >= 2);
            }
            staircase += (again / share - (2 * laps + 1) as f64) * half_round as f64;
        } else {
            staircase = f64::INFINITY;
        }
        while staircase >= 1.0 && !walker.done() {
            let blocks = (1 + random.index(STRAIGHT)).min(staircase as usize);
            walker.go(if north { NORTH } else { EAST }, blocks, false);
            staircase -= blocks as f64;
            north = !north;
        }
    }
    // Two blocks more: the line continues beyond the end.
    walker.go(walker.heading.unwrap_or(EAST), 2, false);
    Tour { revisited: walker.revisited_m / length_m, corners: walker.corners }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tour_needs_little_memory() {
        let tour = tour(Plan { seed: 4 }, 1e6, 0.3);
        assert!(tour.corners.len() < 10_000, "{} corners for 1000 km", tour.corners.len());
    }
}
