//! Relative poses measured between two of the poses, each with a loss.

use super::ids::{Block, MOTION, NONE};
use super::state::ViewPose;
use crate::Loss;
use nalgebra::{Matrix6, SVector, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// The residual is `root * log(a_from_b measured^-1)`: a twist `[omega, v]` in the frame of `a`.
#[derive(Clone, Debug)]
pub(crate) struct RelativePose {
    pub a: usize,
    pub b: usize,
    /// Inverse of the measured `a_from_b`.
    pub inverse: Pose,
    pub root: Matrix6<f64>,
    pub loss: Loss,
}

impl RelativePose {
    /// `a_from_b` at these poses, and the log of what it has over the measured one.
    fn gap(&self, poses: &[ViewPose]) -> (Pose, Vector6<f64>) {
        let a_from_b = poses[self.a].pose() * poses[self.b].world_from_camera();
        (a_from_b, se3::log(&(a_from_b * self.inverse)))
    }

    /// Half the loss of the squared residual.
    pub fn cost(&self, poses: &[ViewPose]) -> f64 {
        let square = (self.root * self.gap(poses).1).norm_squared();
        0.5 * self.loss.evaluate(square).0
    }

    /// Hands the blocks of the normal matrix (row, column) and of the gradient to `block` and
    /// `gradient`, for the poses that move.
    pub fn linearise(
        &self,
        poses: &[ViewPose],
        view_block: &[u32],
        mut block: impl FnMut(u32, u32, &Block),
        mut gradient: impl FnMut(u32, &SVector<f64, MOTION>),
    ) {
        let (a_from_b, gap) = self.gap(poses);
        let residual = self.root * gap;
        let weight = self.loss.evaluate(residual.norm_squared()).1;
        // exp(da) a_from_b exp(-db) = exp(da) exp(-Ad(a_from_b) db) a_from_b
        let by_a = self.root * se3::left_jacobian_inverse(&gap);
        let by_b = -by_a * se3::adjoint(&a_from_b);
        let ends = [(view_block[self.a], by_a), (view_block[self.b], by_b)];
        for (k, (row, by_row)) in ends.iter().enumerate() {
            if *row == NONE {
                continue;
            }
            let mut g = SVector::<f64, MOTION>::zeros();
            g.fixed_rows_mut::<6>(0)
                .copy_from(&(by_row.tr_mul(&residual) * weight));
            gradient(*row, &g);
            for (column, by_column) in &ends[..=k] {
                if *column != NONE {
                    let mut normal = Block::zeros();
                    let product = by_row.tr_mul(by_column) * weight;
                    normal.fixed_view_mut::<6, 6>(0, 0).copy_from(&product);
                    block(*row, *column, &normal);
                }
            }
        }
    }
}
