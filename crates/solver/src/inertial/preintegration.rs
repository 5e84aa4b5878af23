//! IMU samples between two instants as one relative measurement that biases move to first order.
//!
//! Forster, Carlone, Dellaert, Scaramuzza, "On-manifold preintegration for real-time visual-inertial
//! odometry", 2017. The body frame is the IMU's; `a` is specific force; a bias is subtracted.

use crate::Result;
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};
use sphereflow_core::checks::{all_finite, each, positive};
use sphereflow_sphere::lie::so3;

/// Biases of a gyrometer, rad/s, and an accelerometer, m/s^2: subtracted from what they measure.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ImuBias {
    /// Of the angular rate, rad/s.
    pub gyro: Vector3<f64>,
    /// Of the specific force, m/s^2.
    pub accel: Vector3<f64>,
}

/// Noise densities of an IMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSigmas {
    /// Angular rate, rad/s/sqrt(Hz).
    pub gyro: f64,
    /// Specific force, m/s^2/sqrt(Hz).
    pub accel: f64,
    /// Walk of the gyrometer's bias, rad/s^2/sqrt(Hz).
    pub gyro_walk: f64,
    /// Walk of the accelerometer's bias, m/s^3/sqrt(Hz).
    pub accel_walk: f64,
}

pub(super) type Matrix9 = SMatrix<f64, 9, 9>;

/// What IMU samples say of the motion between two instants: with attitude R, velocity v and position
/// p of the body in a world where gravity is g,
/// `R1 = R0 dR`, `v1 = v0 + g dt + R0 dv`, `p1 = p0 + v0 dt + g dt^2 / 2 + R0 dp`.
#[derive(Clone, Debug, PartialEq)]
pub struct Preintegration {
    /// The biases it was made with.
    pub bias: ImuBias,
    pub(super) sigmas: ImuSigmas,
    /// Seconds.
    pub(super) dt: f64,
    rotation: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    position: Vector3<f64>,
    /// Of rotation vector, velocity, position.
    pub(super) covariance: Matrix9,
    rotation_by_gyro: Matrix3<f64>,
    velocity_by_gyro: Matrix3<f64>,
    velocity_by_accel: Matrix3<f64>,
    position_by_gyro: Matrix3<f64>,
    position_by_accel: Matrix3<f64>,
}

impl Preintegration {
    /// Nothing integrated yet, around `bias`.
    ///
    /// # Errors
    /// Where a noise density is not a positive number, or a bias is not finite.
    pub fn new(bias: ImuBias, sigmas: ImuSigmas) -> Result<Self> {
        let densities = [
            ("sigmas.gyro", sigmas.gyro),
            ("sigmas.accel", sigmas.accel),
            ("sigmas.gyro_walk", sigmas.gyro_walk),
            ("sigmas.accel_walk", sigmas.accel_walk),
        ];
        each(positive, &densities)?;
        finite("bias.gyro", &bias.gyro)?;
        finite("bias.accel", &bias.accel)?;
        let zero = Matrix3::zeros();
        Ok(Self {
            bias,
            sigmas,
            dt: 0.0,
            rotation: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            position: Vector3::zeros(),
            covariance: Matrix9::zeros(),
            rotation_by_gyro: zero,
            velocity_by_gyro: zero,
            velocity_by_accel: zero,
            position_by_gyro: zero,
            position_by_accel: zero,
        })
    }

    /// Add a sample (rad/s, m/s^2) that holds for `dt_s` seconds.
    ///
    /// # Errors
    /// Where a number is not finite, or the time is not positive.
    pub fn push(&mut self, gyro: &Vector3<f64>, accel: &Vector3<f64>, dt_s: f64) -> Result<()> {
        finite("gyro", gyro)?;
        finite("accel", accel)?;
        positive("dt_s", dt_s)?;
        let (omega, a) = (gyro - self.bias.gyro, accel - self.bias.accel);
        let turn = omega * dt_s;
        let step = so3::exp(&turn);
        // force in the first body frame, at the middle of the sample
        let middle = self.rotation * so3::exp(&(turn * 0.5));
        let r = middle.to_rotation_matrix().into_inner();
        let by_rotation = -r * so3::hat(&a);
        let force = middle * a;
        let back = so3::adjoint(&step.inverse());
        let right = so3::right_jacobian(&turn) * dt_s;
        self.propagate_noise(&back, &by_rotation, &r, &right, dt_s);
        let half = 0.5 * dt_s * dt_s;
        // derivative of the rotation vector at the middle by the gyrometer's bias
        let middle_back = so3::adjoint(&so3::exp(&(turn * 0.5)).inverse());
        let middle_by_gyro =
            middle_back * self.rotation_by_gyro - so3::right_jacobian(&(turn * 0.5)) * (0.5 * dt_s);
        let force_by_gyro = by_rotation * middle_by_gyro;
        self.position_by_gyro += self.velocity_by_gyro * dt_s + force_by_gyro * half;
        self.position_by_accel += self.velocity_by_accel * dt_s - r * half;
        self.velocity_by_gyro += force_by_gyro * dt_s;
        self.velocity_by_accel -= r * dt_s;
        self.rotation_by_gyro = back * self.rotation_by_gyro - right;
        self.position += self.velocity * dt_s + force * half;
        self.velocity += force * dt_s;
        self.rotation = UnitQuaternion::new_normalize((self.rotation * step).into_inner());
        self.dt += dt_s;
        Ok(())
    }

    fn propagate_noise(
        &mut self,
        back: &Matrix3<f64>,
        by_rotation: &Matrix3<f64>,
        r: &Matrix3<f64>,
        right: &Matrix3<f64>,
        dt: f64,
    ) {
        let identity = Matrix3::identity();
        let mut a = Matrix9::identity();
        a.fixed_view_mut::<3, 3>(0, 0).copy_from(back);
        a.fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&(by_rotation * dt));
        a.fixed_view_mut::<3, 3>(6, 0)
            .copy_from(&(by_rotation * (0.5 * dt * dt)));
        a.fixed_view_mut::<3, 3>(6, 3).copy_from(&(identity * dt));
        let mut b = SMatrix::<f64, 9, 6>::zeros();
        b.fixed_view_mut::<3, 3>(0, 0).copy_from(right);
        b.fixed_view_mut::<3, 3>(3, 3).copy_from(&(r * dt));
        b.fixed_view_mut::<3, 3>(6, 3)
            .copy_from(&(r * (0.5 * dt * dt)));
        let (gyro, accel) = (
            self.sigmas.gyro.powi(2) / dt,
            self.sigmas.accel.powi(2) / dt,
        );
        let noise = SVector::<f64, 6>::from_fn(|k, _| if k < 3 { gyro } else { accel });
        let noise = SMatrix::<f64, 6, 6>::from_diagonal(&noise);
        self.covariance = a * self.covariance * a.transpose() + b * noise * b.transpose();
    }

    /// Rotation, velocity and position changes with another bias, to first order.
    pub fn corrected(&self, bias: &ImuBias) -> (UnitQuaternion<f64>, Vector3<f64>, Vector3<f64>) {
        let (g, a) = (bias.gyro - self.bias.gyro, bias.accel - self.bias.accel);
        (
            self.rotation * so3::exp(&(self.rotation_by_gyro * g)),
            self.velocity + self.velocity_by_gyro * g + self.velocity_by_accel * a,
            self.position + self.position_by_gyro * g + self.position_by_accel * a,
        )
    }

    /// The noise densities.
    pub fn sigmas(&self) -> &ImuSigmas {
        &self.sigmas
    }

    /// Seconds integrated.
    pub fn seconds(&self) -> f64 {
        self.dt
    }

    /// Derivatives by the biases: rotation by gyro; velocity by gyro, accel; position by gyro, accel.
    pub(super) fn by_bias(&self) -> [&Matrix3<f64>; 5] {
        [
            &self.rotation_by_gyro,
            &self.velocity_by_gyro,
            &self.velocity_by_accel,
            &self.position_by_gyro,
            &self.position_by_accel,
        ]
    }
}

pub(crate) fn finite(argument: &str, v: &Vector3<f64>) -> Result<()> {
    Ok(all_finite(argument, v)?)
}
