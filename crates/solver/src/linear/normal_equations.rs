//! Normal equations of blocks without points: summed, damped, factored, solved.

use super::{BlockPattern, BlockSolver, LinearSolver};
use crate::minimise::damping_term;
use crate::options::Damping;
use nalgebra::DVectorView;

/// What a damped step promises and how long it is; the step itself stays in the equations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DampedStep {
    /// Decrease of the cost by the quadratic model.
    pub promised: f64,
    /// Squared norm of the step.
    pub squared: f64,
}

/// A normal matrix of one pattern with its gradient, and the room to solve it in.
pub(crate) struct NormalEquations {
    pub pattern: BlockPattern,
    solver: BlockSolver,
    values: Vec<f64>,
    damped: Vec<f64>,
    gradient: Vec<f64>,
    step: Vec<f64>,
}

impl NormalEquations {
    pub fn new(pattern: BlockPattern) -> Self {
        Self {
            solver: BlockSolver::new(&pattern, LinearSolver::Auto),
            values: vec![0.0; pattern.len()],
            damped: vec![0.0; pattern.len()],
            gradient: vec![0.0; pattern.dimension()],
            step: vec![0.0; pattern.dimension()],
            pattern,
        }
    }

    /// The same unknowns, tied otherwise.
    pub fn lay_out(&mut self, pattern: BlockPattern) {
        self.pattern = pattern;
        self.solver = BlockSolver::new(&self.pattern, LinearSolver::Auto);
        self.values.resize(self.pattern.len(), 0.0);
        self.damped.resize(self.pattern.len(), 0.0);
    }

    pub fn clear(&mut self) {
        self.values.fill(0.0);
        self.gradient.fill(0.0);
    }

    /// Add to the block on the diagonal and to its gradient.
    pub fn add_diagonal(&mut self, block: usize, matrix: &[f64], gradient: &[f64]) {
        self.add_at(self.pattern.diagonal(block), matrix);
        let start = self.pattern.start(block);
        add(&mut self.gradient[start..start + gradient.len()], gradient);
    }

    /// Add to the block whose numbers begin at `offset`, by columns.
    pub fn add_at(&mut self, offset: usize, matrix: &[f64]) {
        add(&mut self.values[offset..offset + matrix.len()], matrix);
    }

    #[cfg(test)]
    pub fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// The largest absolute entry of the gradient.
    pub fn gradient_max(&self) -> f64 {
        self.gradient.iter().fold(0.0, |most, g| most.max(g.abs()))
    }

    /// Solve with this damping; `None` where the damped matrix is not positive definite.
    pub fn solve(&mut self, damping: Damping, lambda: f64) -> Option<DampedStep> {
        self.damped.copy_from_slice(&self.values);
        for block in 0..self.pattern.blocks() {
            let (offset, size) = (self.pattern.diagonal(block), self.pattern.size(block));
            for k in 0..size {
                let at = offset + k * (size + 1);
                self.damped[at] += damping_term(damping, lambda, self.values[at]);
            }
        }
        for (step, gradient) in self.step.iter_mut().zip(&self.gradient) {
            *step = -gradient;
        }
        let solved = self.solver.factor(&self.pattern, &self.damped)
            && (self.solver).solve(&self.pattern, &self.damped, &mut self.step);
        if !solved {
            return None;
        }
        let (mut promised, mut squared) = (0.0, 0.0);
        for block in 0..self.pattern.blocks() {
            let (start, offset) = (self.pattern.start(block), self.pattern.diagonal(block));
            let size = self.pattern.size(block);
            for k in 0..size {
                let (d, g) = (self.step[start + k], self.gradient[start + k]);
                let term = damping_term(damping, lambda, self.values[offset + k * (size + 1)]);
                promised += 0.5 * d * (term * d - g);
            }
            squared += DVectorView::from_slice(self.of(block), size).norm_squared();
        }
        Some(DampedStep { promised, squared })
    }

    /// The step of a block, as last solved.
    pub fn of(&self, block: usize) -> &[f64] {
        let start = self.pattern.start(block);
        &self.step[start..start + self.pattern.size(block)]
    }
}

fn add(to: &mut [f64], from: &[f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += from;
    }
}
