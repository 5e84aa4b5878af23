//! What a view measures of a point, and its residual with derivatives.

use super::intrinsics::MAX_FREE;
use super::normal::{Curvature, Normal};
use super::rows::CameraState;
use super::sighting::{InverseDepth, RowPixel};
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
    /// A pixel of a row that is exposed at its own time.
    Row(RowPixel),
    /// The inverse of the depth along the optical axis at such a pixel, as a camera measured it.
    InverseDepth(InverseDepth),
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
    /// Of inverse depths.
    pub inverse_depth: crate::Loss,
}

impl Losses {
    fn all(&self) -> [crate::Loss; 4] {
        [
            self.pixel,
            self.point,
            self.inverse_range,
            self.inverse_depth,
        ]
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

impl Measurement {
    /// True where it depends on the camera's parameters.
    #[inline(always)]
    pub fn uses_camera(&self) -> bool {
        matches!(
            self,
            Self::Pixel { .. } | Self::Row(_) | Self::InverseDepth(_)
        )
    }

    /// True where it is a pixel: a ray without a length.
    pub fn is_ray(&self) -> bool {
        matches!(self, Self::Pixel { .. } | Self::Row(_))
    }

    /// The squared norm of the whitened residual at the point `x` of the camera frame; `None` where
    /// the camera does not see `x`.
    #[inline(always)]
    pub fn squared(&self, camera: CameraState, x: &Vector3<f64>) -> Option<f64> {
        Some(match self {
            Self::Pixel { pixel, root } => {
                (root * (camera.intrinsics.camera.project(x)? - pixel)).norm_squared()
            }
            Self::Point { point, root } => (root * (x - point)).norm_squared(),
            Self::InverseRange { inv_range, root } => {
                let residual = root * (1.0 / x.norm() - inv_range);
                residual * residual
            }
            Self::Row(row) => row.residual(camera, x)?.norm_squared(),
            Self::InverseDepth(depth) => depth.residual(camera, x)?.powi(2),
        })
    }

    /// The components of the whitened residual at the point `x`, appended to `all`.
    pub fn components(&self, camera: CameraState, x: &Vector3<f64>, all: &mut Vec<f64>) {
        match self {
            Self::Pixel { pixel, root } => {
                if let Some(found) = camera.intrinsics.camera.project(x) {
                    all.extend((root * (found - pixel)).iter());
                }
            }
            Self::Point { point, root } => all.extend((root * (x - point)).iter()),
            Self::InverseRange { inv_range, root } => all.push(root * (1.0 / x.norm() - inv_range)),
            Self::Row(row) => all.extend(row.residual(camera, x).iter().flatten()),
            Self::InverseDepth(depth) => all.extend(depth.residual(camera, x)),
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
            Self::Row(_) | Self::InverseDepth(_) => {}
        }
    }

    /// Its loss.
    #[inline(always)]
    pub fn loss<'a>(&self, losses: &'a Losses) -> &'a crate::Loss {
        match self {
            Self::Pixel { .. } => &losses.pixel,
            Self::Point { .. } => &losses.point,
            Self::InverseRange { .. } => &losses.inverse_range,
            Self::Row(_) => &losses.pixel,
            Self::InverseDepth(_) => &losses.inverse_depth,
        }
    }

    /// Add to the normal matrices at the point `x` of the camera frame; false where the camera does
    /// not see `x`.
    #[inline(always)]
    pub fn add(
        &self,
        camera: CameraState,
        x: &Vector3<f64>,
        losses: &Losses,
        curvature: Curvature,
        normal: &mut Normal,
    ) -> bool {
        let own = curvature == Curvature::Own;
        let intrinsics = camera.intrinsics;
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
                    let mut b = [Vector2::zeros(); MAX_FREE];
                    for (parameter, column) in b[..intrinsics.free()].iter_mut().enumerate() {
                        *column = root * intrinsics.derivative(parameter, x, &found);
                    }
                    normal.add_intrinsics(&b[..intrinsics.free()], (&residual, &a), weight);
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
            Self::Row(row) => return row.add(camera, x, &losses.pixel, curvature, normal),
            Self::InverseDepth(depth) => {
                return depth.add(camera, x, &losses.inverse_depth, curvature, normal);
            }
        }
        true
    }
}
