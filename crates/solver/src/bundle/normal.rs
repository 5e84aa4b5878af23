//! The normal matrix of one view of one point, by the point in the camera frame.

use super::intrinsics::MAX_FREE;
use crate::Loss;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Which second order of a robust cost a normal matrix has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Curvature {
    /// That of the reweighted quadratic, which lies above the cost.
    Above,
    /// The cost's own, and by the point alone.
    Own,
}

/// What all measurements that a view makes of one point say of the point in the camera frame: the
/// normal matrix and the gradient by that point; and by the free intrinsics where there are any.
///
/// Every residual depends on the pose and the point through the point in the camera frame alone, so
/// the normal matrices of pose and point follow from these.
pub(crate) struct Normal {
    pub m: Matrix3<f64>,
    pub g: Vector3<f64>,
    pub cost: f64,
    /// Free intrinsics by the point in the camera frame.
    pub intrinsics_by_point: [Vector3<f64>; MAX_FREE],
    pub intrinsics: [[f64; MAX_FREE]; MAX_FREE],
    pub intrinsics_gradient: [f64; MAX_FREE],
}

impl Normal {
    pub fn new() -> Self {
        Self {
            m: Matrix3::zeros(),
            g: Vector3::zeros(),
            cost: 0.0,
            intrinsics_by_point: [Vector3::zeros(); MAX_FREE],
            intrinsics: [[0.0; MAX_FREE]; MAX_FREE],
            intrinsics_gradient: [0.0; MAX_FREE],
        }
    }

    /// Add the square `A^T A` of a derivative and `A^T r` by their weight, without the part of the
    /// curvature along the residual that a robust loss has not.
    #[inline(always)]
    pub fn add(
        &mut self,
        square: &Matrix3<f64>,
        gradient: &Vector3<f64>,
        (weight, flattening): (f64, f64),
    ) {
        self.m += square * weight;
        self.g += gradient * weight;
        if flattening > 0.0 {
            self.m -= gradient * gradient.transpose() * flattening;
        }
    }

    #[inline(always)]
    pub fn clear(&mut self, free: usize) {
        self.m = Matrix3::zeros();
        self.g = Vector3::zeros();
        self.cost = 0.0;
        self.intrinsics_by_point[..free].fill(Vector3::zeros());
        self.intrinsics_gradient[..free].fill(0.0);
        for row in &mut self.intrinsics[..free] {
            row[..free].fill(0.0);
        }
    }

    /// Add a residual with its derivative `a` by the point in the camera frame; its weight.
    #[inline(always)]
    pub fn add_residual<const R: usize>(
        &mut self,
        residual: &SVector<f64, R>,
        a: &SMatrix<f64, R, 3>,
        loss: &Loss,
        curvature: Curvature,
    ) -> f64 {
        let s = residual.norm_squared();
        let (rho, weight) = loss.evaluate(s);
        let own = curvature == Curvature::Own;
        let flattening = if own { loss.flattening(s) } else { 0.0 };
        self.cost += 0.5 * rho;
        self.add(&a.tr_mul(a), &a.tr_mul(residual), (weight, flattening));
        weight
    }

    /// Add the part of the free intrinsics: `B^T B`, `B^T A` and `B^T e`, `b` the derivative by them.
    #[inline(always)]
    pub fn add_intrinsics<const R: usize>(
        &mut self,
        b: &[SVector<f64, R>],
        (residual, a): (&SVector<f64, R>, &SMatrix<f64, R, 3>),
        weight: f64,
    ) {
        for i in 0..b.len() {
            let weighted = b[i] * weight;
            self.intrinsics_gradient[i] += weighted.dot(residual);
            self.intrinsics_by_point[i] += a.tr_mul(&weighted);
            for (entry, other) in self.intrinsics[i].iter_mut().zip(b) {
                *entry += weighted.dot(other);
            }
        }
    }
}
