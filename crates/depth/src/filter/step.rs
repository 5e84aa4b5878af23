//! The motion between two camera poses, as pixels need it.

use nalgebra::{Matrix3, Vector3};
use sphereflow_core::Pose;

/// The motion: `x_old = rotation x_new + translation`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub rotation: Matrix3<f32>,
    pub translation: Vector3<f32>,
}

impl Step {
    /// A point of the new camera's ray, over its range, in the old camera.
    #[inline(always)]
    pub fn there(&self, ray: &Vector3<f32>, zeta: f32) -> Vector3<f32> {
        self.rotation * ray + self.translation * zeta
    }
}

/// `old_from_new` of two poses in the world.
pub(super) fn relative(new: &Pose, old: &Pose) -> Step {
    let old_from_new = old.inverse() * *new;
    Step {
        rotation: old_from_new.rotation.to_rotation_matrix().matrix().cast(),
        translation: old_from_new.translation.cast(),
    }
}
