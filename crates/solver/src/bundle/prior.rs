//! Gaussian knowledge of poses: of one pose, of its attitude alone, or of several poses together.

use super::state::ViewPose;
use crate::{Error, Result};
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// The residual is `root * r + offset`, `r` the stacked `log(K_i K0_i^-1)` (twists `[omega, v]` in
/// the camera frames) of the poses `views`.
#[derive(Clone, Debug)]
pub(crate) struct Prior {
    pub views: Vec<usize>,
    /// Inverses of the camera-from-world poses of the knowledge.
    inverses: Vec<Pose>,
    root: DMatrix<f64>,
    offset: DVector<f64>,
}

/// Room for the evaluation of the largest prior.
#[derive(Clone, Debug, Default)]
pub(crate) struct PriorScratch {
    twists: Vec<f64>,
    residual: Vec<f64>,
    jacobian: Vec<f64>,
}

/// The root `L^T` of the information `L L^T` of a covariance; the error names `argument`.
pub(crate) fn root_information<const N: usize>(
    argument: &str,
    covariance: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>>
where
    nalgebra::Const<N>: nalgebra::DimMin<nalgebra::Const<N>, Output = nalgebra::Const<N>>,
{
    let expected = "a symmetric positive definite matrix of finite numbers";
    let refuse = || Err(Error::value(argument, expected, covariance));
    let scale = covariance.abs().max();
    // rounding of a covariance computed elsewhere is not asymmetry
    if !scale.is_finite() || (covariance - covariance.transpose()).abs().max() > 1e-9 * scale {
        return refuse();
    }
    let Some(information) = covariance.cholesky().map(|factor| factor.inverse()) else {
        return refuse();
    };
    match information.cholesky() {
        Some(factor) if factor.l_dirty().iter().all(|v| v.is_finite()) => {
            Ok(factor.l().transpose())
        }
        _ => refuse(),
    }
}

impl Prior {
    /// Of one pose; `root` has six columns and any number of rows.
    pub fn of_pose<const R: usize>(view: usize, pose: &Pose, root: &SMatrix<f64, R, 6>) -> Self {
        Self {
            views: vec![view],
            inverses: vec![*pose],
            root: DMatrix::from_column_slice(R, 6, root.as_slice()),
            offset: DVector::zeros(R),
        }
    }

    /// Of several poses together, around `poses` (world from camera).
    pub fn joint(
        views: Vec<usize>,
        poses: Vec<Pose>,
        root: DMatrix<f64>,
        offset: DVector<f64>,
    ) -> Self {
        Self {
            views,
            inverses: poses,
            root,
            offset,
        }
    }

    /// The pose (world from camera) that a prior of one is around, and the root of its information.
    #[cfg(test)]
    pub fn of_one_pose(&self) -> (Pose, &DMatrix<f64>) {
        (self.inverses[0], &self.root)
    }

    /// True where it holds all six directions of its poses.
    pub fn holds_position(&self) -> bool {
        self.root.columns(3, 3).norm() > 0.0
    }

    fn evaluate(&self, poses: &[ViewPose], scratch: &mut PriorScratch) {
        scratch.twists.clear();
        for (view, inverse) in self.views.iter().zip(&self.inverses) {
            let twist = se3::log(&(poses[*view].pose() * *inverse));
            scratch.twists.extend(twist.iter());
        }
        scratch.residual.clear();
        scratch.residual.extend(self.offset.iter());
        for (column, twist) in scratch.twists.iter().enumerate() {
            for (row, residual) in scratch.residual.iter_mut().enumerate() {
                *residual += self.root[(row, column)] * twist;
            }
        }
    }

    /// Half the squared residual.
    pub fn cost(&self, poses: &[ViewPose], scratch: &mut PriorScratch) -> f64 {
        self.evaluate(poses, scratch);
        0.5 * scratch.residual.iter().map(|e| e * e).sum::<f64>()
    }

    /// Half the squared residual; hands the blocks of the normal matrix (`row >= column`, indices
    /// into `views`) to `block`, and of the gradient to `gradient`.
    pub fn linearise(
        &self,
        poses: &[ViewPose],
        scratch: &mut PriorScratch,
        mut block: impl FnMut(usize, usize, &Matrix6<f64>),
        mut gradient: impl FnMut(usize, &Vector6<f64>),
    ) -> f64 {
        self.evaluate(poses, scratch);
        let rows = self.root.nrows();
        // the Jacobian by columns, rows x 6 for each pose
        scratch.jacobian.clear();
        for view in 0..self.views.len() {
            let twist = Vector6::from_column_slice(&scratch.twists[6 * view..6 * view + 6]);
            let by_update = se3::left_jacobian_inverse(&twist);
            for c in 0..6 {
                for r in 0..rows {
                    let entry = (0..6).map(|k| self.root[(r, 6 * view + k)] * by_update[(k, c)]);
                    scratch.jacobian.push(entry.sum());
                }
            }
        }
        let column = |k: usize| &scratch.jacobian[k * rows..(k + 1) * rows];
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for i in 0..self.views.len() {
            gradient(
                i,
                &Vector6::from_fn(|r, _| dot(column(6 * i + r), &scratch.residual)),
            );
            for j in 0..=i {
                block(
                    i,
                    j,
                    &Matrix6::from_fn(|r, c| dot(column(6 * i + r), column(6 * j + c))),
                );
            }
        }
        0.5 * dot(&scratch.residual, &scratch.residual)
    }
}
