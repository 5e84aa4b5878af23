//! What a pose graph needs of a group: exponential, logarithm, adjoint.

use super::similarity::Similarity;
use nalgebra::{Matrix6, SMatrix, SVector, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// A Lie group of dimension `D` whose elements are `target_from_source` transforms. Tangent vectors
/// begin with `[omega, v]`, in the source frame.
pub trait Group<const D: usize>: Copy + Send + Sync + std::fmt::Debug {
    /// The product `a_from_b * b_from_c`.
    fn compose(&self, other: &Self) -> Self;
    /// The inverse.
    fn inverse(&self) -> Self;
    /// The exponential of a tangent vector.
    fn exp(tangent: &SVector<f64, D>) -> Self;
    /// The tangent vector of rotation angle at most pi.
    fn log(&self) -> SVector<f64, D>;
    /// `T exp(x) T^-1 = exp(adjoint(T) x)`.
    fn adjoint(&self) -> SMatrix<f64, D, D>;
    /// `log(T exp(d)) = log(T) + right_jacobian_inverse(log(T)) d` to first order.
    fn right_jacobian_inverse(tangent: &SVector<f64, D>) -> SMatrix<f64, D, D>;
    /// The rigid part: rotation and translation.
    fn pose(&self) -> Pose;
    /// True where every number is finite (and the scale positive).
    fn is_valid(&self) -> bool;
}

impl Group<6> for Pose {
    fn compose(&self, other: &Self) -> Self {
        *self * *other
    }

    fn inverse(&self) -> Self {
        Pose::inverse(self)
    }

    fn exp(tangent: &Vector6<f64>) -> Self {
        se3::exp(tangent)
    }

    fn log(&self) -> Vector6<f64> {
        se3::log(self)
    }

    fn adjoint(&self) -> Matrix6<f64> {
        se3::adjoint(self)
    }

    fn right_jacobian_inverse(tangent: &Vector6<f64>) -> Matrix6<f64> {
        se3::right_jacobian_inverse(tangent)
    }

    fn pose(&self) -> Pose {
        *self
    }

    fn is_valid(&self) -> bool {
        self.translation
            .iter()
            .chain(self.rotation.coords.iter())
            .all(|v| v.is_finite())
    }
}

impl Group<7> for Similarity {
    fn compose(&self, other: &Self) -> Self {
        *self * *other
    }

    fn inverse(&self) -> Self {
        Similarity::inverse(self)
    }

    fn exp(tangent: &SVector<f64, 7>) -> Self {
        Similarity::exp(tangent)
    }

    fn log(&self) -> SVector<f64, 7> {
        Similarity::log(self)
    }

    fn adjoint(&self) -> SMatrix<f64, 7, 7> {
        Similarity::adjoint(self)
    }

    fn right_jacobian_inverse(tangent: &SVector<f64, 7>) -> SMatrix<f64, 7, 7> {
        Similarity::right_jacobian_inverse(tangent)
    }

    fn pose(&self) -> Pose {
        self.pose
    }

    fn is_valid(&self) -> bool {
        Group::<6>::is_valid(&self.pose) && self.scale.is_finite() && self.scale > 0.0
    }
}
