//! What pre-integrated samples say of two states: residual, derivatives, weight, prediction.

use super::preintegration::{ImuBias, Preintegration, finite};
use crate::{Error, Result};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::{se3, so3};

/// Numbers of a state's update: `[omega, v]` of the pose in the body frame (`T <- T exp`), velocity,
/// gyrometer bias, accelerometer bias.
pub(crate) const STATE: usize = 15;
pub(crate) type Matrix15 = SMatrix<f64, STATE, STATE>;
pub(crate) type Vector15 = SVector<f64, STATE>;

/// The state at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct InertialState {
    /// World from body (the IMU's frame).
    pub pose: Pose,
    /// Velocity in the world, m/s.
    pub velocity: Vector3<f64>,
    /// Biases.
    pub bias: ImuBias,
}

/// The root of the information of a link: what was integrated, and the walk of the biases.
pub(crate) fn root(argument: &str, link: &Preintegration) -> Result<Matrix15> {
    if link.dt <= 0.0 {
        return Err(Error::value(argument, "integrated samples", "none"));
    }
    let mut covariance = Matrix15::zeros();
    covariance
        .fixed_view_mut::<9, 9>(0, 0)
        .copy_from(&link.covariance);
    for k in 0..3 {
        covariance[(9 + k, 9 + k)] = link.sigmas.gyro_walk.powi(2) * link.dt;
        covariance[(12 + k, 12 + k)] = link.sigmas.accel_walk.powi(2) * link.dt;
    }
    let inverse = covariance.cholesky().map(|factor| factor.inverse());
    let factor = inverse.and_then(|information| information.cholesky());
    match factor {
        Some(factor) => Ok(factor.l().transpose()),
        None => {
            let expected = "two samples or more: the covariance of one is singular";
            Err(Error::value(argument, expected, "fewer"))
        }
    }
}

/// Where the samples lead from a state.
pub(crate) fn predict(
    link: &Preintegration,
    gravity: &Vector3<f64>,
    last: &InertialState,
) -> InertialState {
    let dt = link.dt;
    let (turn, velocity, position) = link.corrected(&last.bias);
    let rotation = last.pose.rotation;
    let moved = last.velocity * dt + gravity * (0.5 * dt * dt) + rotation * position;
    InertialState {
        pose: Pose::new(rotation * turn, last.pose.translation + moved),
        velocity: last.velocity + gravity * dt + rotation * velocity,
        bias: last.bias,
    }
}

/// Whitened residual of a link and its derivatives by both states.
pub(crate) fn residual(
    (link, root): (&Preintegration, &Matrix15),
    gravity: &Vector3<f64>,
    (a, b): (&InertialState, &InertialState),
) -> (Vector15, Matrix15, Matrix15) {
    let (dt, g) = (link.dt, gravity);
    let (turn, velocity, position) = link.corrected(&a.bias);
    let back = a.pose.rotation.inverse();
    let error = so3::log(&(turn.inverse() * back * b.pose.rotation));
    let fall = back * (b.velocity - a.velocity - g * dt);
    let way = b.pose.translation - a.pose.translation - a.velocity * dt - g * (0.5 * dt * dt);
    let way = back * way;
    let mut r = Vector15::zeros();
    r.fixed_rows_mut::<3>(0).copy_from(&error);
    r.fixed_rows_mut::<3>(3).copy_from(&(fall - velocity));
    r.fixed_rows_mut::<3>(6).copy_from(&(way - position));
    r.fixed_rows_mut::<3>(9)
        .copy_from(&(b.bias.gyro - a.bias.gyro));
    r.fixed_rows_mut::<3>(12)
        .copy_from(&(b.bias.accel - a.bias.accel));
    let (ja, jb) = derivatives(link, (a, b), (&error, &fall, &way));
    (root * r, root * ja, root * jb)
}

fn derivatives(
    link: &Preintegration,
    (a, b): (&InertialState, &InertialState),
    (error, fall, way): (&Vector3<f64>, &Vector3<f64>, &Vector3<f64>),
) -> (Matrix15, Matrix15) {
    let (mut ja, mut jb) = (Matrix15::zeros(), Matrix15::zeros());
    let identity = Matrix3::identity();
    let inverse = so3::right_jacobian_inverse(error);
    let relative = so3::adjoint(&(b.pose.rotation.inverse() * a.pose.rotation));
    let back = so3::adjoint(&a.pose.rotation.inverse());
    let [rg, vg, va, pg, pa] = link.by_bias();
    let drift = rg * (a.bias.gyro - link.bias.gyro);
    let by_gyro =
        -inverse * so3::adjoint(&so3::exp(error).inverse()) * so3::right_jacobian(&drift) * rg;
    let put = |m: &mut Matrix15, row: usize, column: usize, block: &Matrix3<f64>| {
        m.fixed_view_mut::<3, 3>(row, column).copy_from(block);
    };
    put(&mut ja, 0, 0, &(-inverse * relative));
    put(&mut jb, 0, 0, &inverse);
    put(&mut ja, 0, 9, &by_gyro);
    put(&mut ja, 3, 0, &so3::hat(fall));
    put(&mut ja, 3, 6, &-back);
    put(&mut jb, 3, 6, &back);
    put(&mut ja, 3, 9, &-vg);
    put(&mut ja, 3, 12, &-va);
    put(&mut ja, 6, 0, &so3::hat(way));
    put(&mut ja, 6, 3, &-identity);
    put(&mut ja, 6, 6, &(-back * link.dt));
    put(&mut jb, 6, 3, &relative.transpose());
    put(&mut ja, 6, 9, &-pg);
    put(&mut ja, 6, 12, &-pa);
    for column in [9, 12] {
        put(&mut ja, column, column, &-identity);
        put(&mut jb, column, column, &identity);
    }
    (ja, jb)
}

pub(crate) fn check(state: &InertialState) -> Result<()> {
    finite("pose", &state.pose.translation)?;
    finite("pose", &state.pose.rotation.imag())?;
    finite("velocity", &state.velocity)?;
    finite("bias.gyro", &state.bias.gyro)?;
    finite("bias.accel", &state.bias.accel)
}

/// A state moved by an update.
pub(crate) fn moved(state: &InertialState, d: &Vector15) -> InertialState {
    let part = |k: usize| Vector3::new(d[k], d[k + 1], d[k + 2]);
    InertialState {
        pose: state.pose * se3::exp(&d.fixed_rows::<6>(0).into_owned()),
        velocity: state.velocity + part(6),
        bias: ImuBias {
            gyro: state.bias.gyro + part(9),
            accel: state.bias.accel + part(12),
        },
    }
}
