//! The reduced system: the sums of the parts, priors and damping.

use super::chunk::{Chunk, NONE};
use super::layout::Layout;
use super::prior::{Prior, PriorScratch};
use super::state::ViewPose;
use crate::minimise::damping_term;
use crate::options::Damping;
use rayon::prelude::*;

/// Numbers that are summed as one piece of work.
const PIECE: usize = 1 << 15;

/// The undamped normal matrix of poses and intrinsics (direct blocks), the reduced matrix, and the
/// vectors that belong to them.
pub(super) struct Assembly {
    pub direct: Vec<f64>,
    pub reduced: Vec<f64>,
    pub gradient: Vec<f64>,
    pub step: Vec<f64>,
    /// Priors between two poses: offset in the reduced matrix and the block, added to it undamped.
    joint: Vec<(usize, [f64; 36])>,
    scratch: PriorScratch,
}

impl Assembly {
    pub fn new(layout: &Layout) -> Self {
        let n = layout.pattern.dimension();
        Self {
            direct: vec![0.0; layout.direct.len],
            reduced: vec![0.0; layout.pattern.len()],
            gradient: vec![0.0; n],
            step: vec![0.0; n],
            joint: Vec::new(),
            scratch: PriorScratch::default(),
        }
    }

    pub fn prior_cost(&mut self, priors: &[Prior], poses: &[ViewPose]) -> f64 {
        let costs = priors
            .iter()
            .map(|prior| prior.cost(poses, &mut self.scratch));
        costs.sum()
    }

    /// Sum the direct blocks and gradients of the parts, and add the priors.
    pub fn gather(&mut self, layout: &Layout, priors: &[Prior], poses: &[ViewPose]) {
        sum(&mut self.direct, &layout.chunks, |chunk| &chunk.direct);
        sum(&mut self.gradient, &layout.chunks, |chunk| &chunk.gradient);
        self.joint.clear();
        for prior in priors {
            let block = |view: usize| layout.view_block[prior.views[view]];
            let (direct, joint, gradient) = (&mut self.direct, &mut self.joint, &mut self.gradient);
            prior.linearise(
                poses,
                &mut self.scratch,
                |i, j, matrix| {
                    let (row, column) = (block(i), block(j));
                    if row == NONE || column == NONE {
                        return;
                    }
                    if i == j {
                        let start = layout.direct.diagonal[row as usize];
                        add(&mut direct[start..start + 36], matrix.as_slice());
                        return;
                    }
                    let transposed = row < column;
                    let (low, high) = (row.min(column) as usize, row.max(column) as usize);
                    if let Some(offset) = layout.pattern.offset(high, low) {
                        let matrix = if transposed {
                            matrix.transpose()
                        } else {
                            *matrix
                        };
                        joint.push((offset, std::array::from_fn(|k| matrix.as_slice()[k])));
                    }
                },
                |i, vector| {
                    if block(i) != NONE {
                        let start = layout.pattern.start(block(i) as usize);
                        add(&mut gradient[start..start + 6], vector.as_slice());
                    }
                },
            );
        }
    }

    /// The reduced matrix and the right side (in `step`), after the parts eliminated their points.
    pub fn reduce(&mut self, layout: &Layout, damping: Damping, lambda: f64) {
        sum(&mut self.reduced, &layout.chunks, |chunk| &chunk.reduced);
        sum(&mut self.step, &layout.chunks, |chunk| &chunk.rhs);
        for (step, gradient) in self.step.iter_mut().zip(&self.gradient) {
            *step -= gradient;
        }
        for &(from, to, len) in &layout.direct.targets {
            add(
                &mut self.reduced[to..to + len],
                &self.direct[from..from + len],
            );
        }
        for (offset, block) in &self.joint {
            add(&mut self.reduced[*offset..offset + 36], block);
        }
        for block in 0..layout.pattern.blocks() {
            let offset = layout.pattern.diagonal(block);
            for k in 0..layout.pattern.size(block) {
                let term = damping_term(damping, lambda, self.diagonal(layout, block, k));
                self.reduced[offset + k * (layout.pattern.size(block) + 1)] += term;
            }
        }
    }

    /// An entry of the diagonal of the undamped normal matrix.
    pub fn diagonal(&self, layout: &Layout, block: usize, k: usize) -> f64 {
        self.direct[layout.direct.diagonal[block] + k * (layout.pattern.size(block) + 1)]
    }

    /// Decrease that the model promises for `step`, without the points' part; and its squared norm.
    pub fn promised(&self, layout: &Layout, damping: Damping, lambda: f64) -> (f64, f64) {
        let (mut promised, mut squared) = (0.0, 0.0);
        for block in 0..layout.pattern.blocks() {
            let start = layout.pattern.start(block);
            for k in 0..layout.pattern.size(block) {
                let d = self.step[start + k];
                let term = damping_term(damping, lambda, self.diagonal(layout, block, k));
                promised += 0.5 * d * (term * d - self.gradient[start + k]);
                squared += d * d;
            }
        }
        (promised, squared)
    }
}

fn add(to: &mut [f64], from: &[f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += from;
    }
}

/// The sum over the parts, always in the same order.
fn sum(to: &mut [f64], chunks: &[Chunk], of: impl Fn(&Chunk) -> &Vec<f64> + Sync) {
    to.par_chunks_mut(PIECE)
        .enumerate()
        .for_each(|(piece, to)| {
            let first = piece * PIECE;
            to.copy_from_slice(&of(&chunks[0])[first..first + to.len()]);
            for chunk in &chunks[1..] {
                add(to, &of(chunk)[first..first + to.len()]);
            }
        });
}
