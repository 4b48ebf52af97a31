//! Sparse symmetric systems, solved in blocks of a pose.

use super::elimination::Elimination;
use nalgebra::{Matrix6, Vector6};
use std::ops::Range;

/// Which second derivatives a system is solved with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Model {
    /// The squares of slopes alone: never negative, in no direction. The diagonal is made larger by this part of itself.
    GaussNewton(f64),
    /// All of them.
    Newton,
}

/// A sparse symmetric matrix of 6 × 6 blocks in two parts, squares of slopes and bends, and its Cholesky factor (George and
/// Liu 1981): the lower triangle by columns, in the order of elimination.
#[derive(Debug)]
pub(super) struct System {
    elimination: Elimination,
    /// By column: where its blocks begin, and where the last ends.
    starts: Vec<usize>,
    squares: Blocks,
    bends: Blocks,
    factor: Blocks,
}

/// Where two variables meet in the matrix.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting {
    slot: usize,
    /// Whether the block's rows are those of the second variable.
    second_is_row: bool,
}

#[derive(Debug, Clone)]
struct Blocks {
    diagonal: Vec<Matrix6<f64>>,
    below: Vec<Matrix6<f64>>,
}

impl System {
    /// A system of variables of which these pairs meet.
    pub(super) fn new(variables: usize, ties: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let elimination = Elimination::new(variables, ties);
        let mut starts = vec![0];
        for column in &elimination.below {
            starts.push(starts[starts.len() - 1] + column.len());
        }
        let below = vec![Matrix6::zeros(); starts[variables]];
        let zero = Blocks { diagonal: vec![Matrix6::zeros(); variables], below };
        Self { elimination, starts, squares: zero.clone(), bends: zero.clone(), factor: zero }
    }

    /// Where a pair meets; `None` for one that was not given.
    pub(super) fn meeting(&self, first: usize, second: usize) -> Option<Meeting> {
        let (a, b) = (self.elimination.place[first], self.elimination.place[second]);
        let (column, row) = (a.min(b), a.max(b));
        let at = self.elimination.below[column].binary_search(&row).ok()?;
        Some(Meeting { slot: self.starts[column] + at, second_is_row: row == b })
    }

    pub(super) fn clear(&mut self) {
        for blocks in [&mut self.squares, &mut self.bends] {
            blocks.diagonal.fill(Matrix6::zeros());
            blocks.below.fill(Matrix6::zeros());
        }
    }

    pub(super) fn add_diagonal(&mut self, variable: usize, block: &Matrix6<f64>, bend: &Matrix6<f64>) {
        self.squares.diagonal[self.elimination.place[variable]] += block;
        self.bends.diagonal[self.elimination.place[variable]] += bend;
    }

    /// Adds the block with the rows of the first and the columns of the second variable, and its transpose.
    pub(super) fn add_meeting(&mut self, meeting: Meeting, block: &Matrix6<f64>, bend: &Matrix6<f64>) {
        if meeting.second_is_row {
            self.squares.below[meeting.slot] += block.transpose();
            self.bends.below[meeting.slot] += bend.transpose();
        } else {
            self.squares.below[meeting.slot] += block;
            self.bends.below[meeting.slot] += bend;
        }
    }

    /// Solves for the right side, which becomes the solution. `None` where the matrix is not positive definite, numerically.
    pub(super) fn solve(&mut self, model: Model, right: &mut [Vector6<f64>]) -> Option<()> {
        self.factorise(model)?;
        let place = &self.elimination.place;
        let mut ordered = vec![Vector6::zeros(); right.len()];
        for (&place, value) in place.iter().zip(right.iter()) {
            ordered[place] = *value;
        }
        for column in 0..ordered.len() {
            forward(&self.factor.diagonal[column], &mut ordered[column]);
            let solved = ordered[column];
            for (&row, slot) in self.elimination.below[column].iter().zip(self.slots(column)) {
                ordered[row] -= self.factor.below[slot] * solved;
            }
        }
        for column in (0..ordered.len()).rev() {
            for (&row, slot) in self.elimination.below[column].iter().zip(self.slots(column)) {
                let known = ordered[row];
                ordered[column] -= self.factor.below[slot].tr_mul(&known);
            }
            backward(&self.factor.diagonal[column], &mut ordered[column]);
        }
        for (&place, value) in place.iter().zip(right.iter_mut()) {
            *value = ordered[place];
        }
        right.iter().all(|value| value.iter().all(|c| c.is_finite())).then_some(())
    }

    fn slots(&self, column: usize) -> Range<usize> {
        self.starts[column]..self.starts[column + 1]
    }

    /// Column by column, each taken from all later ones as soon as it is known.
    fn factorise(&mut self, model: Model) -> Option<()> {
        let Self { elimination, starts, squares, bends, factor } = self;
        factor.diagonal.copy_from_slice(&squares.diagonal);
        factor.below.copy_from_slice(&squares.below);
        if model == Model::Newton {
            factor.diagonal.iter_mut().zip(&bends.diagonal).for_each(|(a, b)| *a += b);
            factor.below.iter_mut().zip(&bends.below).for_each(|(a, b)| *a += b);
        }
        if let Model::GaussNewton(damping) = model {
            factor.diagonal.iter_mut().for_each(|block| (0..6).for_each(|k| block[(k, k)] *= 1.0 + damping));
        }
        for column in 0..factor.diagonal.len() {
            let rows = &elimination.below[column];
            factorise_block(&mut factor.diagonal[column])?;
            let diagonal = factor.diagonal[column];
            let (known, later) = factor.below.split_at_mut(starts[column + 1]);
            let blocks = &mut known[starts[column]..];
            for block in blocks.iter_mut() {
                divide(block, &diagonal);
            }
            for (at, (&target, by)) in rows.iter().zip(blocks.iter()).enumerate() {
                subtract_product(&mut factor.diagonal[target], by, by);
                let first = starts[target] - starts[column + 1];
                let mut places = elimination.below[target].iter().zip(first..);
                for (&row, block) in rows.iter().zip(blocks.iter()).skip(at + 1) {
                    // All rows below are rows of the target's column: its variable was tied to theirs.
                    let slot = places.by_ref().find(|(place, _)| **place == row)?.1;
                    subtract_product(&mut later[slot], block, by);
                }
            }
        }
        Some(())
    }
}

/// The lower Cholesky factor in the place of the matrix; what is above its diagonal means nothing.
fn factorise_block(block: &mut Matrix6<f64>) -> Option<()> {
    for k in 0..6 {
        let pivot = block[(k, k)];
        // Also where it is NaN.
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        let root = pivot.sqrt();
        block[(k, k)] = root;
        for i in k + 1..6 {
            block[(i, k)] /= root;
        }
        for j in k + 1..6 {
            let by = block[(j, k)];
            for i in j..6 {
                block[(i, j)] -= block[(i, k)] * by;
            }
        }
    }
    Some(())
}

/// `block` L⁻ᵀ, where L is the lower triangle.
fn divide(block: &mut Matrix6<f64>, lower: &Matrix6<f64>) {
    for column in 0..6 {
        for known in 0..column {
            let by = lower[(column, known)];
            for row in 0..6 {
                block[(row, column)] -= block[(row, known)] * by;
            }
        }
        for row in 0..6 {
            block[(row, column)] /= lower[(column, column)];
        }
    }
}

/// `from` − a bᵀ.
fn subtract_product(from: &mut Matrix6<f64>, a: &Matrix6<f64>, b: &Matrix6<f64>) {
    for column in 0..6 {
        for k in 0..6 {
            let by = b[(column, k)];
            for row in 0..6 {
                from[(row, column)] -= a[(row, k)] * by;
            }
        }
    }
}

/// L⁻¹ `value`.
fn forward(lower: &Matrix6<f64>, value: &mut Vector6<f64>) {
    for k in 0..6 {
        value[k] /= lower[(k, k)];
        for i in k + 1..6 {
            value[i] -= lower[(i, k)] * value[k];
        }
    }
}

/// L⁻ᵀ `value`.
fn backward(lower: &Matrix6<f64>, value: &mut Vector6<f64>) {
    for k in (0..6).rev() {
        for i in k + 1..6 {
            value[k] -= lower[(i, k)] * value[i];
        }
        value[k] /= lower[(k, k)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> u64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            self.0 >> 33
        }

        fn block(&mut self) -> Matrix6<f64> {
            Matrix6::from_fn(|_, _| self.next() as f64 / (1_u64 << 30) as f64 - 1.0)
        }
    }

    /// A system and the same as a full matrix, with bends or without: sums of (A, B)ᵀ (A, B) for each pair, more on the
    /// diagonal, and bends that are no squares.
    fn both(
        variables: usize,
        ties: &[(usize, usize)],
        model: Model,
        numbers: &mut Numbers,
    ) -> (System, DMatrix<f64>) {
        let mut system = System::new(variables, ties.iter().copied());
        let mut full = DMatrix::zeros(6 * variables, 6 * variables);
        let mut add = |a: usize, b: usize, block: &Matrix6<f64>, bend: &Matrix6<f64>| {
            let bend = if model == Model::Newton { *bend } else { Matrix6::zeros() };
            let mut view = full.view_mut((6 * a, 6 * b), (6, 6));
            view += block + bend;
        };
        for &(a, b) in ties {
            let (by_a, by_b, bend) = (numbers.block(), numbers.block(), numbers.block() * 0.01);
            let own = bend + bend.transpose();
            let [square_a, square_b, product] = [by_a.tr_mul(&by_a), by_b.tr_mul(&by_b), by_a.tr_mul(&by_b)];
            system.add_diagonal(a, &square_a, &own);
            system.add_diagonal(b, &square_b, &-own);
            let meeting = system.meeting(a, b).unwrap();
            system.add_meeting(meeting, &product, &bend);
            add(a, a, &square_a, &own);
            add(b, b, &square_b, &-own);
            add(a, b, &product, &bend);
            add(b, a, &product.transpose(), &bend.transpose());
        }
        for variable in 0..variables {
            let some = Matrix6::from_diagonal_element(0.5);
            system.add_diagonal(variable, &some, &Matrix6::zeros());
            add(variable, variable, &some, &Matrix6::zeros());
        }
        (system, full)
    }

    #[test]
    fn solutions_are_those_of_the_full_matrix() {
        let mut numbers = Numbers(5);
        for round in 0..30 {
            let variables = 1 + numbers.next() as usize % 20;
            let mut tie = || numbers.next() as usize % variables;
            let ties: Vec<(usize, usize)> =
                (0..2 * variables).map(|_| (tie(), tie())).filter(|(a, b)| a != b).collect();
            let model = [Model::Newton, Model::GaussNewton(0.0), Model::GaussNewton(0.3)][round % 3];
            let (mut system, mut full) = both(variables, &ties, model, &mut numbers);
            if let Model::GaussNewton(damping) = model {
                (0..6 * variables).for_each(|k| full[(k, k)] *= 1.0 + damping);
            }
            let mut found: Vec<Vector6<f64>> =
                (0..variables).map(|_| numbers.block().column(0).into_owned()).collect();
            let right = found.iter().flat_map(|value| value.iter().copied());
            let wanted = full.lu().solve(&DVector::from_iterator(6 * variables, right)).unwrap();
            system.solve(model, &mut found).unwrap();
            let found = found.iter().flat_map(|value| value.iter().copied());
            for (found, wanted) in found.zip(wanted.iter()) {
                assert!((found - wanted).abs() < 1e-9 * (1.0 + wanted.abs()), "{found} {wanted}");
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_fails() {
        let mut numbers = Numbers(9);
        let (mut system, _) = both(3, &[(0, 1), (1, 2)], Model::GaussNewton(0.0), &mut numbers);
        let mut right = vec![Vector6::repeat(1.0); 3];
        assert!(system.solve(Model::GaussNewton(0.0), &mut right).is_some());
        system.add_diagonal(1, &Matrix6::zeros(), &Matrix6::from_diagonal_element(-1e3));
        assert!(system.solve(Model::Newton, &mut right).is_none());
        assert!(system.solve(Model::GaussNewton(0.0), &mut right).is_some());
        system.clear();
        assert!(system.solve(Model::GaussNewton(0.0), &mut right).is_none());
        system.add_diagonal(0, &Matrix6::from_diagonal_element(f64::NAN), &Matrix6::zeros());
        assert!(system.solve(Model::GaussNewton(0.0), &mut right).is_none());
    }
}
