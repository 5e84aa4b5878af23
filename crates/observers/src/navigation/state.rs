//! State, covariance, prediction and update of the error-state filter.
//!
//! The error is [theta, v, p, gyro bias, accelerometer bias], world frame but for the biases:
//! `R_true = exp(theta) R`. Most of the transition is zero, and only what is not is computed.

use super::config::NavigationConfig;
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};
use sphereflow_core::{Pose, Stamp};
use sphereflow_sphere::lie::so3;

/// Covariance of the 15 errors.
pub type Matrix15 = SMatrix<f64, 15, 15>;

/// First index of each part of the error.
pub const THETA: usize = 0;
/// Velocity.
pub const V: usize = 3;
/// Position.
pub const P: usize = 6;
const GYRO_BIAS: usize = 9;
const ACCEL_BIAS: usize = 12;

/// The state itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NominalState {
    /// Pose of the body.
    pub world_from_body: Pose,
    /// Velocity, world frame, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// m/s^2.
    pub accel_bias_m_s2: Vector3<f64>,
}

/// State, covariance and the last inertial reading, at an instant.
#[derive(Clone, Copy, Debug)]
pub struct Belief {
    /// When.
    pub stamp: Stamp,
    /// The state.
    pub nominal: NominalState,
    /// Its covariance.
    pub covariance: Matrix15,
    /// Gyro, rad/s, as read.
    pub gyro: Vector3<f64>,
    /// Accelerometer, m/s^2, as read.
    pub accel: Vector3<f64>,
    /// Seconds since a position or a velocity was used.
    pub coasting_s: f64,
}

impl Belief {
    /// Forward by `dt_s` with the mean of two readings, or one held.
    pub fn predict(
        &mut self,
        config: &NavigationConfig,
        gyro: &Vector3<f64>,
        accel: &Vector3<f64>,
        dt_s: f64,
    ) {
        let x = &mut self.nominal;
        let turn = (gyro - x.gyro_bias_rad_s) * dt_s;
        let rotation = x.world_from_body.rotation;
        let middle = rotation * so3::exp(&(turn * 0.5));
        let force = middle * (accel - x.accel_bias_m_s2);
        let step = (force + config.gravity_m_s2) * dt_s;
        x.world_from_body.translation += (x.velocity_m_s + step * 0.5) * dt_s;
        x.velocity_m_s += step;
        x.world_from_body.rotation = rotation * so3::exp(&turn);
        x.world_from_body.rotation.renormalize_fast();
        let r = middle.to_rotation_matrix().into_inner() * -dt_s;
        let tilt = so3::hat(&(force * -dt_s));
        // P <- F P F' as (F (F P)')': F acts on columns, which lie together in memory.
        transit(&mut self.covariance, &tilt, &r, dt_s);
        self.covariance.transpose_mut();
        transit(&mut self.covariance, &tilt, &r, dt_s);
        self.grow(config, dt_s);
        self.coasting_s += dt_s;
    }

    /// The noise of one reading over `dt_s`.
    fn grow(&mut self, config: &NavigationConfig, dt_s: f64) {
        let variances = [
            (THETA, (config.gyro_sigma_rad_s * dt_s).powi(2)),
            (V, (config.accel_sigma_m_s2 * dt_s).powi(2)),
            (GYRO_BIAS, config.gyro_walk.powi(2) * dt_s),
            (ACCEL_BIAS, config.accel_walk.powi(2) * dt_s),
        ];
        for (start, variance) in variances {
            self.add_variance(start, variance);
        }
    }

    /// More doubt about one part of the state.
    pub fn add_variance(&mut self, start: usize, variance: f64) {
        for i in start..start + 3 {
            self.covariance[(i, i)] += variance;
        }
    }

    /// A measurement of `M` numbers with Jacobian `h` of the error: `Err(distance)` beyond the gate.
    pub fn update<const M: usize>(
        &mut self,
        h: &SMatrix<f64, M, 15>,
        residual: &SVector<f64, M>,
        noise: &SMatrix<f64, M, M>,
        gate: f64,
    ) -> Result<(), f64> {
        let cross = self.covariance * h.transpose();
        let innovation = h * cross + noise;
        let Some(inverse) = innovation.try_inverse() else {
            return Err(f64::INFINITY);
        };
        let distance = residual.dot(&(inverse * residual));
        if distance > gate || distance.is_nan() {
            return Err(distance);
        }
        let gain = cross * inverse;
        self.correct(&(gain * residual));
        // Joseph's form keeps the covariance positive through long coasting and sharp updates.
        let left = Matrix15::identity() - gain * h;
        let kept = left * self.covariance * left.transpose() + gain * noise * gain.transpose();
        self.covariance = (kept + kept.transpose()) * 0.5;
        Ok(())
    }

    fn correct(&mut self, error: &SVector<f64, 15>) {
        let part = |start: usize| error.fixed_rows::<3>(start).into_owned();
        let x = &mut self.nominal;
        let mut rotation = so3::exp(&part(THETA)) * x.world_from_body.rotation;
        rotation.renormalize();
        x.world_from_body = Pose::new(rotation, x.world_from_body.translation + part(P));
        x.velocity_m_s += part(V);
        x.gyro_bias_rad_s += part(GYRO_BIAS);
        x.accel_bias_m_s2 += part(ACCEL_BIAS);
    }

    /// The world is redefined by a first pose: position and attitude become its own.
    pub fn anchor(&mut self, pose: &Pose, covariance: &SMatrix<f64, 6, 6>) {
        let x = &mut self.nominal;
        let turn: UnitQuaternion<f64> = pose.rotation * x.world_from_body.rotation.inverse();
        x.velocity_m_s = turn * x.velocity_m_s;
        x.world_from_body = *pose;
        let places = [THETA, THETA + 1, THETA + 2, P, P + 1, P + 2];
        for i in places {
            self.covariance.row_mut(i).fill(0.0);
            self.covariance.column_mut(i).fill(0.0);
        }
        for (i, row) in places.into_iter().enumerate() {
            for (j, column) in places.into_iter().enumerate() {
                self.covariance[(row, column)] = covariance[(i, j)];
            }
        }
    }
}

/// `M <- F M` for the sparse transition F: p += dt v; v += tilt theta + r ba; theta += r bg.
fn transit(m: &mut Matrix15, tilt: &Matrix3<f64>, r: &Matrix3<f64>, dt_s: f64) {
    for column in m.as_mut_slice().as_chunks_mut::<15>().0 {
        let part = |c: &[f64; 15], start: usize| Vector3::new(c[start], c[start + 1], c[start + 2]);
        let theta = part(column, THETA);
        let v = part(column, V);
        let more_v = tilt * theta + r * part(column, ACCEL_BIAS);
        let more_theta = r * part(column, GYRO_BIAS);
        for i in 0..3 {
            column[P + i] += dt_s * v[i];
            column[V + i] += more_v[i];
            column[THETA + i] += more_theta[i];
        }
    }
}
