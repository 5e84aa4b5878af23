//! Attitude from gyro samples: the rotation vector with its coning correction (Bortz 1971).

use super::so3;
use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_core::{Error, ImuSample, Result};

/// The rate of the rotation vector of a body that turns with `omega_rad_s` in its own frame, to
/// second order. Thesis: eq. (C.3): `theta' = omega + theta x omega / 2`.
pub fn rate(theta: &Vector3<f64>, omega_rad_s: &Vector3<f64>) -> Vector3<f64> {
    omega_rad_s + theta.cross(omega_rad_s) * 0.5
}

/// The rotation vector gathered from gyro samples since an instant, between which the angular
/// velocity is taken to change linearly.
///
/// Thesis: eq. (C.3), integrated over each pair of samples in closed form. Turning by
/// `q exp(omega dt)` instead loses the coning, the rotation that the axis' own motion makes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotationVector {
    theta: Vector3<f64>,
    last_rad_s: Vector3<f64>,
}

impl RotationVector {
    /// At the instant of a first sample, body frame.
    pub fn starting(omega_rad_s: Vector3<f64>) -> Self {
        Self {
            theta: Vector3::zeros(),
            last_rad_s: omega_rad_s,
        }
    }

    /// The next sample, `dt_s` seconds after the last.
    pub fn push(&mut self, omega_rad_s: Vector3<f64>, dt_s: f64) {
        let angle = (self.last_rad_s + omega_rad_s) * (0.5 * dt_s);
        let coning = self.last_rad_s.cross(&omega_rad_s) * (dt_s * dt_s / 12.0);
        self.theta += angle + coning + self.theta.cross(&angle) * 0.5;
        self.last_rad_s = omega_rad_s;
    }

    /// The rotation vector, radians.
    pub fn theta(&self) -> Vector3<f64> {
        self.theta
    }

    /// `body_at_start_from_body_now`: the attitude is multiplied by it on the right. Thesis: section
    /// C.1.2, `q_{t+dt} = q_t dq`.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        so3::exp(&self.theta)
    }

    /// The rotation so far; the next one starts here, at the last sample. The second order holds for
    /// angles well below 1 rad: take it at least that often.
    pub fn take(&mut self) -> UnitQuaternion<f64> {
        let rotation = self.rotation();
        self.theta = Vector3::zeros();
        rotation
    }
}

/// The rotation between the first and the last of `samples`, `sensor_at_first_from_sensor_at_last`;
/// it is taken afresh at every sample, so that any total angle is allowed.
///
/// # Errors
/// [`Error::Shape`] for fewer than two samples, [`Error::TimeOrder`] where stamps do not increase,
/// [`Error::Value`] where a gyro reading is not finite.
pub fn rotation_between(samples: &[ImuSample]) -> Result<UnitQuaternion<f64>> {
    let [first, rest @ ..] = samples else {
        return Err(Error::shape("samples", "at least 2", samples.len()));
    };
    if rest.is_empty() {
        return Err(Error::shape("samples", "at least 2", samples.len()));
    }
    let mut rotation = UnitQuaternion::identity();
    let (mut vector, mut earlier) = (RotationVector::starting(first.gyro_rad_s), first);
    for (i, sample) in samples.iter().enumerate() {
        if !sample.gyro_rad_s.iter().all(|v| v.is_finite()) {
            return Err(Error::value(
                format!("samples[{i}].gyro_rad_s"),
                "finite rad/s",
                format!("{:?}", sample.gyro_rad_s.as_slice()),
            ));
        }
        if i == 0 {
            continue;
        }
        if sample.stamp <= earlier.stamp {
            return Err(Error::TimeOrder {
                argument: "samples".to_string(),
                earlier: earlier.stamp,
                later: sample.stamp,
                index: i,
            });
        }
        vector.push(sample.gyro_rad_s, sample.stamp.seconds_since(earlier.stamp));
        rotation *= vector.take();
        earlier = sample;
    }
    rotation.renormalize();
    Ok(rotation)
}
