//! The reduced system: the sums of the parts, priors and damping.

use super::chunk::Chunk;
use super::ids::{Block, MOTION, NONE};
use super::intrinsics::Intrinsics;
use super::layout::Layout;
use super::prior::{Prior, PriorScratch, State};
use super::problem::BundleProblem;
use crate::minimise::damping_term;
use crate::options::Damping;
use nalgebra::SVector;
use rayon::prelude::*;

/// Numbers that are summed as one piece of work.
const PIECE: usize = 1 << 15;

/// A block off the diagonal: offset in the reduced matrix and so many numbers, by columns.
struct Joint {
    offset: usize,
    len: usize,
    numbers: [f64; MOTION * MOTION],
}

/// The undamped normal matrix of poses and intrinsics (direct blocks), the reduced matrix, and the
/// vectors that belong to them.
pub(super) struct Assembly {
    pub direct: Vec<f64>,
    pub reduced: Vec<f64>,
    pub gradient: Vec<f64>,
    pub step: Vec<f64>,
    /// What ties two blocks apart from points: added to the reduced matrix undamped.
    joint: Vec<Joint>,
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

    pub fn prior_cost(&mut self, priors: &[Prior], state: State) -> f64 {
        let costs = priors
            .iter()
            .map(|prior| prior.cost(state, &mut self.scratch));
        costs.sum()
    }

    /// Sum the direct blocks and gradients of the parts, and add the priors and inertial terms.
    pub fn gather(&mut self, layout: &Layout, problem: &BundleProblem, state: State) {
        sum(&mut self.direct, &layout.chunks, |chunk| &chunk.direct);
        sum(&mut self.gradient, &layout.chunks, |chunk| &chunk.gradient);
        self.joint.clear();
        let pattern = &layout.pattern;
        let (direct, joint, gradient) = (&mut self.direct, &mut self.joint, &mut self.gradient);
        let mut add_block = |row: u32, column: u32, matrix: &Block| {
            let (high, low) = (row.max(column) as usize, row.min(column) as usize);
            let (rows, columns) = (pattern.size(high), pattern.size(low));
            let mut numbers = [0.0; MOTION * MOTION];
            for c in 0..columns {
                for r in 0..rows {
                    let transposed = row < column;
                    numbers[rows * c + r] = matrix[if transposed { (c, r) } else { (r, c) }];
                }
            }
            let len = rows * columns;
            if row == column {
                let start = layout.direct.diagonal[high];
                add(&mut direct[start..start + len], &numbers[..len]);
            } else if let Some(offset) = pattern.offset(high, low) {
                joint.push(Joint {
                    offset,
                    len,
                    numbers,
                });
            }
        };
        let mut add_gradient = |block: u32, vector: &SVector<f64, MOTION>| {
            let (start, size) = (pattern.start(block as usize), pattern.size(block as usize));
            add(&mut gradient[start..start + size], vector.as_slice());
        };
        let blocks = (&layout.view_block[..], &layout.motion_block[..]);
        for prior in &problem.priors {
            let scratch = &mut self.scratch;
            prior.linearise(state, blocks, scratch, &mut add_block, &mut add_gradient);
        }
        for edge in &problem.relative {
            edge.linearise(state.0, blocks.0, &mut add_block, &mut add_gradient);
        }
        let inertial = &problem.inertial;
        inertial.linearise(state, blocks, &mut add_block, &mut add_gradient);
    }

    /// Add what is known of the cameras' parameters.
    pub fn add_known(&mut self, layout: &Layout, intrinsics: &[Intrinsics]) {
        for (camera, &block) in layout.camera_block.iter().enumerate() {
            if block == NONE {
                continue;
            }
            let (block, size) = (block as usize, intrinsics[camera].free());
            let (from, start) = (layout.direct.diagonal[block], layout.pattern.start(block));
            for (k, weight, gap) in intrinsics[camera].gaps() {
                self.direct[from + k * (size + 1)] += weight;
                self.gradient[start + k] += weight * gap;
            }
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
        for joint in &self.joint {
            let range = joint.offset..joint.offset + joint.len;
            add(&mut self.reduced[range], &joint.numbers[..joint.len]);
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
