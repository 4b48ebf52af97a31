//! Which crossings a drive through a city turns at.

use crate::city::plan::{PITCH_M, Plan};

/// About so much of the way passes between one round and the next, metres.
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
    /// The share of the way asked for that is driven for a second time or more, in the same lane.
    pub(crate) revisited: f64,
}

/// Rounds, and ways to new ground between them.
///
/// Every stage is round a rectangle of blocks, some laps and half a lap more, so that it ends at the corner
/// opposite to its start; then up a staircase of streets to new ground. All that follows lies north-east of
/// it. Without revisits it is the staircase alone: two places of it lie at least 1/√2 of the way between
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
    // Whatever the last step was, it goes on beyond the end.
    walker.go(walker.heading.unwrap_or(EAST), 2, false);
    Tour { revisited: walker.revisited_m / length_m, corners: walker.corners }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_at_right_angles_and_as_much_is_driven_again_as_asked() {
        for (length_m, share) in
            [(20e3, 0.0), (20e3, 0.1), (20e3, 0.3), (50e3, 0.333), (50e3, 0.5), (100e3, 0.8)]
        {
            let tour = tour(Plan { seed: 4 }, length_m, share);
            for corner in tour.corners.windows(3) {
                let [a, b] = [0, 1].map(|n| [0, 1].map(|k| corner[n + 1][k] - corner[n][k]));
                assert_eq!(a[0] * b[0] + a[1] * b[1], 0.0);
                assert!(a[0].abs() + a[1].abs() > 60.0);
            }
            assert!((tour.revisited - share).abs() < 0.03, "{length_m} {share}: {}", tour.revisited);
        }
    }

    #[test]
    fn a_tour_needs_little_memory() {
        let tour = tour(Plan { seed: 4 }, 1e6, 0.3);
        assert!(tour.corners.len() < 10_000, "{} corners for 1000 km", tour.corners.len());
    }
}
