//! One damped step of an adjustment: the normal equations solved, and the candidate made.

use super::adjuster::BundleAdjuster;
use super::assembly::Assembly;
use super::ids::NONE;
use super::inertial::Motion;
use super::intrinsics::Intrinsics;
use crate::minimise::Step;
use crate::options::Damping;
use nalgebra::Vector6;
use rayon::prelude::*;

impl BundleAdjuster {
    /// Moves poses and intrinsics to the candidate; false where no camera has such intrinsics.
    pub(super) fn move_blocks(&mut self) -> bool {
        let pattern = &self.layout.pattern;
        for (view, &block) in self.layout.view_block.iter().enumerate() {
            if block != NONE {
                let start = pattern.start(block as usize);
                let twist = Vector6::from_column_slice(&self.assembly.step[start..start + 6]);
                self.candidate_poses[view] = self.poses[view].moved_by(&twist);
            }
        }
        for (motion, &block) in self.layout.motion_block.iter().enumerate() {
            if block != NONE {
                let step = &self.assembly.step[pattern.start(block as usize)..];
                self.candidate_motions[motion] = self.motions[motion].moved(step);
            }
        }
        for (camera, &block) in self.layout.camera_block.iter().enumerate() {
            if block != NONE {
                let (start, size) = (pattern.start(block as usize), pattern.size(block as usize));
                let step = &self.assembly.step[start..start + size];
                let next = &mut self.candidate_intrinsics[camera];
                if self.intrinsics[camera].moved_by(step, next).is_err() {
                    return false;
                }
            }
        }
        true
    }

    /// The step of poses and intrinsics, and the candidates of the points; false where the damped
    /// normal equations are not positive definite.
    pub(super) fn solve_blocks(&mut self, damping: Damping, lambda: f64) -> bool {
        if let Some(reverse) = &mut self.reverse {
            let Assembly {
                direct,
                gradient,
                step,
                ..
            } = &mut self.assembly;
            let known = (&direct[..], &gradient[..]);
            return reverse.step(&mut self.layout, known, (damping, lambda), step);
        }
        let pattern = &self.layout.pattern;
        if self.eliminated != Some((damping, lambda)) {
            self.layout
                .chunks
                .par_iter_mut()
                .for_each(|chunk| chunk.eliminate(pattern, damping, lambda));
            self.eliminated = Some((damping, lambda));
        }
        if self.layout.chunks.iter().any(|chunk| chunk.singular) {
            return false;
        }
        self.assembly.reduce(&self.layout, damping, lambda);
        let (reduced, step) = (&self.assembly.reduced, &mut self.assembly.step);
        let solved = pattern.blocks() == 0
            || (self.solver.factor(pattern, reduced) && self.solver.solve(pattern, reduced, step));
        if !solved {
            return false;
        }
        let step = &self.assembly.step;
        self.layout
            .chunks
            .par_iter_mut()
            .for_each(|chunk| chunk.substitute(pattern, (damping, lambda), step));
        true
    }

    pub(super) fn measure_step(&self, damping: Damping, lambda: f64) -> Step {
        let (mut promised, mut squared) = self.assembly.promised(&self.layout, damping, lambda);
        let poses = self
            .poses
            .iter()
            .map(|pose| 1.0 + pose.translation.norm_squared());
        let parameters = self.intrinsics.iter().flat_map(Intrinsics::parameters);
        let mut state = poses.sum::<f64>() + parameters.map(|p| p * p).sum::<f64>();
        state += self.motions.iter().map(Motion::norm_squared).sum::<f64>();
        for chunk in &self.layout.chunks {
            promised += chunk.step.promised;
            squared += chunk.step.squared;
            state += chunk.step.state_squared;
        }
        Step {
            promised,
            norm: squared.sqrt(),
            state_norm: state.sqrt(),
        }
    }
}
