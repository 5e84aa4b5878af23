//! What a view measures of a point, and its residual with derivatives.

use super::intrinsics::{Intrinsics, MAX_FREE};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, RowVector3, Vector2, Vector3};

/// One measurement with the root of its information: the residual is `root * (f(X) - z)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Measurement {
    /// A pixel. Thesis: eq. (8.2).
    Pixel {
        pixel: Vector2<f64>,
        root: Matrix2<f64>,
    },
    /// A point in the camera frame, metres. Thesis: eq. (9.1).
    Point {
        point: Vector3<f64>,
        root: Matrix3<f64>,
    },
    /// The inverse of the distance along the ray, per metre; `root` is 1 / sigma.
    InverseRange { inv_range: f64, root: f64 },
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
    fn add(
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
}

/// The losses of the kinds of measurements.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Losses {
    /// Of pixels.
    pub pixel: crate::Loss,
    /// Of points in the camera frame.
    pub point: crate::Loss,
    /// Of inverse ranges.
    pub inverse_range: crate::Loss,
}

impl Losses {
    fn all(&self) -> [crate::Loss; 3] {
        [self.pixel, self.point, self.inverse_range]
    }

    /// # Errors
    /// Where a threshold is not a positive number.
    pub(crate) fn check(&self) -> crate::Result<()> {
        self.all().iter().try_for_each(crate::Loss::check)
    }

    /// True where any of them is not quadratic.
    pub(crate) fn robust(&self) -> bool {
        self.all()
            .iter()
            .any(|loss| *loss != crate::Loss::Quadratic)
    }
}

/// Which second order of a robust cost a normal matrix has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Curvature {
    /// That of the reweighted quadratic, which lies above the cost.
    Above,
    /// The cost's own, and by the point alone.
    Own,
}

impl Measurement {
    /// The squared norm of the whitened residual at the point `x` of the camera frame; `None` where
    /// the camera does not see `x`.
    #[inline(always)]
    pub fn squared(&self, intrinsics: &Intrinsics, x: &Vector3<f64>) -> Option<f64> {
        Some(match self {
            Self::Pixel { pixel, root } => {
                (root * (intrinsics.camera.project(x)? - pixel)).norm_squared()
            }
            Self::Point { point, root } => (root * (x - point)).norm_squared(),
            Self::InverseRange { inv_range, root } => {
                let residual = root * (1.0 / x.norm() - inv_range);
                residual * residual
            }
        })
    }

    /// The components of the whitened residual at the point `x`, appended to `all`.
    pub fn components(&self, intrinsics: &Intrinsics, x: &Vector3<f64>, all: &mut Vec<f64>) {
        match self {
            Self::Pixel { pixel, root } => {
                if let Some(found) = intrinsics.camera.project(x) {
                    all.extend((root * (found - pixel)).iter());
                }
            }
            Self::Point { point, root } => all.extend((root * (x - point)).iter()),
            Self::InverseRange { inv_range, root } => all.push(root * (1.0 / x.norm() - inv_range)),
        }
    }

    /// The squared norm of the whitened residual of a pixel from `projected`; `None` of others.
    #[cfg(test)]
    pub fn squared_at(&self, projected: &Vector2<f64>) -> Option<f64> {
        match self {
            Self::Pixel { pixel, root } => Some((root * (projected - pixel)).norm_squared()),
            _ => None,
        }
    }

    /// The same measurement with another value.
    #[cfg(test)]
    pub fn replace(&mut self, new_pixel: Vector2<f64>, new_point: Vector3<f64>) {
        match self {
            Self::Pixel { pixel, .. } => *pixel = new_pixel,
            Self::Point { point, .. } => *point = new_point,
            Self::InverseRange { inv_range, .. } => *inv_range = 1.0 / new_point.norm(),
        }
    }

    /// Its loss.
    #[inline(always)]
    pub fn loss<'a>(&self, losses: &'a Losses) -> &'a crate::Loss {
        match self {
            Self::Pixel { .. } => &losses.pixel,
            Self::Point { .. } => &losses.point,
            Self::InverseRange { .. } => &losses.inverse_range,
        }
    }

    /// Add to the normal matrices at the point `x` of the camera frame; false where the camera does
    /// not see `x`.
    #[inline(always)]
    pub fn add(
        &self,
        intrinsics: &Intrinsics,
        x: &Vector3<f64>,
        losses: &Losses,
        curvature: Curvature,
        normal: &mut Normal,
    ) -> bool {
        let own = curvature == Curvature::Own;
        match self {
            Self::Pixel { pixel, root } => {
                let Some((found, by_point)) = intrinsics.camera.project_with_jacobian(x) else {
                    return false;
                };
                let residual = root * (found - pixel);
                let a: Matrix2x3<f64> = root * by_point;
                let s = residual.norm_squared();
                let (rho, weight) = losses.pixel.evaluate(s);
                let flattening = if own { losses.pixel.flattening(s) } else { 0.0 };
                normal.cost += 0.5 * rho;
                normal.add(&a.tr_mul(&a), &a.tr_mul(&residual), (weight, flattening));
                if !own && intrinsics.free() > 0 {
                    add_intrinsics(intrinsics, x, &found, root, (&a, &residual, weight), normal);
                }
            }
            Self::Point { point, root } => {
                // Thesis: eq. (9.1): the derivative by the point in the camera frame is the identity
                let residual = root * (x - point);
                let s = residual.norm_squared();
                let (rho, weight) = losses.point.evaluate(s);
                let flattening = if own { losses.point.flattening(s) } else { 0.0 };
                normal.cost += 0.5 * rho;
                let square = root.tr_mul(root);
                normal.add(&square, &root.tr_mul(&residual), (weight, flattening));
            }
            Self::InverseRange { inv_range, root } => {
                let range = x.norm();
                let residual = root * (1.0 / range - inv_range);
                let a: RowVector3<f64> = x.transpose() * (-root / (range * range * range));
                let s = residual * residual;
                let loss = losses.inverse_range;
                let (rho, weight) = loss.evaluate(s);
                let flattening = if own { loss.flattening(s) } else { 0.0 };
                normal.cost += 0.5 * rho;
                let gradient = a.transpose() * residual;
                normal.add(&a.tr_mul(&a), &gradient, (weight, flattening));
            }
        }
        true
    }
}

/// The part of the free intrinsics: `B^T B`, `B^T A` and `B^T e`, B the derivative by them.
fn add_intrinsics(
    intrinsics: &Intrinsics,
    x: &Vector3<f64>,
    pixel: &Vector2<f64>,
    root: &Matrix2<f64>,
    (a, residual, weight): (&Matrix2x3<f64>, &Vector2<f64>, f64),
    normal: &mut Normal,
) {
    let free = intrinsics.free();
    let mut b = [Vector2::zeros(); MAX_FREE];
    for (parameter, column) in b[..free].iter_mut().enumerate() {
        *column = root * intrinsics.derivative(parameter, x, pixel);
    }
    for i in 0..free {
        let weighted = b[i] * weight;
        normal.intrinsics_gradient[i] += weighted.dot(residual);
        normal.intrinsics_by_point[i] += a.tr_mul(&weighted);
        for (entry, other) in normal.intrinsics[i][..free].iter_mut().zip(&b) {
            *entry += weighted.dot(other);
        }
    }
}
