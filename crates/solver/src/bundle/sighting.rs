//! What a rolling depth camera sees of a point: a pixel of a row, and the inverse depth there.
//!
//! Thesis: section 9.3.2, with the inverse depth along the axis instead of a point in space: its errors
//! are nearly normal, and the pixel is counted once.

use super::device::{FIELD, OFFSET, READOUT, TERMS};
use super::intrinsics::MAX_FREE;
use super::normal::{Curvature, Normal};
use super::rows::CameraState;
use crate::Loss;
use nalgebra::{Matrix1x3, Matrix2, Vector1, Vector2, Vector3};
use sphereflow_sphere::depth_correction::correction_terms;

/// A pixel; `row` is the time of its row after the pose's, as a share of the read-out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RowPixel {
    pub pixel: Vector2<f64>,
    pub root: Matrix2<f64>,
    pub row: f64,
}

/// 1/Z at a pixel. The camera's is `(value + rate offset) (1 + m)` where colour and depth are
/// `offset` seconds apart and `m` is the depth field at the pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InverseDepth {
    /// As read where the offset is zero, to first order, 1/m.
    pub value: f64,
    /// By the offset, 1/(m s).
    pub rate: f64,
    /// 1 / sigma.
    pub root: f64,
    pub row: f64,
    /// Normalised coordinates of the pixel of the depth image.
    pub place: [f64; 2],
}

impl RowPixel {
    #[inline(always)]
    pub fn residual(&self, camera: CameraState, y: &Vector3<f64>) -> Option<Vector2<f64>> {
        let t = self.row * camera.intrinsics.device.readout_s();
        let found = (camera.intrinsics.camera).project(&camera.rows.seen_at(y, t))?;
        Some(self.root * (found - self.pixel))
    }

    /// Add to the normal matrices at the point `y` of the pose's camera frame; false where the camera
    /// does not see it.
    #[inline(always)]
    pub fn add(
        &self,
        camera: CameraState,
        y: &Vector3<f64>,
        loss: &Loss,
        curvature: Curvature,
        normal: &mut Normal,
    ) -> bool {
        let intrinsics = camera.intrinsics;
        let t = self.row * intrinsics.device.readout_s();
        let moved = camera.rows.with_derivatives(y, t);
        let projected = intrinsics.camera.project_with_jacobian(&moved.point);
        let Some((found, by_moved)) = projected else {
            return false;
        };
        let residual = self.root * (found - self.pixel);
        let by_moved = self.root * by_moved;
        let a = by_moved * moved.by_point;
        let weight = normal.add_residual(&residual, &a, loss, curvature);
        let free = intrinsics.free();
        if curvature == Curvature::Above && free > 0 {
            let mut b = [Vector2::zeros(); MAX_FREE];
            for (parameter, column) in b[..free].iter_mut().enumerate() {
                *column = match intrinsics.device_entry(parameter) {
                    None => self.root * intrinsics.derivative(parameter, &moved.point, &found),
                    Some(READOUT) => by_moved * moved.by_time * self.row,
                    Some(_) => continue,
                };
            }
            normal.add_intrinsics(&b[..free], (&residual, &a), weight);
        }
        true
    }
}

impl InverseDepth {
    /// What was read at the offset, the terms of the field, and `1 + m`.
    #[inline(always)]
    fn measured(&self, camera: CameraState) -> (f64, [f64; TERMS], f64) {
        let device = &camera.intrinsics.device;
        let [_, terms @ ..] = correction_terms(self.place[0], self.place[1]);
        let sum = (device.field().iter().zip(terms)).map(|(c, term)| c * term);
        let factor = 1.0 + sum.sum::<f64>();
        (self.value + self.rate * device.offset_s(), terms, factor)
    }

    #[inline(always)]
    pub fn residual(&self, camera: CameraState, y: &Vector3<f64>) -> Option<f64> {
        let t = self.row * camera.intrinsics.device.readout_s();
        let z = camera.rows.seen_at(y, t).z;
        let (read, _, factor) = self.measured(camera);
        (z > 0.0).then(|| self.root * (1.0 / z - read * factor))
    }

    /// As [`RowPixel::add`].
    #[inline(always)]
    pub fn add(
        &self,
        camera: CameraState,
        y: &Vector3<f64>,
        loss: &Loss,
        curvature: Curvature,
        normal: &mut Normal,
    ) -> bool {
        let intrinsics = camera.intrinsics;
        let t = self.row * intrinsics.device.readout_s();
        let moved = camera.rows.with_derivatives(y, t);
        let z = moved.point.z;
        if z.is_nan() || z <= 0.0 {
            return false;
        }
        let (read, terms, factor) = self.measured(camera);
        let residual = Vector1::new(self.root * (1.0 / z - read * factor));
        let by_z = -self.root / (z * z);
        let a: Matrix1x3<f64> = moved.by_point.row(2) * by_z;
        let weight = normal.add_residual(&residual, &a, loss, curvature);
        let free = intrinsics.free();
        if curvature == Curvature::Above && free > 0 {
            let mut b = [Vector1::new(0.0); MAX_FREE];
            for (parameter, column) in b[..free].iter_mut().enumerate() {
                column.x = match intrinsics.device_entry(parameter) {
                    Some(READOUT) => by_z * moved.by_time.z * self.row,
                    Some(OFFSET) => -self.root * self.rate * factor,
                    Some(entry) => -self.root * read * terms[entry - FIELD],
                    None => 0.0,
                };
            }
            normal.add_intrinsics(&b[..free], (&residual, &a), weight);
        }
        true
    }
}
