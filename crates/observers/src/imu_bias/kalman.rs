//! The extended Kalman filter on the states of (7.1), in the order velocity, gravity, gyro bias,
//! accelerometer bias.

use super::config::ImuBiasConfig;
use super::kinematics::Kinematics;
use crate::kalman;
use nalgebra::{Matrix1, Matrix3, SMatrix, SVector, Vector1, Vector3};
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
/// Speed of what carries a camera that nothing measures, m/s, standard deviation.
const UNKNOWN_SPEED: f64 = 30.0;
/// A bias whose deviation is still this part of that at the start has not been seen.
const UNKNOWN_SHARE: f64 = 0.5;
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
        kalman::settle(&mut self.covariance);
        kalman::bounded(&mut self.covariance, &largest(config));
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
        let mut h = SMatrix::<f64, 3, 12>::zeros();
        h.fixed_view_mut::<3, 3>(0, start).fill_with_identity();
        self.update(&h, residual, noise, gate)
    }

    /// A measurement `gradient . gravity`: `Err(distance)` where it lies beyond the gate.
    pub fn update_gravity(
        &mut self,
        gradient: &Vector3<f64>,
        residual: f64,
        variance: f64,
        gate: f64,
    ) -> Result<(), f64> {
        let mut h = SMatrix::<f64, 1, 12>::zeros();
        h.fixed_view_mut::<1, 3>(0, 3)
            .copy_from(&gradient.transpose());
        self.update(&h, &Vector1::new(residual), &Matrix1::new(variance), gate)
    }

    fn update<const M: usize>(
        &mut self,
        h: &SMatrix<f64, M, 12>,
        residual: &SVector<f64, M>,
        noise: &SMatrix<f64, M, M>,
        gate: f64,
    ) -> Result<(), f64> {
        let step = kalman::update(&mut self.covariance, h, residual, noise, gate)?;
        self.x = unstacked(&(self.vector() + step));
        Ok(())
    }

    /// The norm of gravity is known; `dt_s` is the time since it was last used.
    pub fn update_norm(&mut self, config: &ImuBiasConfig, dt_s: f64) {
        let norm = self.x.gravity.norm();
        if norm < 1.0 || dt_s <= 0.0 {
            return;
        }
        let gradient = self.x.gravity / norm;
        let variance = config.gravity_sigma_m_s2.powi(2) * (NORM_PERIOD_S / dt_s).max(1.0);
        // Ungated: the norm of gravity is known, the estimate follows.
        let off = config.gravity_m_s2 - norm;
        let _ = self.update_gravity(&gradient, off, variance, f64::INFINITY);
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

    /// The biases wander on while nothing is read.
    pub fn wander(&mut self, config: &ImuBiasConfig, dt_s: f64) {
        for i in 0..3 {
            self.covariance[(6 + i, 6 + i)] += config.gyro_walk.powi(2) * dt_s;
            self.covariance[(9 + i, 9 + i)] += config.accel_walk.powi(2) * dt_s;
        }
        kalman::bounded(&mut self.covariance, &largest(config));
    }

    /// Directions of the accelerometer's bias of which little more is known than at the start.
    pub fn unknown_biases(&self, config: &ImuBiasConfig) -> usize {
        let own = self.covariance.fixed_view::<3, 3>(9, 9).into_owned();
        let limit = (UNKNOWN_SHARE * config.accel_bias_sigma).powi(2);
        let values = own.symmetric_eigenvalues();
        values.iter().filter(|v| **v > limit).count()
    }

    /// The state as one vector.
    pub fn vector(&self) -> Vector12 {
        stacked(&self.x)
    }

    /// Velocities have disagreed for long: motion and biases are as little known as at the start.
    pub fn doubt(&mut self, config: &ImuBiasConfig) {
        let x = self.x;
        let transition = Matrix12::zeros();
        *self = Self {
            transition,
            ..Self::new(config, x)
        };
    }
}

/// Variances that nothing exceeds: of a velocity and a gravity that nothing measures (a car's speed,
/// gravity anywhere), and of biases as at the start.
fn largest(config: &ImuBiasConfig) -> Vector12 {
    let sigmas = [
        UNKNOWN_SPEED,
        config.gravity_m_s2,
        config.gyro_bias_sigma,
        config.accel_bias_sigma,
    ];
    Vector12::from_fn(|i, _| sigmas[i / 3] * sigmas[i / 3])
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
