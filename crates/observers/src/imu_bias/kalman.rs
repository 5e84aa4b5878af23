//! The extended Kalman filter on the states of (7.1), in the order velocity, gravity, gyro bias,
//! accelerometer bias.

use super::config::ImuBiasConfig;
use super::kinematics::Kinematics;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use sphereflow_sphere::lie::so3;

/// Covariances of the 12 states.
pub type Matrix12 = SMatrix<f64, 12, 12>;
/// The 12 states, or errors of them.
pub type Vector12 = SVector<f64, 12>;

/// Standard deviation of gravity's direction at the start, where the accelerometer was not at rest:
/// m/s^2.
const GRAVITY_SIGMA: f64 = 1.5;
/// Standard deviation of the velocity before the first one is measured, m/s.
const VELOCITY_SIGMA: f64 = 1.0;
/// The norm of gravity counts as measured once in so many seconds.
const NORM_PERIOD_S: f64 = 20.0;

/// State and covariance.
#[derive(Clone, Debug)]
pub struct Kalman {
    /// The estimate.
    pub x: Kinematics,
    /// Its covariance.
    pub covariance: Matrix12,
    /// The transition since the last [`Kalman::take_transition`].
    transition: Matrix12,
}

impl Kalman {
    /// At the start, with biases that may be known from a run before.
    pub fn new(config: &ImuBiasConfig, x: Kinematics) -> Self {
        let mut covariance = Matrix12::zeros();
        let sigmas = [
            VELOCITY_SIGMA,
            GRAVITY_SIGMA,
            config.gyro_bias_sigma,
            config.accel_bias_sigma,
        ];
        for (block, sigma) in sigmas.iter().enumerate() {
            for i in 0..3 {
                covariance[(3 * block + i, 3 * block + i)] = sigma * sigma;
            }
        }
        Self {
            x,
            covariance,
            transition: Matrix12::identity(),
        }
    }

    /// One step with readings held. Thesis: eq. (7.1).
    pub fn predict(
        &mut self,
        config: &ImuBiasConfig,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        dt_s: f64,
    ) {
        let turn = so3::adjoint(&self.x.step(gyro, accel, dt_s));
        let (v, g) = (so3::hat(&self.x.velocity), so3::hat(&self.x.gravity));
        let mut f = Matrix12::identity();
        let mut set = |row: usize, column: usize, block: Matrix3<f64>| {
            f.fixed_view_mut::<3, 3>(3 * row, 3 * column)
                .copy_from(&block);
        };
        set(0, 0, turn);
        set(0, 1, turn * dt_s);
        set(0, 2, v * -dt_s);
        set(0, 3, Matrix3::identity() * -dt_s);
        set(1, 1, turn);
        set(1, 2, g * -dt_s);
        self.covariance = f * self.covariance * f.transpose();
        self.transition = f * self.transition;
        let gyro2 = (config.gyro_sigma_rad_s * dt_s).powi(2);
        let accel2 = (config.accel_sigma_m_s2 * dt_s).powi(2);
        let mut add = |row: usize, column: usize, block: Matrix3<f64>| {
            let mut view = self.covariance.fixed_view_mut::<3, 3>(3 * row, 3 * column);
            view += block;
        };
        add(
            0,
            0,
            Matrix3::identity() * accel2 + v * v.transpose() * gyro2,
        );
        add(0, 1, v * g.transpose() * gyro2);
        add(1, 0, g * v.transpose() * gyro2);
        add(1, 1, g * g.transpose() * gyro2);
        add(
            2,
            2,
            Matrix3::identity() * (config.gyro_walk.powi(2) * dt_s),
        );
        add(
            3,
            3,
            Matrix3::identity() * (config.accel_walk.powi(2) * dt_s),
        );
    }

    /// The transition since the last call, for the smoother.
    pub fn take_transition(&mut self) -> Matrix12 {
        std::mem::replace(&mut self.transition, Matrix12::identity())
    }

    /// A measurement of three states, from `start` on: `Err(distance)` where it lies beyond the gate.
    pub fn update3(
        &mut self,
        start: usize,
        residual: &Vector3<f64>,
        noise: &Matrix3<f64>,
        gate: f64,
    ) -> Result<(), f64> {
        let cross = self.covariance.fixed_columns::<3>(start).into_owned();
        let innovation = cross.fixed_rows::<3>(start) + noise;
        let Some(inverse) = innovation.try_inverse() else {
            return Err(f64::INFINITY);
        };
        let distance = residual.dot(&(inverse * residual));
        if distance > gate || distance.is_nan() {
            return Err(distance);
        }
        let gain = cross * inverse;
        self.add(&(gain * residual));
        self.covariance -= gain * cross.transpose();
        self.symmetrise();
        Ok(())
    }

    /// A measurement `gradient . gravity`.
    pub fn update_gravity(&mut self, gradient: &Vector3<f64>, residual: f64, variance: f64) {
        let cross = self.covariance.fixed_columns::<3>(3) * gradient;
        let innovation = gradient.dot(&cross.fixed_rows::<3>(3)) + variance;
        let gain = cross / innovation;
        self.add(&(gain * residual));
        self.covariance -= gain * cross.transpose();
        self.symmetrise();
    }

    /// The norm of gravity is known; `dt_s` is the time since it was last used.
    pub fn update_norm(&mut self, config: &ImuBiasConfig, dt_s: f64) {
        let norm = self.x.gravity.norm();
        if norm < 1.0 || dt_s <= 0.0 {
            return;
        }
        let gradient = self.x.gravity / norm;
        let variance = config.gravity_sigma_m_s2.powi(2) * (NORM_PERIOD_S / dt_s).max(1.0);
        self.update_gravity(&gradient, config.gravity_m_s2 - norm, variance);
    }

    /// After a gap neither the velocity nor where gravity points is known.
    pub fn forget_motion(&mut self) {
        for i in 0..6 {
            let sigma = if i < 3 { VELOCITY_SIGMA } else { GRAVITY_SIGMA };
            for j in 0..12 {
                self.covariance[(i, j)] = 0.0;
                self.covariance[(j, i)] = 0.0;
            }
            self.covariance[(i, i)] = sigma * sigma;
            // What was is no longer tied to what is.
            self.transition.row_mut(i).fill(0.0);
        }
    }

    /// The state as one vector.
    pub fn vector(&self) -> Vector12 {
        stacked(&self.x)
    }

    fn add(&mut self, step: &Vector12) {
        self.x = unstacked(&(self.vector() + step));
    }

    fn symmetrise(&mut self) {
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
    }
}

/// As one vector.
pub fn stacked(x: &Kinematics) -> Vector12 {
    let mut out = Vector12::zeros();
    for (block, part) in [x.velocity, x.gravity, x.gyro_bias, x.accel_bias]
        .iter()
        .enumerate()
    {
        out.fixed_rows_mut::<3>(3 * block).copy_from(part);
    }
    out
}

/// From one vector.
pub fn unstacked(v: &Vector12) -> Kinematics {
    let part = |block: usize| v.fixed_rows::<3>(3 * block).into_owned();
    Kinematics {
        velocity: part(0),
        gravity: part(1),
        gyro_bias: part(2),
        accel_bias: part(3),
    }
}
