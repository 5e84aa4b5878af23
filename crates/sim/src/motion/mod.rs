//! Camera paths with exact velocities and accelerations.

mod curve;
mod presets;

pub use curve::{Curve, Wave};

use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_core::{Pose, Twist};

/// A camera path: three curves for the position and three for the attitude
/// `q = q_y(yaw) q_x(pitch) q_z(roll)`, where positive yaw turns right, positive pitch looks up and
/// positive roll turns clockwise as seen along the optical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Position of the camera in the world, metres.
    pub position_m: [Curve; 3],
    /// Turn about the world's y axis, radians.
    pub yaw_rad: Curve,
    /// Turn about the turned x axis, radians; must stay below pi/2 in size.
    pub pitch_rad: Curve,
    /// Turn about the optical axis, radians.
    pub roll_rad: Curve,
    /// Time the path is meant for, seconds (it is defined for all times).
    pub duration_s: f64,
}

/// Where a moving camera is and how it moves at one instant; all derivatives are exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionState {
    /// The camera's frame in the world.
    pub world_from_camera: Pose,
    /// Angular and linear velocity, camera frame.
    pub twist: Twist,
    /// Second derivative of the position C'', world frame, m/s^2 (without gravity).
    pub accel_world_m_s2: Vector3<f64>,
    /// Derivative of the angular velocity, camera frame, rad/s^2.
    pub angular_accel_rad_s2: Vector3<f64>,
}

impl Motion {
    /// Pose and derivatives at `t_s`.
    ///
    /// Thesis: eq. (1.8). `q' = q omega / 2` and `C' = q v q*` with omega and v in the camera frame.
    pub fn state(&self, t_s: f64) -> MotionState {
        let [x, y, z] = [0, 1, 2].map(|axis| self.position_m[axis].at(t_s));
        let angles = [&self.yaw_rad, &self.pitch_rad, &self.roll_rad].map(|curve| curve.at(t_s));
        let rotation = attitude(angles[0][0], angles[1][0], angles[2][0]);
        let (angular_rad_s, angular_accel_rad_s2) = body_rates(angles);
        let velocity = Vector3::new(x[1], y[1], z[1]);
        MotionState {
            world_from_camera: Pose::new(rotation, Vector3::new(x[0], y[0], z[0])),
            twist: Twist {
                angular_rad_s,
                linear_m_s: rotation.inverse() * velocity,
            },
            accel_world_m_s2: Vector3::new(x[2], y[2], z[2]),
            angular_accel_rad_s2,
        }
    }

    /// The pose alone at `t_s`.
    pub fn pose(&self, t_s: f64) -> Pose {
        self.state(t_s).world_from_camera
    }
}

/// `q_y(yaw) q_x(pitch) q_z(roll)`, the order of the thesis's appendix C.1.3 (whose printed
/// matrices of pitch and roll must be transposed).
fn attitude(yaw: f64, pitch: f64, roll: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw)
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), pitch)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll)
}

/// Angular velocity and acceleration in the body frame from `[value, rate, acceleration]` of yaw,
/// pitch and roll: `omega = roll' e_z + R_z^T (pitch' e_x + R_x^T yaw' e_y)` and its derivative.
fn body_rates([yaw, pitch, roll]: [[f64; 3]; 3]) -> (Vector3<f64>, Vector3<f64>) {
    let ((sp, cp), (sr, cr)) = (pitch[0].sin_cos(), roll[0].sin_cos());
    let [_, dy, ddy] = yaw;
    let [_, dp, ddp] = pitch;
    let [_, dr, ddr] = roll;
    let omega = Vector3::new(
        dp * cr + dy * cp * sr,
        -dp * sr + dy * cp * cr,
        dr - dy * sp,
    );
    let alpha = Vector3::new(
        ddp * cr - dp * dr * sr + ddy * cp * sr - dy * dp * sp * sr + dy * dr * cp * cr,
        -ddp * sr - dp * dr * cr + ddy * cp * cr - dy * dp * sp * cr - dy * dr * cp * sr,
        ddr - ddy * sp - dy * dp * cp,
    );
    (omega, alpha)
}
