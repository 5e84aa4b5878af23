//! Poses that leave the problem with their motions, and what they knew, as a prior on those that stay.

use super::adjuster::{BundleAdjuster, Elimination};
use super::covariance::no_covariance;
use super::ids::{MOTION, NONE, index};
use super::prior::Prior;
use super::problem::BundleProblem;
use super::relative::RelativePose;
use crate::linear::LinearSolver;
use crate::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Directions of the prior whose information is below this share of the largest are rounding.
const RANK: f64 = 1e-12;

impl BundleProblem {
    /// Marginalise poses out, with their motions: all points they see and all samples that tie them
    /// leave with them, and what those say of the other poses and motions stays as one Gaussian prior
    /// around the present state. Indices do not change: the poses and points that left are fixed and
    /// not measured any more. Losses are taken at their present weights.
    ///
    /// # Errors
    /// Where an index is unknown, intrinsics are free, or the poses that leave are not determined.
    pub fn marginalise(&mut self, poses: &[usize]) -> Result<()> {
        let mut leaves = vec![false; self.views.len()];
        for &pose in poses {
            index("poses", pose, self.views.len())?;
            leaves[pose] = true;
        }
        let mut gone = vec![false; self.points.len()];
        for observation in &self.observations {
            gone[observation.point as usize] |= leaves[observation.view as usize];
        }
        let motion_leaves = |motion: usize| leaves[self.inertial.views[motion]];
        let goes = |prior: &Prior| {
            prior.views.iter().any(|&view| leaves[view])
                || prior.motions.iter().any(|&motion| motion_leaves(motion))
        };
        let edge_goes = |edge: &RelativePose| leaves[edge.a] || leaves[edge.b];
        let (leaving, staying) = self.inertial.part(&leaves);
        let part = BundleProblem {
            observations: (self.observations.iter())
                .filter(|o| gone[o.point as usize])
                .copied()
                .collect(),
            priors: self.priors.iter().filter(|p| goes(p)).cloned().collect(),
            relative: (self.relative.iter())
                .filter(|e| edge_goes(e))
                .cloned()
                .collect(),
            inertial: leaving,
            ..self.clone()
        };
        let prior = remaining(part, &leaves)?;
        let mut priors: Vec<Prior> = self.priors.iter().filter(|p| !goes(p)).cloned().collect();
        priors.extend(prior);
        self.priors = priors;
        self.relative.retain(|edge| !edge_goes(edge));
        self.inertial = staying;
        self.observations.retain(|o| !gone[o.point as usize]);
        for (view, leaves) in self.views.iter_mut().zip(&leaves) {
            view.fixed |= leaves;
        }
        for (point, gone) in self.points.iter_mut().zip(&gone) {
            point.fixed |= gone;
        }
        Ok(())
    }
}

/// The prior that the measurements of `part` are for what stays; none where nothing does.
fn remaining(part: BundleProblem, leaves: &[bool]) -> Result<Option<Prior>> {
    let mut adjuster =
        BundleAdjuster::with_elimination(part, LinearSolver::Dense, Elimination::Points);
    let layout = &adjuster.layout;
    if layout.camera_block.iter().any(|&block| block != NONE) {
        let expected = "known intrinsics";
        return Err(Error::value("marginalised poses", expected, "free ones"));
    }
    let of = |leaving: bool| -> [Vec<usize>; 2] {
        let view = |&view: &usize| layout.view_block[view] != NONE && leaves[view] == leaving;
        let motion = |&motion: &usize| {
            let view = adjuster.problem.inertial.views[motion];
            layout.motion_block[motion] != NONE && leaves[view] == leaving
        };
        [
            (0..leaves.len()).filter(view).collect(),
            (0..layout.motion_block.len()).filter(motion).collect(),
        ]
    };
    let ([views, motions], [leave, leave_motions]) = (of(false), of(true));
    adjuster.linearise_undamped()?;
    let (k, m) = (
        6 * views.len() + MOTION * motions.len(),
        6 * leave.len() + MOTION * leave_motions.len(),
    );
    let (s, b) = adjuster.dense([&views, &motions, &leave, &leave_motions]);
    let leaving = s.view((k, k), (m, m)).into_owned();
    let Some(factor) = leaving.cholesky() else {
        return Err(no_covariance("the poses that leave are not determined"));
    };
    if k == 0 {
        return Ok(None);
    }
    let coupling = s.view((k, 0), (m, k)).into_owned();
    let information = s.view((0, 0), (k, k)) - coupling.tr_mul(&factor.solve(&coupling));
    let gradient = b.rows(0, k) - coupling.tr_mul(&factor.solve(&b.rows(k, m).into_owned()));
    let (root, offset) = root_of(&information, &gradient);
    let poses = (views.iter()).map(|&view| adjuster.problem.views[view].world_from_camera);
    let poses = poses.collect();
    let around = (motions.iter()).map(|&motion| adjuster.problem.inertial.motions[motion]);
    let around = around.collect();
    let prior = Prior::joint((views, poses), (motions, around), root, offset);
    Ok(Some(prior))
}

/// The root of an information, without what it does not determine, and the residual that has this
/// gradient. Unknowns of other units are made alike first, or rounding of one would drown another.
fn root_of(information: &DMatrix<f64>, gradient: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let n = gradient.len();
    let scale = information
        .diagonal()
        .map(|d| d.max(f64::MIN_POSITIVE).sqrt());
    let even = DMatrix::from_fn(n, n, |r, c| {
        0.5 * (information[(r, c)] + information[(c, r)]) / (scale[r] * scale[c])
    });
    let eigen = even.symmetric_eigen();
    let least = RANK * eigen.eigenvalues.amax();
    let kept: Vec<usize> = (0..n).filter(|&i| eigen.eigenvalues[i] > least).collect();
    let root = DMatrix::from_fn(kept.len(), n, |r, c| {
        eigen.eigenvalues[kept[r]].sqrt() * eigen.eigenvectors[(c, kept[r])] * scale[c]
    });
    let offset = DVector::from_fn(kept.len(), |r, _| {
        let along: f64 = (0..n)
            .map(|c| eigen.eigenvectors[(c, kept[r])] * gradient[c] / scale[c])
            .sum();
        along / eigen.eigenvalues[kept[r]].sqrt()
    });
    (root, offset)
}

impl BundleAdjuster {
    /// The reduced matrix and gradient of poses, motions, poses, motions as dense matrices.
    fn dense(&self, order: [&[usize]; 4]) -> (DMatrix<f64>, DVector<f64>) {
        let (layout, pattern) = (&self.layout, &self.layout.pattern);
        let mut place = vec![0; pattern.blocks()];
        let mut next = 0;
        for (k, members) in order.into_iter().enumerate() {
            for &member in members {
                let poses = k % 2 == 0;
                let blocks = if poses {
                    &layout.view_block
                } else {
                    &layout.motion_block
                };
                let block = blocks[member] as usize;
                place[block] = next;
                next += pattern.size(block);
            }
        }
        let mut matrix = DMatrix::zeros(pattern.dimension(), pattern.dimension());
        let mut gradient = DVector::zeros(pattern.dimension());
        for column in 0..pattern.blocks() {
            for k in 0..pattern.size(column) {
                gradient[place[column] + k] = -self.assembly.step[pattern.start(column) + k];
            }
            for (row, offset) in pattern.column(column) {
                let height = pattern.size(row);
                for k in 0..height * pattern.size(column) {
                    let (r, c) = (place[row] + k % height, place[column] + k / height);
                    matrix[(r, c)] = self.assembly.reduced[offset + k];
                    matrix[(c, r)] = self.assembly.reduced[offset + k];
                }
            }
        }
        (matrix, gradient)
    }
}
