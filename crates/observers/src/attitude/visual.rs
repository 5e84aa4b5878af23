//! Attitude from a gyro and visual attitudes.
//!
//! Thesis: eq. (9.2), in its stable form. As printed, `q' = q omega/2 + q K (q* q_V - 1)` leaves the
//! unit sphere (`r' = K r (r - 1)` for the norm r) and turns the long way when `q_V` changes sign.
//! Here the correction is the vector part of the same error, `e = +-q* q_V` with scalar part above
//! zero, and the step is a rotation: `q <- q exp((omega + 2 K vec(e)) dt)`. Near the truth both have
//! the error `xi' = xi x omega - K xi` (the thesis prints K/2 in (9.4)).

use super::config::AttitudeConfig;
use crate::checks::Watch;
use crate::{Reason, Result, Sensor, Status};
use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_sphere::lie::so3;

/// The observer.
#[derive(Clone, Copy, Debug)]
pub struct VisualAttitude {
    gain: f64,
    rotation: Option<UnitQuaternion<f64>>,
    since_vision_s: f64,
    last_gyro: Vector3<f64>,
    watch: Watch,
    max_gap_s: f64,
    /// The turn since the last attitude is unknown.
    lost: bool,
}

/// Without a visual attitude for so long the answer is said to coast, seconds.
const COASTING_S: f64 = 0.5;

impl VisualAttitude {
    /// With the gain K, 1/s: an error decays as `exp(-K t)`.
    ///
    /// # Errors
    /// A value error where the gain is not positive.
    pub fn new(gain_per_s: f64) -> Result<Self> {
        sphereflow_core::checks::positive("gain_per_s", gain_per_s)?;
        let limits = AttitudeConfig::default();
        Ok(Self {
            gain: gain_per_s,
            rotation: None,
            since_vision_s: 0.0,
            last_gyro: Vector3::zeros(),
            watch: Watch::new(limits.gyro_limit_rad_s),
            max_gap_s: limits.max_gap_s,
            lost: false,
        })
    }

    /// One step: debiased gyro, rad/s, and the visual attitude (`world_from_body`) where there is
    /// one. Thesis: eq. (9.2). The start is the first visual attitude.
    pub fn step(
        &mut self,
        gyro: &Vector3<f64>,
        visual: Option<&UnitQuaternion<f64>>,
        dt_s: f64,
    ) -> Status {
        if !(dt_s > 0.0 && dt_s.is_finite()) {
            return Status::Skipped(Reason::StampNotIncreasing);
        }
        if !gyro.iter().all(|v| v.is_finite()) {
            // The best guess of an unknown rate is the last one.
            let held = self.last_gyro;
            self.turn(&held, dt_s.min(self.max_gap_s));
            return Status::Skipped(Reason::NotFinite {
                sensor: Sensor::Gyro,
            });
        }
        self.last_gyro = *gyro;
        let saturated = self.watch.step(gyro, None, dt_s);
        if dt_s > self.max_gap_s {
            self.watch.remember(Reason::Gap { seconds: dt_s });
        }
        self.lost |= saturated || dt_s > self.max_gap_s;
        let visual = visual.filter(|q| q.coords.iter().all(|v| v.is_finite()));
        let Some(rotation) = self.rotation else {
            self.rotation = visual.copied();
            return if visual.is_some() {
                Status::Ok
            } else {
                Status::Starting(Reason::NoData)
            };
        };
        self.since_vision_s = if visual.is_some() {
            0.0
        } else {
            self.since_vision_s + dt_s
        };
        if let (true, Some(visual)) = (self.lost, visual) {
            // What is not known is not kept: the visual attitude takes its place.
            self.rotation = Some(*visual);
            self.lost = false;
            return self.judge();
        }
        let predicted = rotation * so3::exp(&(gyro * dt_s));
        let correction = visual.map_or_else(Vector3::zeros, |visual| {
            let error = predicted.inverse() * visual;
            let sign = if error.w < 0.0 { -1.0 } else { 1.0 };
            // Integrated over the step, the gain never overshoots: 1 - exp(-K dt).
            error.imag() * (2.0 * sign * (1.0 - (-self.gain * dt_s).exp()))
        });
        let mut next = predicted * so3::exp(&correction);
        next.renormalize();
        self.rotation = Some(next);
        self.judge()
    }

    fn turn(&mut self, gyro: &Vector3<f64>, dt_s: f64) {
        if let Some(rotation) = &mut self.rotation {
            *rotation *= so3::exp(&(gyro * dt_s));
            rotation.renormalize();
        }
        self.since_vision_s += dt_s;
    }

    fn judge(&self) -> Status {
        if let Some(reason) = self.watch.flaw() {
            return Status::Weak(reason);
        }
        if self.since_vision_s > COASTING_S {
            return Status::Weak(Reason::Coasting {
                seconds: self.since_vision_s,
            });
        }
        Status::Ok
    }

    /// The attitude, `world_from_body`; `None` before the first visual one.
    pub fn rotation(&self) -> Option<UnitQuaternion<f64>> {
        self.rotation
    }
}
