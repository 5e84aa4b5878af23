//! A rigid transform with a unit quaternion: `target_from_source`.

use crate::{Error, Result};
use nalgebra::{Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// A rigid transform `target_from_source`: `x_target = rotation * x_source + translation`.
///
/// A camera's pose is `world_from_camera`: its translation is the optical centre in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Rotation, target from source; always of unit norm.
    pub rotation: UnitQuaternion<f64>,
    /// Origin of the source frame in the target frame, metres.
    pub translation: Vector3<f64>,
}

impl Default for Pose {
    fn default() -> Self {
        Self::identity()
    }
}

impl Pose {
    /// The identity.
    pub fn identity() -> Self {
        Self {
            rotation: UnitQuaternion::identity(),
            translation: Vector3::zeros(),
        }
    }

    /// From its parts.
    pub fn new(rotation: UnitQuaternion<f64>, translation: Vector3<f64>) -> Self {
        Self {
            rotation,
            translation,
        }
    }

    /// From a translation and a quaternion in x, y, z, w order, normalised here.
    ///
    /// # Errors
    /// [`Error::Value`] where a number is not finite or the quaternion's norm is not near 1
    /// (within 1 %: a file with rounded digits passes, a wrong column order usually does not).
    pub fn from_parts(translation: [f64; 3], quat_xyzw: [f64; 4]) -> Result<Self> {
        if !translation.iter().all(|v| v.is_finite()) {
            return Err(Error::value(
                "translation",
                "finite metres",
                format!("{translation:?}"),
            ));
        }
        let [x, y, z, w] = quat_xyzw;
        let quaternion = Quaternion::new(w, x, y, z);
        let norm = quaternion.norm();
        if norm.is_nan() || (norm - 1.0).abs() >= 0.01 {
            return Err(Error::value(
                "quat_xyzw",
                "a quaternion of norm 1",
                format!("{quat_xyzw:?} of norm {norm}"),
            ));
        }
        Ok(Self::new(
            UnitQuaternion::from_quaternion(quaternion),
            translation.into(),
        ))
    }

    /// From a 4x4 homogeneous matrix; the rotation block is projected to SO(3).
    ///
    /// # Errors
    /// [`Error::Value`] where a number is not finite, the last row is not (0, 0, 0, 1), or the
    /// block is further than 2 % from a rotation.
    pub fn from_matrix(matrix: &Matrix4<f64>) -> Result<Self> {
        let block: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
        let translation: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
        let last = matrix.row(3) - nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0);
        let gram = (block.transpose() * block - Matrix3::identity()).norm();
        if !(matrix.iter().all(|v| v.is_finite())
            && last.norm() < 1e-6
            && gram < 0.04
            && block.determinant() > 0.0)
        {
            return Err(Error::value("pose matrix", "a 4x4 rigid transform", matrix));
        }
        Ok(Self::new(nearest_rotation(&block), translation))
    }

    /// The quaternion as x, y, z, w.
    pub fn quat_xyzw(&self) -> [f64; 4] {
        let q = self.rotation.quaternion();
        [q.i, q.j, q.k, q.w]
    }

    /// The homogeneous 4x4 matrix.
    pub fn matrix(&self) -> Matrix4<f64> {
        let mut matrix = self.rotation.to_homogeneous();
        matrix
            .fixed_view_mut::<3, 1>(0, 3)
            .copy_from(&self.translation);
        matrix
    }

    /// `source_from_target`.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self::new(rotation, -(rotation * self.translation))
    }

    /// A point of the source frame, in the target frame.
    pub fn transform(&self, point_in_source: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point_in_source + self.translation
    }

    /// Distance between the two origins, metres, and angle between the two rotations, radians.
    pub fn distance_and_angle(&self, other: &Pose) -> (f64, f64) {
        (
            (self.translation - other.translation).norm(),
            self.rotation.angle_to(&other.rotation),
        )
    }
}

/// `a_from_b * b_from_c = a_from_c`; the quaternion is renormalised so that long products stay unit.
impl std::ops::Mul for Pose {
    type Output = Pose;

    fn mul(self, other: Pose) -> Pose {
        let product = self.rotation.quaternion() * other.rotation.quaternion();
        Pose::new(
            UnitQuaternion::from_quaternion(product),
            self.rotation * other.translation + self.translation,
        )
    }
}

/// The rotation nearest to `block` in the Frobenius norm (polar decomposition by SVD).
fn nearest_rotation(block: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let svd = block.svd(true, true);
    let rotation = match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) => {
            let sign = (u * v_t).determinant().signum();
            u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t
        }
        _ => *block,
    };
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Pose {
        Pose::new(
            UnitQuaternion::from_euler_angles(0.3, -0.2, 1.1),
            Vector3::new(0.5, -1.5, 2.0),
        )
    }

    #[test]
    fn pose_times_inverse_is_identity() {
        let (d, a) = (sample() * sample().inverse()).distance_and_angle(&Pose::identity());
        assert!(d < 1e-14 && a < 1e-7, "{d} {a}");
    }

    #[test]
    fn pose_product_maps_points_as_names_say() {
        let a_from_b = sample();
        let b_from_c = Pose::new(
            UnitQuaternion::from_euler_angles(-0.7, 0.1, 0.4),
            Vector3::x(),
        );
        let point = Vector3::new(1.0, 2.0, 3.0);
        let through = a_from_b.transform(&b_from_c.transform(&point));
        assert!(((a_from_b * b_from_c).transform(&point) - through).norm() < 1e-14);
    }

    #[test]
    fn pose_matrix_scaled_rotation_is_projected() {
        let mut matrix = sample().matrix();
        matrix.fixed_view_mut::<3, 3>(0, 0).scale_mut(0.9998);
        let (d, a) = Pose::from_matrix(&matrix)
            .unwrap()
            .distance_and_angle(&sample());
        assert!(d < 1e-14 && a < 1e-7, "{d} {a}");
        matrix.fixed_view_mut::<3, 3>(0, 0).scale_mut(-1.0);
        assert!(
            Pose::from_matrix(&matrix).is_err(),
            "a reflection passed as a rotation"
        );
    }

    #[test]
    fn pose_of_quaternion_far_from_unit_is_an_error() {
        let error = Pose::from_parts([0.0; 3], [0.0, 0.0, 0.0, 0.5]).unwrap_err();
        assert!(error.to_string().contains("quat_xyzw"), "{error}");
        assert!(Pose::from_parts([f64::NAN, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).is_err());
    }
}
