//! Yaw, pitch and roll of a camera (x right, y down, z forward).

use nalgebra::{UnitQuaternion, Vector3};

/// Below this cosine of pitch only yaw minus or plus roll is told: rounding of the rotation.
const LOCKED: f64 = 4e-15;

/// `world_from_camera = q_y(yaw) q_x(pitch) q_z(roll)`, radians: yaw turns right, pitch looks up,
/// roll turns clockwise as the camera sees itself along z.
///
/// Thesis: section C.1.3. Of the printed factors of `R = R_phi R_theta R_psi` (world to camera)
/// only `R_psi` has these signs; `R_theta` and `R_phi` are printed transposed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Euler {
    /// psi, about y: positive turns right; -pi to pi.
    pub yaw_rad: f64,
    /// theta, about the new x: positive looks up; -pi/2 to pi/2.
    pub pitch_rad: f64,
    /// phi, about the newest z: positive is clockwise seen along z; -pi to pi.
    pub roll_rad: f64,
}

impl Euler {
    /// The angles of a rotation. Looking straight up or down (gimbal lock) yaw and roll turn about
    /// the same axis: then roll is 0, and the angles still give the rotation.
    pub fn from_rotation(world_from_camera: &UnitQuaternion<f64>) -> Self {
        let r = world_from_camera.to_rotation_matrix();
        let flat = r[(0, 2)].hypot(r[(2, 2)]);
        let yaw_rad = if flat > LOCKED {
            r[(0, 2)].atan2(r[(2, 2)])
        } else {
            (-r[(2, 0)]).atan2(r[(0, 0)])
        };
        // with the yaw taken off, what is left of the x axis is the roll: so that rounding of a
        // badly told yaw is made up for
        let (sine, cosine) = yaw_rad.sin_cos();
        let across = cosine * r[(0, 0)] - sine * r[(2, 0)];
        let down = cosine * r[(0, 1)] - sine * r[(2, 1)];
        Self {
            yaw_rad,
            pitch_rad: (-r[(1, 2)]).atan2(flat),
            roll_rad: (-down).atan2(across),
        }
    }

    /// The rotation `world_from_camera`.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        let about = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
        about(Vector3::y_axis(), self.yaw_rad)
            * about(Vector3::x_axis(), self.pitch_rad)
            * about(Vector3::z_axis(), self.roll_rad)
    }

    /// True where yaw and roll turn about the same axis, to rounding.
    pub fn is_gimbal_locked(&self) -> bool {
        self.pitch_rad.cos() <= LOCKED
    }
}
