//! Marginal covariance of chosen poses, or of a camera's parameters, at the present state.

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
        let start = |&pose: &usize| match self.layout.view_block[pose] {
            NONE => vec![None; 6],
            block => {
                let start = self.layout.pattern.start(block as usize);
                (start..start + 6).map(Some).collect()
            }
        };
        let places: Vec<Option<usize>> = poses.iter().flat_map(start).collect();
        self.covariance_of(&places)
    }

    /// The covariance of the parameters of a camera that are estimated, in the order in which they
    /// were named, at the present state, which should be the minimum.
    ///
    /// # Errors
    /// Where there is no such camera, or the measurements do not determine its parameters.
    pub fn camera_covariance(&mut self, camera: usize) -> Result<DMatrix<f64>> {
        index("camera", camera, self.problem.intrinsics.len())?;
        if self.reverse.is_some() {
            return self.points_first().camera_covariance(camera);
        }
        let size = self.problem.intrinsics[camera].free();
        let start = match self.layout.camera_block[camera] {
            NONE if size > 0 => return Err(no_covariance("nothing measures the camera")),
            NONE => 0,
            block => self.layout.pattern.start(block as usize),
        };
        let places: Vec<Option<usize>> = (start..start + size).map(Some).collect();
        self.covariance_of(&places)
    }

    /// The covariance of unknowns at these places of the step; those that do not move have zeros.
    fn covariance_of(&mut self, places: &[Option<usize>]) -> Result<DMatrix<f64>> {
        let gauge = |issue: &&Issue| matches!(issue, Issue::FreeGauge { .. });
        if let Some(issue) = self.layout.issues.iter().find(gauge) {
            return Err(no_covariance(issue));
        }
        self.linearise_undamped()?;
        let (pattern, values) = (&self.layout.pattern, &self.assembly.reduced);
        let n = pattern.dimension();
        let mut result = DMatrix::zeros(places.len(), places.len());
        if n == 0 {
            return Ok(result);
        }
        if !self.solver.factor(pattern, values) {
            return Err(no_covariance("the normal matrix is not positive definite"));
        }
        let (mut x, mut back) = (vec![0.0; n], vec![0.0; n]);
        for (column, place) in places.iter().enumerate() {
            let Some(unit) = *place else { continue };
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
            for (row, place) in places.iter().enumerate() {
                if let Some(place) = *place {
                    result[(row, column)] = x[place];
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
