//! Poses that leave the problem, and what they knew, as a prior on those that stay.

use super::adjuster::BundleAdjuster;
use super::chunk::NONE;
use super::covariance::no_covariance;
use super::layout::Elimination;
use super::prior::Prior;
use super::problem::BundleProblem;
use crate::linear::LinearSolver;
use crate::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Directions of the prior whose information is below this share of the largest are rounding.
const RANK: f64 = 1e-12;

impl BundleProblem {
    /// Marginalise poses out: all points they see leave with them, and what those measurements say
    /// of the other poses stays as one Gaussian prior around the present state. Indices do not
    /// change: the poses and points that left are fixed and not measured any more. Losses are taken
    /// at their present weights.
    ///
    /// # Errors
    /// Where an index is unknown, or the poses that leave are not determined.
    pub fn marginalise(&mut self, poses: &[usize]) -> Result<()> {
        if !self.inertial.views.is_empty() {
            let expected = "a problem without inertial terms";
            return Err(Error::value("poses", expected, "one with motions"));
        }
        let mut leaves = vec![false; self.views.len()];
        for &pose in poses {
            if pose >= self.views.len() {
                let expected = format!("indices below {}", self.views.len());
                return Err(Error::value("poses", expected, pose));
            }
            leaves[pose] = true;
        }
        let mut gone = vec![false; self.points.len()];
        for observation in &self.observations {
            gone[observation.point as usize] |= leaves[observation.view as usize];
        }
        let goes = |prior: &Prior| prior.views.iter().any(|&view| leaves[view]);
        let part = BundleProblem {
            observations: (self.observations.iter())
                .filter(|o| gone[o.point as usize])
                .copied()
                .collect(),
            priors: self.priors.iter().filter(|p| goes(p)).cloned().collect(),
            ..self.clone()
        };
        let prior = remaining(part, &leaves)?;
        self.observations.retain(|o| !gone[o.point as usize]);
        self.priors.retain(|prior| !goes(prior));
        self.priors.extend(prior);
        for (view, leaves) in self.views.iter_mut().zip(&leaves) {
            view.fixed |= leaves;
        }
        for (point, gone) in self.points.iter_mut().zip(&gone) {
            point.fixed |= gone;
        }
        Ok(())
    }
}

/// The prior that the measurements of `part` are for the poses that stay; none where none does.
fn remaining(part: BundleProblem, leaves: &[bool]) -> Result<Option<Prior>> {
    let mut adjuster =
        BundleAdjuster::with_elimination(part, LinearSolver::Dense, Elimination::Points);
    let layout = &adjuster.layout;
    if layout.camera_block.iter().any(|&block| block != NONE) {
        let expected = "known intrinsics";
        return Err(Error::value("marginalised poses", expected, "free ones"));
    }
    let of = |leaving: bool| -> Vec<usize> {
        (0..leaves.len())
            .filter(|&view| layout.view_block[view] != NONE && leaves[view] == leaving)
            .collect()
    };
    let (stay, leave) = (of(false), of(true));
    adjuster.linearise_undamped()?;
    let (s, b) = adjuster.dense(&stay, &leave);
    let (k, m) = (6 * stay.len(), 6 * leave.len());
    let leaving = s.view((k, k), (m, m)).into_owned();
    let Some(factor) = leaving.cholesky() else {
        return Err(no_covariance("the poses that leave are not determined"));
    };
    let coupling = s.view((k, 0), (m, k)).into_owned();
    let information = s.view((0, 0), (k, k)) - coupling.tr_mul(&factor.solve(&coupling));
    let gradient = b.rows(0, k) - coupling.tr_mul(&factor.solve(&b.rows(k, m).into_owned()));
    if k == 0 {
        return Ok(None);
    }
    let eigen = ((&information + information.transpose()) * 0.5).symmetric_eigen();
    let least = RANK * eigen.eigenvalues.amax();
    let kept: Vec<usize> = (0..k).filter(|&i| eigen.eigenvalues[i] > least).collect();
    let root = DMatrix::from_fn(kept.len(), k, |r, c| {
        eigen.eigenvalues[kept[r]].sqrt() * eigen.eigenvectors[(c, kept[r])]
    });
    let offset = DVector::from_fn(kept.len(), |r, _| {
        eigen.eigenvectors.column(kept[r]).dot(&gradient) / eigen.eigenvalues[kept[r]].sqrt()
    });
    let around = stay
        .iter()
        .map(|&view| adjuster.problem.views[view].world_from_camera);
    let around = around.collect();
    Ok(Some(Prior::joint(stay, around, root, offset)))
}

impl BundleAdjuster {
    /// The reduced matrix and gradient of the poses `first`, then `second`, as dense matrices.
    fn dense(&self, first: &[usize], second: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
        let pattern = &self.layout.pattern;
        let order: Vec<usize> = first
            .iter()
            .chain(second)
            .map(|&view| self.layout.view_block[view] as usize)
            .collect();
        let mut place = vec![0; pattern.blocks()];
        for (to, &block) in order.iter().enumerate() {
            place[block] = 6 * to;
        }
        let mut matrix = DMatrix::zeros(pattern.dimension(), pattern.dimension());
        let mut gradient = DVector::zeros(pattern.dimension());
        for column in 0..pattern.blocks() {
            for k in 0..6 {
                gradient[place[column] + k] = -self.assembly.step[pattern.start(column) + k];
            }
            for (row, offset) in pattern.column(column) {
                for k in 0..36 {
                    let (r, c) = (place[row] + k % 6, place[column] + k / 6);
                    matrix[(r, c)] = self.assembly.reduced[offset + k];
                    matrix[(c, r)] = self.assembly.reduced[offset + k];
                }
            }
        }
        (matrix, gradient)
    }
}
