//! What can be measured, already carried from the camera to the body, and how it corrects a belief.

use super::config::NavigationConfig;
use super::state::{Belief, P, THETA, V};
use crate::{Reason, Sensor};
use nalgebra::{Matrix1, Matrix3, SMatrix, Vector1, Vector3, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::so3;

/// A measurement of the body.
#[derive(Clone, Copy, Debug)]
pub enum Measurement {
    /// Velocity of the camera in the camera frame and its covariance.
    Velocity(Vector3<f64>, Matrix3<f64>),
    /// Pose of the body and its covariance, [rotation, position], world frame.
    Pose(Pose, SMatrix<f64, 6, 6>),
    /// The first pose: it defines the world.
    Anchor(Pose, SMatrix<f64, 6, 6>),
    /// Field in the body, and the field's direction in the world.
    Mag(Vector3<f64>, Vector3<f64>),
    /// Nothing moves: standard deviation of the velocity, m/s.
    ZeroVelocity(f64),
}

impl Measurement {
    /// Which sensor it comes from.
    pub fn sensor(&self) -> Sensor {
        match self {
            Self::Velocity(..) => Sensor::Velocity,
            Self::Pose(..) | Self::Anchor(..) => Sensor::Pose,
            Self::Mag(..) => Sensor::Mag,
            Self::ZeroVelocity(_) => Sensor::ZeroVelocity,
        }
    }

    /// Correct the belief.
    ///
    /// # Errors
    /// [`Reason::Gated`] where the belief and the measurement cannot both be right.
    pub fn apply(&self, belief: &mut Belief, config: &NavigationConfig) -> Result<(), Reason> {
        let (gate, outcome) = match self {
            Self::Velocity(v, covariance) => {
                let gate = config.velocity_gate;
                (gate, velocity(belief, config, v, covariance, gate))
            }
            Self::ZeroVelocity(sigma) => {
                let mut h = SMatrix::<f64, 3, 15>::zeros();
                h.fixed_view_mut::<3, 3>(0, V).fill_with_identity();
                let noise = Matrix3::identity() * (sigma * sigma);
                let gate = config.velocity_gate;
                (
                    gate,
                    belief.update(&h, &-belief.nominal.velocity_m_s, &noise, gate),
                )
            }
            Self::Pose(measured, covariance) => {
                let gate = config.pose_gate;
                (gate, pose(belief, measured, covariance, gate))
            }
            Self::Anchor(pose, covariance) => {
                belief.anchor(pose, covariance);
                (f64::INFINITY, Ok(()))
            }
            Self::Mag(field, reference) => {
                let gate = config.velocity_gate;
                (gate, heading(belief, config, field, reference, gate))
            }
        };
        outcome.map_err(|distance| Reason::Gated {
            sensor: self.sensor(),
            distance,
            limit: gate,
        })?;
        if !matches!(self, Self::Mag(..)) {
            belief.coasting_s = 0.0;
        }
        Ok(())
    }
}

/// Body velocity: `R_bc v_c - omega x l = R' v`; its error is `R' (dv + v x theta)`.
fn velocity(
    belief: &mut Belief,
    config: &NavigationConfig,
    measured: &Vector3<f64>,
    covariance: &Matrix3<f64>,
    gate: f64,
) -> Result<(), f64> {
    let x = &belief.nominal;
    let to_body = config
        .body_from_camera
        .rotation
        .to_rotation_matrix()
        .into_inner();
    let omega = belief.gyro - x.gyro_bias_rad_s;
    let lever = config.body_from_camera.translation;
    let in_body = to_body * measured - omega.cross(&lever);
    let from_world = x
        .world_from_body
        .rotation
        .inverse()
        .to_rotation_matrix()
        .into_inner();
    let mut h = SMatrix::<f64, 3, 15>::zeros();
    let by_theta = from_world * so3::hat(&x.velocity_m_s);
    h.fixed_view_mut::<3, 3>(0, THETA).copy_from(&by_theta);
    h.fixed_view_mut::<3, 3>(0, V).copy_from(&from_world);
    let residual = in_body - from_world * x.velocity_m_s;
    belief.update(
        &h,
        &residual,
        &(to_body * covariance * to_body.transpose()),
        gate,
    )
}

fn pose(
    belief: &mut Belief,
    measured: &Pose,
    covariance: &SMatrix<f64, 6, 6>,
    gate: f64,
) -> Result<(), f64> {
    let x = &belief.nominal.world_from_body;
    let theta = so3::log(&(measured.rotation * x.rotation.inverse()));
    let shift = measured.translation - x.translation;
    let mut h = SMatrix::<f64, 6, 15>::zeros();
    h.fixed_view_mut::<3, 3>(0, THETA).fill_with_identity();
    h.fixed_view_mut::<3, 3>(3, P).fill_with_identity();
    let residual = Vector6::new(theta.x, theta.y, theta.z, shift.x, shift.y, shift.z);
    belief.update(&h, &residual, covariance, gate)
}

/// The field turns the heading alone: a disturbed one never tilts the horizon.
fn heading(
    belief: &mut Belief,
    config: &NavigationConfig,
    field: &Vector3<f64>,
    reference: &Vector3<f64>,
    gate: f64,
) -> Result<(), f64> {
    let down = config.gravity_m_s2.normalize();
    let flat = |v: Vector3<f64>| v - down * down.dot(&v);
    let seen = flat(belief.nominal.world_from_body.rotation * field);
    let expected = flat(*reference);
    let angle = down.dot(&seen.cross(&expected)).atan2(seen.dot(&expected));
    let mut h = SMatrix::<f64, 1, 15>::zeros();
    h.fixed_view_mut::<1, 3>(0, THETA)
        .copy_from(&down.transpose());
    let noise = Matrix1::new(config.mag_heading_sigma_rad.powi(2));
    belief.update(&h, &Vector1::new(angle), &noise, gate)
}
