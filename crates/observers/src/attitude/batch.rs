//! A whole recording at once.

use super::filter::{AttitudeFilter, AttitudeState};
use crate::{Result, Status};
use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_core::{Error, Stamp};

/// Answers sample by sample.
#[derive(Clone, Debug, Default)]
pub struct AttitudeRun {
    /// Attitudes, world from body.
    pub world_from_body: Vec<UnitQuaternion<f64>>,
    /// Gyro biases, rad/s.
    pub gyro_bias_rad_s: Vec<Vector3<f64>>,
    /// What became of each sample.
    pub status: Vec<Status>,
    /// Rest.
    pub at_rest: Vec<bool>,
    /// Disturbed magnetic field.
    pub mag_disturbed: Vec<bool>,
}

impl AttitudeRun {
    fn with_capacity(count: usize) -> Self {
        Self {
            world_from_body: Vec::with_capacity(count),
            gyro_bias_rad_s: Vec::with_capacity(count),
            status: Vec::with_capacity(count),
            at_rest: Vec::with_capacity(count),
            mag_disturbed: Vec::with_capacity(count),
        }
    }

    fn push(&mut self, state: &AttitudeState) {
        self.world_from_body.push(state.world_from_body);
        self.gyro_bias_rad_s.push(state.gyro_bias_rad_s);
        self.status.push(state.status);
        self.at_rest.push(state.at_rest);
        self.mag_disturbed.push(state.mag_disturbed);
    }
}

impl AttitudeFilter {
    /// All samples (vectors or arrays of three) in order, going on from the present state. Time
    /// steps are the differences of the
    /// stamps; that of the first sample is the second's. A row of `mag` that is all NaN means no
    /// reading at that instant, a stamp that does not increase is a skipped sample.
    ///
    /// # Errors
    /// [`Error::Shape`] where the lengths differ.
    pub fn run<T: Copy + Into<Vector3<f64>>>(
        &mut self,
        gyro: &[T],
        accel: &[T],
        mag: Option<&[T]>,
        stamps: &[Stamp],
    ) -> Result<AttitudeRun> {
        let count = stamps.len();
        let lengths = [
            ("gyro", gyro.len()),
            ("accel", accel.len()),
            ("mag", mag.map_or(count, <[_]>::len)),
        ];
        for (name, found) in lengths {
            if found != count {
                return Err(Error::shape(
                    name,
                    format!("({count}, 3), one row a stamp"),
                    format!("({found}, 3)"),
                )
                .into());
            }
        }
        let mut run = AttitudeRun::with_capacity(count);
        let mut last: Option<Stamp> = None;
        for i in 0..count {
            let dt_s = match last {
                Some(last) => stamps[i].seconds_since(last),
                None => first_step(stamps),
            };
            if last.is_none_or(|last| stamps[i] > last) {
                last = Some(stamps[i]);
            }
            let mag = mag
                .map(|mag| -> Vector3<f64> { mag[i].into() })
                .filter(|m| !m.iter().all(|v| v.is_nan()));
            run.push(&self.step(&gyro[i].into(), &accel[i].into(), mag.as_ref(), dt_s));
        }
        Ok(run)
    }
}

/// The step of the first sample: that of the second where it makes sense, or 10 ms.
fn first_step(stamps: &[Stamp]) -> f64 {
    let step = stamps
        .get(1)
        .map_or(0.0, |second| second.seconds_since(stamps[0]));
    if step > 0.0 && step < 1.0 { step } else { 0.01 }
}
