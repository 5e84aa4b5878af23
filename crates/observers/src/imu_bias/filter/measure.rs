//! Fields and velocities correct the state, where state and measurement can both be right.

use super::super::VelocityMeasurement;
use super::super::config::ImuBiasMethod;
use super::ImuBiasEstimator;
use crate::{Reason, Sensor};
use nalgebra::{Matrix3, Vector3};

/// A velocity further off than this is left out by the observer, m/s; the filter knows its own
/// covariance. Lower: a poor start waits for the patience; higher: wrong velocities pull.
const OBSERVER_GATE_M_S: f64 = 3.0;
/// No gyro's bias is as large, rad/s (29 deg/s): a rate from images that is off by more is wrong.
const LARGEST_GYRO_BIAS: f64 = 0.5;

impl ImuBiasEstimator {
    /// `b . g = B . G`. Thesis: section 7.1.
    pub(super) fn use_field(&mut self, field: &Vector3<f64>) -> Option<Reason> {
        let mut gated = None;
        let config = &self.config;
        let product = config.field_dot_down.unwrap_or_default() * config.gravity_m_s2;
        match config.method {
            ImuBiasMethod::Ekf => {
                let residual = product - field.dot(&self.kalman.x.gravity);
                let variance = (config.field_sigma * config.gravity_m_s2).powi(2);
                let limit = config.gate;
                let outcome = self.kalman.update_gravity(field, residual, variance, limit);
                gated = outcome.err().map(|distance| Reason::Gated {
                    sensor: Sensor::Mag,
                    distance,
                    limit,
                });
            }
            ImuBiasMethod::Observer => {
                let gains = &config.gains;
                gains.correct_field(&mut self.kalman.x, field, product, self.since_field_s);
            }
        }
        self.since_field_s = 0.0;
        gated
    }

    pub(super) fn use_velocity(
        &mut self,
        velocity: &VelocityMeasurement,
    ) -> std::result::Result<(), Reason> {
        if let Some(reason) = velocity.refused() {
            self.refused += 1;
            return Err(reason);
        }
        let since_s = self.since_velocity_s;
        let now = self.last.map_or_else(Vector3::zeros, |[gyro, _]| gyro);
        let rate = if velocity.is_mean_angular {
            self.turned / since_s
        } else {
            now
        };
        let speed = if velocity.is_mean {
            self.travelled / since_s
        } else {
            self.kalman.x.velocity
        };
        let error = speed - velocity.linear_m_s;
        let bias = velocity.angular_rad_s.map(|omega| rate - omega);
        let outcome = match self.config.method {
            ImuBiasMethod::Ekf => self.kalman_velocity(velocity, &-error, bias.as_ref()),
            ImuBiasMethod::Observer => self.observe(&error, bias.as_ref(), since_s),
        };
        self.begin_interval();
        self.look_back();
        outcome
    }

    /// What the motion so far has shown, of the filter by its covariance too.
    fn look_back(&mut self) {
        let unseen = match self.config.method {
            ImuBiasMethod::Ekf => self.kalman.unknown_biases(&self.config),
            ImuBiasMethod::Observer => {
                self.settling_s = self.progress.settling_s();
                self.progress.blind_count()
            }
        };
        self.blind = self.excitation.blind_count().max(unseen);
    }

    /// The observer's correction, where state and measurement can both be right.
    fn observe(
        &mut self,
        error: &Vector3<f64>,
        bias: Option<&Vector3<f64>>,
        since_s: f64,
    ) -> std::result::Result<(), Reason> {
        let off = (error.norm() / OBSERVER_GATE_M_S)
            .max(bias.map_or(0.0, |bias| bias.amax() / LARGEST_GYRO_BIAS));
        if off > 1.0 {
            return Err(Reason::Gated {
                sensor: Sensor::Velocity,
                distance: off * off,
                limit: 1.0,
            });
        }
        let gains = self.config.gains;
        gains.correct(&mut self.kalman.x, error, bias, since_s);
        self.measured_bias = bias.copied();
        Ok(())
    }

    fn kalman_velocity(
        &mut self,
        velocity: &VelocityMeasurement,
        residual: &Vector3<f64>,
        bias: Option<&Vector3<f64>>,
    ) -> std::result::Result<(), Reason> {
        let gate = self.config.gate;
        let gated = |distance: f64| Reason::Gated {
            sensor: Sensor::Velocity,
            distance,
            limit: gate,
        };
        let config = self.config;
        self.kalman.update_norm(&config, self.since_velocity_s);
        self.kalman
            .update3(0, residual, &velocity.linear_covariance, gate)
            .map_err(gated)?;
        if let Some(bias) = bias {
            let gyro2 = self.config.gyro_sigma_rad_s.powi(2);
            let noise = velocity.angular_covariance + Matrix3::identity() * gyro2;
            let residual = bias - self.kalman.x.gyro_bias;
            self.kalman
                .update3(6, &residual, &noise, gate)
                .map_err(gated)?;
        }
        Ok(())
    }
}
