//! The errors with which the scans fit together best, and how well that is known.

use dmp_reduce::Confidence;
use rayon::prelude::*;

use crate::calibrate::axis::{AXES, Axis, Matrix, Vector};
use crate::calibrate::mount::{Mount, Trial};
use crate::calibrate::planes::{Buffers, Equations, Level, equations};
use crate::calibrate::sample::Block;

/// From far to near: cells of 2 m, of 1 m; times the metre.
const LEVELS: [(Level, usize); 3] = [
    (Level { edge_m: 2.0, thick_m: 0.5, every: 4, derives: true }, 5),
    (Level { edge_m: 1.0, thick_m: 0.2, every: 2, derives: true }, 4),
    (Level { edge_m: 1.0, thick_m: 0.1, every: 1, derives: true }, 4),
];
/// How far a step may go, in units of each axis.
const LONGEST_STEP: f64 = 30.0;
/// After a step shorter than this, in such units, one looks closer: 5 ms, 0.05°, 5 mm.
const NEARER: f64 = 0.5;
/// A step shorter than this is none: 0.2 ms, 0.002°, 0.2 mm.
const CONVERGED: f64 = 0.02;
/// A return's distance from its plane says little by itself: neighbours are off alike. What is known beforehand counts as
/// this many returns.
const RETURNS_ALIKE: f64 = 100.0;

/// The best errors of a model, with their scatter.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub(crate) steps: Vector,
    /// Half of each interval.
    pub(crate) half_steps: Vector,
    /// Mean square distance from the planes, m², without these errors taken away and with.
    pub(crate) before_m2: f64,
    pub(crate) after_m2: f64,
    /// By how much about the sum of squares would grow without each of them, the others then being as good as they can be.
    pub(crate) gains: Vector,
}

/// Mean square distance from the planes, m², with these errors taken away; `None` where there are no planes.
pub(crate) fn thickness_m2(blocks: &[Block], mount: &Mount<'_>, metre_m: f64, steps: &Vector) -> Option<f64> {
    let all = total(&of_blocks_at_finest(blocks, mount, metre_m, steps));
    (all.weight > 0.0).then(|| all.squares_m2 / all.weight)
}

/// The thickness sums of each block with these errors taken away.
pub(crate) fn of_blocks_at_finest(
    blocks: &[Block],
    mount: &Mount<'_>,
    metre_m: f64,
    steps: &Vector,
) -> Vec<Equations> {
    let [.., (finest, _)] = levels(metre_m);
    of_blocks(blocks, mount, metre_m, steps, Level { derives: false, ..finest })
}

fn levels(metre_m: f64) -> [(Level, usize); LEVELS.len()] {
    LEVELS.map(|(level, rounds)| {
        (Level { edge_m: level.edge_m * metre_m, thick_m: level.thick_m * metre_m, ..level }, rounds)
    })
}

fn of_blocks(
    blocks: &[Block],
    mount: &Mount<'_>,
    metre_m: f64,
    steps: &Vector,
    level: Level,
) -> Vec<Equations> {
    let trial = Trial::new(mount, steps, metre_m);
    let of_block = |buffers: &mut Buffers, block| equations(block, &trial, level, metre_m, buffers);
    blocks.par_iter().map_init(Buffers::default, of_block).collect()
}

/// Looks for the errors of those axes that `free` names, from `start` on.
pub(crate) fn fit(
    blocks: &[Block],
    mount: &Mount<'_>,
    metre_m: f64,
    free: [bool; AXES],
    start: Vector,
    confidence: Confidence,
) -> Option<Fitted> {
    let mut steps = start;
    let at = |steps: &Vector, level: Level| of_blocks(blocks, mount, metre_m, steps, level);
    let next_step = |of_blocks: &[Equations], steps: &Vector| {
        let all = total(of_blocks);
        let noise_m2 = all.squares_m2 / all.weight.max(1.0);
        if noise_m2 <= 0.0 || noise_m2.is_nan() {
            return None;
        }
        let step = System::new(&all, noise_m2, free).solve(&all.gradient, steps)?;
        Some(step.map(|s| s.clamp(-LONGEST_STEP, LONGEST_STEP)))
    };
    let [coarse @ .., (level, rounds)] = levels(metre_m);
    for (level, rounds) in coarse {
        for _ in 0..rounds {
            let step = next_step(&at(&steps, level), &steps)?;
            steps -= step;
            if step.amax() < NEARER {
                break;
            }
        }
    }
    let mut of_blocks = at(&steps, level);
    for _ in 0..rounds {
        let step = next_step(&of_blocks, &steps)?;
        if step.amax() < CONVERGED {
            break;
        }
        steps -= step;
        of_blocks = at(&steps, level);
    }
    let all = total(&of_blocks);
    let noise_m2 = all.squares_m2 / all.weight.max(1.0);
    let system = System::new(&all, noise_m2, free);
    let half_steps = system.half_interval(&of_blocks, &steps, confidence)?;
    let inverse = system.inverse(&Matrix::zeros())?;
    let gains = Vector::from_fn(|k, _| steps[k] * steps[k] / inverse[(k, k)]);
    let given = total(&at(&Vector::zeros(), Level { derives: false, ..level }));
    Some(Fitted {
        steps,
        half_steps,
        before_m2: given.squares_m2 / given.weight.max(1.0),
        after_m2: noise_m2,
        gains,
    })
}

fn total(of_blocks: &[Equations]) -> Equations {
    let mut all = Equations::default();
    of_blocks.iter().for_each(|block| all.add(block));
    all
}

/// (Σ J Jᵀ + Λ) step = Σ J r + Λ θ, in the axes that are free.
struct System {
    hessian: Matrix,
    prior: Vector,
    free: [bool; AXES],
}

impl System {
    fn new(all: &Equations, noise_m2: f64, free: [bool; AXES]) -> Self {
        let prior = Vector::from_fn(|k, _| {
            let sd = Axis::ALL[k].prior_steps();
            RETURNS_ALIKE * noise_m2 / (sd * sd)
        });
        Self { hessian: all.hessian, prior, free }
    }

    /// The inverse of what is left when `without` is taken away.
    fn inverse(&self, without: &Matrix) -> Option<Matrix> {
        let mut matrix = self.hessian - without;
        for k in 0..AXES {
            matrix[(k, k)] += self.prior[k];
            if !self.free[k] {
                matrix.row_mut(k).fill(0.0);
                matrix.column_mut(k).fill(0.0);
                matrix[(k, k)] = 1.0;
            }
        }
        Some(matrix.cholesky()?.inverse())
    }

    fn held(&self, mut vector: Vector) -> Vector {
        for k in 0..AXES {
            if !self.free[k] {
                vector[k] = 0.0;
            }
        }
        vector
    }

    fn solve(&self, gradient: &Vector, steps: &Vector) -> Option<Vector> {
        let pull = self.prior.component_mul(steps);
        Some(self.inverse(&Matrix::zeros())? * self.held(gradient + pull))
    }

    /// Half of each axis' interval: the jackknife over blocks, whose errors have nothing to do with each other, and what the
    /// scans do not show as wide as it was before.
    fn half_interval(
        &self,
        of_blocks: &[Equations],
        steps: &Vector,
        confidence: Confidence,
    ) -> Option<Vector> {
        let blocks: Vec<&Equations> = of_blocks.iter().filter(|block| block.weight > 0.0).collect();
        let count = blocks.len() as f64;
        if blocks.len() < 3 {
            return None;
        }
        let all = total(of_blocks);
        let pull = self.prior.component_mul(steps);
        // One step from the solution without each of them.
        let without = |block: &&Equations| {
            Some(self.inverse(&block.hessian)? * self.held(all.gradient - block.gradient + pull))
        };
        let moved: Vec<Vector> = blocks.iter().map(without).collect::<Option<_>>()?;
        let mean = moved.iter().sum::<Vector>() / count;
        let (mut variance, mut fourth) = (Vector::zeros(), Vector::zeros());
        for one in &moved {
            let square = (one - mean).component_mul(&(one - mean));
            variance += square * ((count - 1.0) / count);
            fourth += square.component_mul(&square);
        }
        let inverse = self.inverse(&Matrix::zeros())?;
        Some(Vector::from_fn(|k, _| {
            // As many blocks as carry the sum; fewer degrees of freedom where few do.
            let share = ((count - 1.0) / count) * ((count - 1.0) / count);
            let carried = if fourth[k] > 0.0 { variance[k] * variance[k] / (share * fourth[k]) } else { 1.0 };
            let degrees = (carried - 1.0).clamp(1.0, count - 1.0).floor() as u64;
            let unknown: f64 = (0..AXES)
                .filter(|&l| self.free[l])
                .map(|l| {
                    let part = inverse[(k, l)] * self.prior[l] * Axis::ALL[l].prior_steps();
                    part * part
                })
                .sum();
            let scatter = confidence.student_t(degrees.max(1)) * variance[k].sqrt();
            let unknown = confidence.student_t(400) * unknown.sqrt();
            (scatter * scatter + unknown * unknown).sqrt()
        }))
    }
}
