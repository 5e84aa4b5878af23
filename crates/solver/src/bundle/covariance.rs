//! Marginal covariance of chosen poses at the present state.

use super::adjuster::{BundleAdjuster, Elimination};
use super::ids::{NONE, index};
use super::issue::Issue;
use crate::minimise::System;
use crate::options::Damping;
use crate::{Error, Result};
use nalgebra::DMatrix;

/// Largest error of a column of the inverse put back into the system: more means that the matrix is
/// singular to working precision.
const PUT_BACK: f64 = 1e-6;

impl BundleAdjuster {
    /// The undamped reduced matrix at the present state; its gradient is then in `assembly.step`
    /// with the opposite sign.
    pub(super) fn linearise_undamped(&mut self) -> Result<()> {
        self.load();
        self.linearise(Damping::Identity, 0.0);
        if self.layout.chunks.iter().any(|chunk| chunk.singular) {
            return Err(no_covariance("some point is not determined"));
        }
        self.assembly.reduce(&self.layout, Damping::Identity, 0.0);
        Ok(())
    }

    /// The same problem with its points eliminated.
    fn points_first(&self) -> Self {
        let problem = self.problem.clone();
        Self::with_elimination(problem, self.solver.kind(), Elimination::Points)
    }

    /// The joint covariance of `poses` at the present state, which should be the minimum: 6 rows for
    /// each, in the order given, of the twist `[omega, v]` (rad, m) in the camera's own frame: the
    /// true pose is `world_from_camera * exp(twist)`. Fixed poses have zeros.
    ///
    /// # Errors
    /// Where an index is unknown, or the measurements do not determine the poses.
    pub fn covariance(&mut self, poses: &[usize]) -> Result<DMatrix<f64>> {
        for &pose in poses {
            index("poses", pose, self.problem.poses())?;
            let alone = self.layout.view_block[pose] == NONE;
            if alone && !self.problem.views[pose].fixed {
                return Err(no_covariance(Issue::PoseUndetermined { pose }));
            }
        }
        if self.reverse.is_some() {
            return self.points_first().covariance(poses);
        }
        let gauge = |issue: &&Issue| matches!(issue, Issue::FreeGauge { .. });
        if let Some(issue) = self.layout.issues.iter().find(gauge) {
            return Err(no_covariance(issue));
        }
        self.linearise_undamped()?;
        let (pattern, values) = (&self.layout.pattern, &self.assembly.reduced);
        let n = pattern.dimension();
        let mut result = DMatrix::zeros(6 * poses.len(), 6 * poses.len());
        if n == 0 {
            return Ok(result);
        }
        if !self.solver.factor(pattern, values) {
            return Err(no_covariance("the normal matrix is not positive definite"));
        }
        let (mut x, mut back) = (vec![0.0; n], vec![0.0; n]);
        for (k, &pose) in poses.iter().enumerate() {
            let block = self.layout.view_block[pose];
            for axis in (0..6).filter(|_| block != NONE) {
                let unit = pattern.start(block as usize) + axis;
                x.fill(0.0);
                x[unit] = 1.0;
                let solved = self.solver.solve(pattern, values, &mut x);
                pattern.multiply(values, &x, &mut back);
                back[unit] -= 1.0;
                let error = back.iter().fold(0.0, |most: f64, e| most.max(e.abs()));
                if !solved || error > PUT_BACK {
                    return Err(no_covariance(
                        "the normal matrix is singular to working precision",
                    ));
                }
                for (row, &other) in poses.iter().enumerate() {
                    let block = self.layout.view_block[other];
                    for r in (0..6).filter(|_| block != NONE) {
                        result[(6 * row + r, 6 * k + axis)] = x[pattern.start(block as usize) + r];
                    }
                }
            }
        }
        Ok((&result + result.transpose()) * 0.5)
    }
}

pub(super) fn no_covariance(reason: impl ToString) -> Error {
    Error::NoCovariance {
        reason: reason.to_string(),
    }
}
