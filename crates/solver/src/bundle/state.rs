//! Poses as the residuals use them: camera from world, updated from the left.

use nalgebra::{Matrix3, UnitQuaternion, Vector3, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// A camera's pose, `camera_from_world` (the thesis's K). The update is from the left,
/// `K <- exp([omega, v]) K` (Thesis: section 8.4.2), which for `world_from_camera` is
/// `exp(-[omega, v])` from the right: the twist is in the camera's own frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewPose {
    quaternion: UnitQuaternion<f64>,
    /// Camera from world.
    pub rotation: Matrix3<f64>,
    /// The world's origin in the camera frame, metres.
    pub translation: Vector3<f64>,
}

impl ViewPose {
    pub fn from_world_from_camera(pose: &Pose) -> Self {
        Self::from_camera_from_world(pose.inverse())
    }

    fn from_camera_from_world(pose: Pose) -> Self {
        Self {
            quaternion: pose.rotation,
            rotation: pose.rotation.to_rotation_matrix().into_inner(),
            translation: pose.translation,
        }
    }

    /// Camera from world.
    pub fn pose(&self) -> Pose {
        Pose::new(self.quaternion, self.translation)
    }

    pub fn world_from_camera(&self) -> Pose {
        self.pose().inverse()
    }

    #[inline(always)]
    pub fn transform(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.translation
    }

    pub fn moved_by(&self, twist: &Vector6<f64>) -> Self {
        Self::from_camera_from_world(se3::exp(twist) * self.pose())
    }
}
