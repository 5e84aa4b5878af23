//! Attitude from a gyro and visual attitudes.
//!
//! Thesis: eq. (9.2), in its stable form. As printed, `q' = q omega/2 + q K (q* q_V - 1)` leaves the
//! unit sphere (`r' = K r (r - 1)` for the norm r) and turns the long way when `q_V` changes sign.
//! Here the correction is the vector part of the same error, `e = +-q* q_V` with scalar part above
//! zero, and the step is a rotation: `q <- q exp((omega + 2 K vec(e)) dt)`. Near the truth both have
//! the error `xi' = xi x omega - K xi` (the thesis prints K/2 in (9.4)).

use super::config::AttitudeConfig;
use crate::checks::Watch;
use crate::limits;
use crate::spikes::{Sieved, SpikeGate};
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
    gate: SpikeGate,
    max_gap_s: f64,
    /// Visual attitudes have disagreed for so long, seconds.
    disagreed_s: f64,
    /// The turn since the last attitude is unknown.
    lost: bool,
}

/// A visual attitude further off is left out, rad: ten degrees and more is no noise of vision. Lower:
/// a poor start takes the patience's time; higher: wrong attitudes pull.
const GATE_RAD: f64 = 0.2;
/// The gate opens with the time without vision: a gyro with its bias left in drifts so fast, rad/s.
const DRIFT_RAD_S: f64 = 0.1;
/// Visual attitudes that disagree for so long are right, seconds.
const PATIENCE_S: f64 = 1.0;
/// Without a visual attitude for so long the answer is said to coast, seconds.
const COASTING_S: f64 = 0.5;

impl VisualAttitude {
    /// With the gain K, 1/s: an error decays as `exp(-K t)`.
    ///
    /// # Errors
    /// A value error where the gain is not positive.
    pub fn new(gain_per_s: f64) -> Result<Self> {
        sphereflow_core::checks::positive("gain_per_s", gain_per_s)?;
        let settings = AttitudeConfig::default();
        Ok(Self {
            gain: gain_per_s,
            rotation: None,
            since_vision_s: 0.0,
            last_gyro: Vector3::zeros(),
            watch: Watch::new(settings.gyro_limit_rad_s),
            gate: SpikeGate::gyro(),
            max_gap_s: settings.max_gap_s,
            disagreed_s: 0.0,
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
        if !limits::is_step(dt_s) {
            return Status::Skipped(Reason::StampNotIncreasing);
        }
        let mut turning = *gyro;
        match self.gate.step(gyro, dt_s) {
            Sieved::Refused(reason) => {
                // The best guess of an unknown rate is the last one.
                let held = self.last_gyro;
                self.turn(&held, dt_s.min(self.max_gap_s));
                return Status::Skipped(reason);
            }
            Sieved::Late(off, held_s) => turning += off * (held_s / dt_s),
            Sieved::Good => (),
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
        if let (true, Some(visual)) = (self.lost, visual) {
            // What is not known is not kept: the visual attitude takes its place.
            self.rotation = Some(*visual);
            (self.lost, self.since_vision_s, self.disagreed_s) = (false, 0.0, 0.0);
            return self.judge();
        }
        let predicted = rotation * so3::exp(&(turning * dt_s.min(self.max_gap_s)));
        let gated = visual.and_then(|visual| self.disagrees(&predicted, visual, dt_s));
        let visual = visual.filter(|_| gated.is_none());
        self.since_vision_s = if visual.is_some() {
            0.0
        } else {
            self.since_vision_s + dt_s
        };
        let correction = visual.map_or_else(Vector3::zeros, |visual| {
            let error = predicted.inverse() * visual;
            let sign = if error.w < 0.0 { -1.0 } else { 1.0 };
            // Integrated over the step, the gain never overshoots: 1 - exp(-K dt).
            error.imag() * (2.0 * sign * (1.0 - (-self.gain * dt_s).exp()))
        });
        let mut next = predicted * so3::exp(&correction);
        next.renormalize();
        self.rotation = Some(next);
        gated.map_or_else(|| self.judge(), Status::Weak)
    }

    /// Why a visual attitude is left out: it lies further from the predicted one than vision and
    /// gyro can. One that stays there is right in the end, and the next one takes the place of all.
    fn disagrees(
        &mut self,
        predicted: &UnitQuaternion<f64>,
        visual: &UnitQuaternion<f64>,
        dt_s: f64,
    ) -> Option<Reason> {
        let angle = predicted.angle_to(visual);
        // The gyro's drift since the last visual attitude is no fault of the next one.
        let limit = GATE_RAD + DRIFT_RAD_S * self.since_vision_s;
        if angle <= limit {
            self.disagreed_s = 0.0;
            return None;
        }
        self.disagreed_s += dt_s;
        self.lost |= self.disagreed_s > PATIENCE_S;
        Some(Reason::Gated {
            sensor: Sensor::Pose,
            distance: (angle / limit).powi(2),
            limit: 1.0,
        })
    }

    /// Gyro readings refused so far: beyond what a gyro reads, or spikes.
    pub fn refused(&self) -> u64 {
        self.gate.refused()
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
