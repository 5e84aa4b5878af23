//! A whole recording: forwards, in loops, and smoothed over the fixed interval.

use super::VelocityMeasurement;
use super::config::{ImuBiasConfig, ImuBiasMethod};
use super::filter::{ImuBiasEstimator, ImuBiasState};
use super::kalman::{Kalman, Matrix12, Vector12, unstacked};
use super::kinematics::Kinematics;
use crate::{Result, Status};
use nalgebra::Vector3;

/// One instant of a recording; see [`ImuBiasEstimator::step`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuBiasSample {
    /// Seconds since the sample before.
    pub dt_s: f64,
    /// rad/s.
    pub gyro_rad_s: Vector3<f64>,
    /// m/s^2.
    pub accel_m_s2: Vector3<f64>,
    /// Velocity at this instant, where measured.
    pub velocity: Option<VelocityMeasurement>,
    /// Field at this instant, where measured.
    pub mag: Option<Vector3<f64>>,
}

/// Answers for a recording.
#[derive(Clone, Debug)]
pub struct ImuBiasRun {
    /// One state a sample, or, smoothed, one a measurement.
    pub states: Vec<ImuBiasState>,
    /// Index of the sample of each state.
    pub samples: Vec<usize>,
}

/// What the backward pass needs of each measurement's instant.
struct Knot {
    sample: usize,
    transition: Matrix12,
    predicted: Vector12,
    predicted_covariance: Matrix12,
    filtered: Vector12,
    filtered_covariance: Matrix12,
    status: Status,
}

impl ImuBiasEstimator {
    /// All samples in order.
    pub fn run(&mut self, samples: &[ImuBiasSample]) -> ImuBiasRun {
        let state = |s: &ImuBiasSample| {
            self.step(
                &s.gyro_rad_s,
                &s.accel_m_s2,
                s.velocity.as_ref(),
                s.mag.as_ref(),
                s.dt_s,
            )
        };
        ImuBiasRun {
            states: samples.iter().map(state).collect(),
            samples: (0..samples.len()).collect(),
        }
    }

    /// The same recording again and again, each time from the biases of the time before; the last
    /// run is returned. Thesis: section 7.7.
    ///
    /// # Errors
    /// A value error for settings out of range.
    pub fn loops(
        config: ImuBiasConfig,
        samples: &[ImuBiasSample],
        times: usize,
    ) -> Result<ImuBiasRun> {
        let mut estimator = Self::new(config)?;
        let mut run = estimator.run(samples);
        for _ in 1..times {
            let last = estimator.kalman.x;
            estimator = Self::new(config)?;
            estimator.kalman.x.gyro_bias = last.gyro_bias;
            estimator.kalman.x.accel_bias = last.accel_bias;
            run = estimator.run(samples);
        }
        Ok(run)
    }

    /// The fixed-interval smoother (Rauch, Tung and Striebel): every state from the whole recording.
    /// One state a measurement; the method of the settings is overruled, only the filter has covariances.
    ///
    /// # Errors
    /// A value error for settings out of range.
    pub fn smooth(config: ImuBiasConfig, samples: &[ImuBiasSample]) -> Result<ImuBiasRun> {
        let config = ImuBiasConfig {
            method: ImuBiasMethod::Ekf,
            ..config
        };
        let mut estimator = Self::new(config)?;
        let mut knots: Vec<Knot> = Vec::new();
        for (sample, s) in samples.iter().enumerate() {
            if s.velocity.is_none() && s.mag.is_none() {
                estimator.step(&s.gyro_rad_s, &s.accel_m_s2, None, None, s.dt_s);
                continue;
            }
            // The step is done twice: without the measurements for the prediction.
            let mut ahead = estimator.clone();
            ahead.step(&s.gyro_rad_s, &s.accel_m_s2, None, None, s.dt_s);
            let predicted: &mut Kalman = &mut ahead.kalman;
            let (vector, covariance) = (predicted.vector(), predicted.covariance);
            estimator.step(
                &s.gyro_rad_s,
                &s.accel_m_s2,
                s.velocity.as_ref(),
                s.mag.as_ref(),
                s.dt_s,
            );
            knots.push(Knot {
                sample,
                transition: estimator.kalman.take_transition(),
                predicted: vector,
                predicted_covariance: covariance,
                filtered: estimator.kalman.vector(),
                filtered_covariance: estimator.kalman.covariance,
                status: estimator.state().status,
            });
        }
        Ok(backwards(&knots))
    }
}

fn backwards(knots: &[Knot]) -> ImuBiasRun {
    let mut states = Vec::with_capacity(knots.len());
    let mut next: Option<(Vector12, Matrix12)> = None;
    for i in (0..knots.len()).rev() {
        let knot = &knots[i];
        let (x, p) = match (next, knots.get(i + 1)) {
            (Some((x, p)), Some(after)) => match after.predicted_covariance.cholesky() {
                Some(factor) => {
                    // gain = P F' predicted^-1, as the solution of a symmetric system
                    let gain = factor
                        .solve(&(after.transition * knot.filtered_covariance))
                        .transpose();
                    (
                        knot.filtered + gain * (x - after.predicted),
                        knot.filtered_covariance
                            + gain * (p - after.predicted_covariance) * gain.transpose(),
                    )
                }
                None => (knot.filtered, knot.filtered_covariance),
            },
            _ => (knot.filtered, knot.filtered_covariance),
        };
        next = Some((x, p));
        states.push(state(&unstacked(&x), p, knot.status));
    }
    states.reverse();
    ImuBiasRun {
        states,
        samples: knots.iter().map(|knot| knot.sample).collect(),
    }
}

fn state(x: &Kinematics, covariance: Matrix12, status: Status) -> ImuBiasState {
    ImuBiasState {
        velocity_m_s: x.velocity,
        gravity_m_s2: x.gravity,
        gyro_bias_rad_s: x.gyro_bias,
        accel_bias_m_s2: x.accel_bias,
        covariance: Some(covariance),
        status,
    }
}
