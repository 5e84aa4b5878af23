//! State, covariance, prediction and update of the error-state filter.
//!
//! The error is [theta, v, p, gyro bias, accelerometer bias], world frame but for the biases:
//! `R_true = exp(theta) R`. Most of the transition is zero, and only what is not is computed.

use super::config::NavigationConfig;
use crate::kalman;
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};
use sphereflow_core::{ImuSample, Pose, Stamp};
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

/// Tilt of the first reading, rad: the accelerometer may have moved.
const TILT_SIGMA: f64 = 0.2;
/// What defines the world is exact but for this, rad and m.
const GAUGE_SIGMA: f64 = 1e-3;
/// Velocity before anything was measured, m/s.
const VELOCITY_SIGMA: f64 = 1.0;
/// Speeds of what carries a camera, standard deviation, m/s: a car's. Lower: a train's velocity is
/// pulled where nothing measures it; higher: without measurements more is lost than has to be.
pub const SPEED_SIGMA: f64 = 30.0;
/// An attitude of which nothing is known, rad: a rotation vector anywhere within half a circle has
/// this standard deviation along each axis.
const TURN_SIGMA: f64 = 1.4;
/// A position of which nothing is known, m: anywhere on Earth.
const PLACE_SIGMA: f64 = 1e7;

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
    /// Level by the first specific force, at the origin, heading 0.
    pub fn first(config: &NavigationConfig, sample: &ImuSample) -> Self {
        let up = -config.gravity_m_s2;
        let rotation =
            UnitQuaternion::rotation_between(&sample.accel_m_s2, &up).unwrap_or_else(|| {
                let across = up.cross(&Vector3::x()) + up.cross(&Vector3::z());
                UnitQuaternion::from_scaled_axis(across.normalize() * std::f64::consts::PI)
            });
        let down = config.gravity_m_s2.normalize();
        let mut belief = Belief {
            stamp: sample.stamp,
            nominal: NominalState {
                world_from_body: Pose::new(rotation, Vector3::zeros()),
                velocity_m_s: Vector3::zeros(),
                gyro_bias_rad_s: Vector3::zeros(),
                accel_bias_m_s2: Vector3::zeros(),
            },
            covariance: Matrix15::zeros(),
            gyro: sample.gyro_rad_s,
            accel: sample.accel_m_s2,
            coasting_s: 0.0,
        };
        let level = Matrix3::identity() - down * down.transpose();
        let tilt = level * TILT_SIGMA.powi(2) + Matrix3::identity() * GAUGE_SIGMA.powi(2);
        belief
            .covariance
            .fixed_view_mut::<3, 3>(THETA, THETA)
            .copy_from(&tilt);
        belief.add_variance(V, VELOCITY_SIGMA.powi(2));
        belief.add_variance(P, GAUGE_SIGMA.powi(2));
        belief.add_variance(9, config.gyro_bias_sigma.powi(2));
        belief.add_variance(12, config.accel_bias_sigma.powi(2));
        belief
    }

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
        kalman::settle(&mut self.covariance);
        self.coasting_s += dt_s;
        let fast = (0..3).any(|i| self.covariance[(V + i, V + i)] > SPEED_SIGMA * SPEED_SIGMA);
        if fast {
            self.slow_down();
        }
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

    /// Doubt about velocity and position from an unknown even acceleration, m/s^2 an axis.
    pub fn add_acceleration(&mut self, sigma: f64, dt_s: f64) {
        let (speed, way) = (sigma * dt_s, 0.5 * sigma * dt_s * dt_s);
        for i in 0..3 {
            let (v, p) = (V + i, P + i);
            self.covariance[(v, v)] += speed * speed;
            self.covariance[(p, p)] += way * way;
            self.covariance[(v, p)] += speed * way;
            self.covariance[(p, v)] += speed * way;
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
        let step = kalman::update(&mut self.covariance, h, residual, noise, gate)?;
        self.correct(&step);
        Ok(())
    }

    /// A body does not move faster than [`SPEED_SIGMA`] by much: what keeps the velocity, and with it
    /// tilt and biases, from growing without end where nothing is measured.
    pub fn slow_down(&mut self) {
        let mut h = SMatrix::<f64, 3, 15>::zeros();
        h.fixed_view_mut::<3, 3>(0, V).fill_with_identity();
        let noise = Matrix3::identity() * (SPEED_SIGMA * SPEED_SIGMA);
        let residual = -self.nominal.velocity_m_s;
        // Ungated: a faster state than this is the filter's own.
        let _ = self.update(&h, &residual, &noise, f64::INFINITY);
    }

    /// The motion meanwhile is unknown, for so long that nothing of it can be guessed: the place is
    /// the last one with all the way that can be gone, the body is level by `accel` and turned
    /// anyhow, and at rest as far as is known. The biases stay.
    pub fn lose_motion(&mut self, config: &NavigationConfig, accel: &Vector3<f64>, gap_s: f64) {
        let x = &mut self.nominal;
        let up = x.world_from_body.rotation * (accel - x.accel_bias_m_s2);
        let level = UnitQuaternion::rotation_between(&up, &-config.gravity_m_s2);
        let level = level.unwrap_or_else(UnitQuaternion::identity);
        x.world_from_body.rotation = level * x.world_from_body.rotation;
        x.velocity_m_s = Vector3::zeros();
        let way = SPEED_SIGMA * gap_s;
        let place = self.covariance.fixed_view::<3, 3>(P, P).diagonal();
        for i in 0..GYRO_BIAS {
            self.covariance.row_mut(i).fill(0.0);
            self.covariance.column_mut(i).fill(0.0);
        }
        self.add_variance(THETA, TURN_SIGMA * TURN_SIGMA);
        self.add_variance(V, SPEED_SIGMA * SPEED_SIGMA);
        for i in 0..3 {
            self.covariance[(P + i, P + i)] = place[i] + way * way;
        }
        self.bound(config);
    }

    /// Variances within what can be at all: a turn is at most half a circle, and nobody leaves the
    /// Earth; biases are never less known than at the start.
    pub fn bound(&mut self, config: &NavigationConfig) {
        let sigmas = [
            TURN_SIGMA,
            2.0 * SPEED_SIGMA,
            PLACE_SIGMA,
            config.gyro_bias_sigma,
            config.accel_bias_sigma,
        ];
        let largest = SVector::<f64, 15>::from_fn(|i, _| sigmas[i / 3] * sigmas[i / 3]);
        kalman::bounded(&mut self.covariance, &largest);
    }

    /// True where all of it is finite.
    pub fn is_finite(&self) -> bool {
        let x = &self.nominal;
        x.world_from_body
            .rotation
            .coords
            .iter()
            .chain(&x.world_from_body.translation)
            .chain(&x.velocity_m_s)
            .chain(&x.gyro_bias_rad_s)
            .chain(&x.accel_bias_m_s2)
            .chain(&self.covariance)
            .all(|v| v.is_finite())
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
