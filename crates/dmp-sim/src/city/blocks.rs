//! The blocks of a city around a stretch of its road, made when they come into reach and dropped behind.

use std::collections::BTreeMap;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::city::block;
use crate::city::form::Form;
use crate::city::plan::{JITTER_M, PITCH_M, Plan};

/// Nothing of a block lies farther than this outside its four crossings, metres.
const OVERHANG_M: f64 = 16.0;
/// Forms of a square of this size lie together, metres.
const SQUARE_M: f64 = 12.0;

/// Forms that lie together, and the box around them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cluster {
    pub(crate) centre: [f32; 3],
    pub(crate) reach: [f32; 3],
    pub(crate) forms: Vec<Form>,
}

/// One block.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Block {
    /// Its south-western crossing, metres; the origin of its forms.
    pub(crate) corner: [f64; 2],
    pub(crate) clusters: Vec<Cluster>,
}

impl Block {
    /// Made of the plan and the cell alone.
    pub(crate) fn new(plan: Plan, cell: [i64; 2]) -> Self {
        let corner = plan.crossing(cell);
        let mut squares: BTreeMap<[i64; 2], Vec<Form>> = BTreeMap::new();
        for solid in block::build(plan, cell) {
            let form = Form::new(&solid, corner);
            let square = [0, 1].map(|k| (f64::from(form.centre[k]) / SQUARE_M).floor() as i64);
            squares.entry(square).or_default().push(form);
        }
        Self { corner, clusters: squares.into_values().map(Cluster::new).collect() }
    }
}

impl Cluster {
    fn new(forms: Vec<Form>) -> Self {
        let edge = |k: usize, sign: f32| {
            forms.iter().map(|form| form.centre[k] * sign + form.reach[k]).fold(f32::NEG_INFINITY, f32::max)
                * sign
        };
        let (low, high) = ([0, 1, 2].map(|k| edge(k, -1.0)), [0, 1, 2].map(|k| edge(k, 1.0)));
        Self {
            centre: [0, 1, 2].map(|k| f32::midpoint(low[k], high[k])),
            reach: [0, 1, 2].map(|k| (high[k] - low[k]) / 2.0),
            forms,
        }
    }
}

/// The blocks in reach, by cell.
#[derive(Debug, Clone)]
pub(crate) struct Blocks {
    plan: Plan,
    blocks: BTreeMap<[i64; 2], Block>,
}

/// The cells that have anything within `reach_m` of a place, as ranges along both axes.
pub(crate) fn cells_around([x, y]: [f64; 2], reach_m: f64) -> [std::ops::RangeInclusive<i64>; 2] {
    let margin_m = reach_m + JITTER_M + OVERHANG_M;
    [x, y].map(|at| {
        let index = |at: f64| (at / PITCH_M).floor() as i64;
        // A block reaches from its own crossing to the next.
        index(at - margin_m) - 1..=index(at + margin_m) + 1
    })
}

impl Blocks {
    pub(crate) fn new(plan: Plan) -> Self {
        Self { plan, blocks: BTreeMap::new() }
    }

    /// Keeps what lies within `reach_m` of any of the places, and nothing else.
    pub(crate) fn keep_around(&mut self, places: impl Iterator<Item = [f64; 2]>, reach_m: f64) {
        let mut wanted = std::collections::BTreeSet::new();
        for place in places {
            let [east, north] = cells_around(place, reach_m);
            wanted.extend(east.flat_map(|i| north.clone().map(move |j| [i, j])));
        }
        self.blocks.retain(|cell, _| wanted.contains(cell));
        let missing: Vec<_> = wanted.into_iter().filter(|cell| !self.blocks.contains_key(cell)).collect();
        let plan = self.plan;
        let made: Vec<_> = missing.into_par_iter().map(|cell| (cell, Block::new(plan, cell))).collect();
        self.blocks.extend(made);
    }

    /// The blocks within reach of a place, in the order of their cells.
    pub(crate) fn around(&self, place: [f64; 2], reach_m: f64) -> impl Iterator<Item = &Block> {
        let [east, north] = cells_around(place, reach_m);
        let cells = [*east.start(), *north.start()]..=[*east.end(), *north.end()];
        self.blocks.range(cells).filter(move |(cell, _)| north.contains(&cell[1])).map(|(_, block)| block)
    }

    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.blocks.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_made_on_the_way_are_those_made_alone_and_few_are_held() {
        let plan = Plan { seed: 6 };
        let mut blocks = Blocks::new(plan);
        let mut most = 0;
        for k in 0..60 {
            let place = [f64::from(k) * 40.0, f64::from(k) * -15.0];
            blocks.keep_around([place].into_iter(), 100.0);
            most = most.max(blocks.len());
        }
        assert!((9..=36).contains(&most), "{most}");
        for (cell, block) in &blocks.blocks {
            assert_eq!(*block, Block::new(plan, *cell));
        }
        let all: usize =
            blocks.blocks.values().flat_map(|block| &block.clusters).map(|c| c.forms.len()).sum();
        assert!(all > 5000, "{all}");
    }
}
