//! Gaussian knowledge: of one pose, of its attitude alone, or of several poses and motions together.

use super::ids::{Block, MOTION, NONE};
use super::inertial::Motion;
use super::state::ViewPose;
use crate::{Error, Result};
use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// Difference of the triangles, as a share of the largest entry, that rounding explains: products of
/// 6 x 6 matrices of condition 1e5 computed in double precision.
const ASYMMETRY: f64 = 1e-9;

/// The residual is `root * r + offset`, `r` the stacked `log(K_i K0_i^-1)` (twists `[omega, v]` in
/// the camera frames) of the poses `views`, then what the motions have over those of the knowledge
/// (velocity, gyrometer bias, accelerometer bias).
#[derive(Clone, Debug)]
pub(crate) struct Prior {
    pub views: Vec<usize>,
    /// Inverses of the camera-from-world poses of the knowledge.
    inverses: Vec<Pose>,
    /// Indices of motions, and those of the knowledge.
    pub motions: Vec<usize>,
    around: Vec<Motion>,
    root: DMatrix<f64>,
    offset: DVector<f64>,
}

/// Poses and motions.
pub(crate) type State<'a> = (&'a [ViewPose], &'a [Motion]);

/// Room for the evaluation of the largest prior.
#[derive(Clone, Debug, Default)]
pub(crate) struct PriorScratch {
    /// What is known minus what is: twists of the poses, then differences of the motions.
    gaps: Vec<f64>,
    residual: Vec<f64>,
    jacobian: Vec<f64>,
}

/// The root `L^T` of the information `L L^T` of a covariance; the error names `argument`.
pub(crate) fn root_information<const N: usize>(
    argument: &str,
    covariance: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>> {
    let inverse = symmetric(covariance).and_then(|c| c.cholesky().map(|factor| factor.inverse()));
    root_of(inverse).ok_or_else(|| refused(argument, covariance))
}

/// The root `L^T` of an information `L L^T`; the error names `argument`.
pub(crate) fn root_of_information<const N: usize>(
    argument: &str,
    information: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>> {
    root_of(symmetric(information).copied()).ok_or_else(|| refused(argument, information))
}

fn root_of<const N: usize>(information: Option<SMatrix<f64, N, N>>) -> Option<SMatrix<f64, N, N>> {
    let factor = information?.cholesky()?;
    let finite = factor.l_dirty().iter().all(|v| v.is_finite());
    finite.then(|| factor.l().transpose())
}

/// The matrix, where it is symmetric and finite: rounding of one computed elsewhere is no asymmetry.
fn symmetric<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Option<&SMatrix<f64, N, N>> {
    let scale = matrix.abs().max();
    let even = (matrix - matrix.transpose()).abs().max() <= ASYMMETRY * scale;
    (scale.is_finite() && even).then_some(matrix)
}

fn refused<const N: usize>(argument: &str, matrix: &SMatrix<f64, N, N>) -> Error {
    let expected = "a symmetric positive definite matrix of finite numbers";
    Error::value(argument, expected, matrix)
}

impl Prior {
    /// Of one pose; `root` has six columns and any number of rows.
    pub fn of_pose<const R: usize>(view: usize, pose: &Pose, root: &SMatrix<f64, R, 6>) -> Self {
        Self {
            views: vec![view],
            inverses: vec![*pose],
            motions: Vec::new(),
            around: Vec::new(),
            root: DMatrix::from_column_slice(R, 6, root.as_slice()),
            offset: DVector::zeros(R),
        }
    }

    /// Of several poses (world from camera) and motions together, around their states.
    pub fn joint(
        (views, poses): (Vec<usize>, Vec<Pose>),
        (motions, around): (Vec<usize>, Vec<Motion>),
        root: DMatrix<f64>,
        offset: DVector<f64>,
    ) -> Self {
        Self {
            views,
            inverses: poses,
            motions,
            around,
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
        !self.views.is_empty() && self.root.columns(3, 3).norm() > 0.0
    }

    fn evaluate(&self, (poses, motions): State, scratch: &mut PriorScratch) {
        scratch.gaps.clear();
        for (view, inverse) in self.views.iter().zip(&self.inverses) {
            let twist = se3::log(&(poses[*view].pose() * *inverse));
            scratch.gaps.extend(twist.iter());
        }
        for (motion, around) in self.motions.iter().zip(&self.around) {
            scratch.gaps.extend(motions[*motion].minus(around).iter());
        }
        scratch.residual.clear();
        scratch.residual.extend(self.offset.iter());
        for (column, gap) in scratch.gaps.iter().enumerate() {
            for (row, residual) in scratch.residual.iter_mut().enumerate() {
                *residual += self.root[(row, column)] * gap;
            }
        }
    }

    /// Half the squared residual.
    pub fn cost(&self, state: State, scratch: &mut PriorScratch) -> f64 {
        self.evaluate(state, scratch);
        0.5 * scratch.residual.iter().map(|e| e * e).sum::<f64>()
    }

    /// Hands the blocks of the normal matrix (row, column) and of the gradient to `block` and
    /// `gradient`, for the blocks of the poses and of the motions that move.
    pub fn linearise(
        &self,
        state: State,
        (view_block, motion_block): (&[u32], &[u32]),
        scratch: &mut PriorScratch,
        mut block: impl FnMut(u32, u32, &Block),
        mut gradient: impl FnMut(u32, &SVector<f64, MOTION>),
    ) {
        self.evaluate(state, scratch);
        let rows = self.root.nrows();
        // the Jacobian by columns: rows x 6 for each pose, rows x 9 for each motion
        scratch.jacobian.clear();
        for view in 0..self.views.len() {
            let twist = Vector6::from_column_slice(&scratch.gaps[6 * view..6 * view + 6]);
            let by_update = se3::left_jacobian_inverse(&twist);
            for c in 0..6 {
                for r in 0..rows {
                    let entry = (0..6).map(|k| self.root[(r, 6 * view + k)] * by_update[(k, c)]);
                    scratch.jacobian.push(entry.sum());
                }
            }
        }
        let of_motions = self.root.as_slice().iter().skip(scratch.jacobian.len());
        scratch.jacobian.extend(of_motions);
        let column = |k: usize| &scratch.jacobian[k * rows..(k + 1) * rows];
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        // block, first column, columns
        let poses = self.views.len();
        let member = |i: usize| match i.checked_sub(poses) {
            None => (view_block[self.views[i]], 6 * i, 6),
            Some(k) => (
                motion_block[self.motions[k]],
                6 * poses + MOTION * k,
                MOTION,
            ),
        };
        for i in 0..poses + self.motions.len() {
            let (row, first, height) = member(i);
            if row == NONE {
                continue;
            }
            let entry = |r: usize| dot(column(first + r), &scratch.residual);
            let g = SVector::from_fn(|r, _| if r < height { entry(r) } else { 0.0 });
            gradient(row, &g);
            for j in 0..=i {
                let (other, start, width) = member(j);
                let entry = |r: usize, c: usize| dot(column(first + r), column(start + c));
                let inside = |r: usize, c: usize| r < height && c < width;
                if other != NONE {
                    let normal = |r, c| if inside(r, c) { entry(r, c) } else { 0.0 };
                    block(row, other, &Block::from_fn(normal));
                }
            }
        }
    }
}
