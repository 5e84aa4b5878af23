//! What is known of a node apart from the others: all of it, the vertical, or the heading.

use super::group::Group;
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};
use sphereflow_sphere::lie::so3;

#[derive(Clone, Copy, Debug)]
pub(super) enum Prior<G, const D: usize> {
    Whole {
        node: usize,
        inverse: G,
        root: SMatrix<f64, D, D>,
    },
    Gravity {
        node: usize,
        world: Vector3<f64>,
        body: Vector3<f64>,
        root: f64,
    },
    Yaw {
        node: usize,
        axis: Vector3<f64>,
        known: UnitQuaternion<f64>,
        root: f64,
    },
}

impl<G, const D: usize> Prior<G, D> {
    pub fn node(&self) -> usize {
        match self {
            Self::Whole { node, .. } | Self::Gravity { node, .. } | Self::Yaw { node, .. } => *node,
        }
    }
}

impl<G: Group<D>, const D: usize> Prior<G, D> {
    /// Residual (in the first rows) and its derivative by the node's update.
    pub fn evaluate(&self, nodes: &[G]) -> (SVector<f64, D>, SMatrix<f64, D, D>) {
        let mut residual = SVector::<f64, D>::zeros();
        let mut jacobian = SMatrix::<f64, D, D>::zeros();
        match self {
            Self::Whole {
                node,
                inverse,
                root,
            } => {
                let error = inverse.compose(&nodes[*node]).log();
                return (root * error, root * G::right_jacobian_inverse(&error));
            }
            Self::Gravity {
                node,
                world,
                body,
                root,
            } => {
                let seen = nodes[*node].pose().rotation.inverse() * world;
                residual.rows_mut(0, 3).copy_from(&((seen - body) * *root));
                let block = so3::hat(&seen) * *root;
                jacobian.view_mut((0, 0), (3, 3)).copy_from(&block);
            }
            Self::Yaw {
                node,
                axis,
                known,
                root,
            } => {
                let rotation = nodes[*node].pose().rotation;
                let turn = so3::log(&(rotation * known.inverse()));
                residual[0] = root * axis.dot(&turn);
                let by_update: Matrix3<f64> =
                    so3::left_jacobian_inverse(&turn) * so3::adjoint(&rotation);
                let row = axis.transpose() * by_update * *root;
                jacobian.view_mut((0, 0), (1, 3)).copy_from(&row);
            }
        }
        (residual, jacobian)
    }
}
