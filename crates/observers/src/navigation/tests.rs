//! Tests of position observer and navigation filter on a simulated tour of a room.

use super::*;
use crate::{Reason, Sensor, Status};
use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3, Vector6};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sphereflow_core::{ImuSample, Pose, Stamp};
use sphereflow_sim::Motion;
use sphereflow_sphere::lie::so3;

mod bad_input;
mod bad_table;
mod observer;
mod order;
mod spikes;
mod tour;

const DT_S: f64 = 0.005;
const DOWN: Vector3<f64> = Vector3::new(0.0, 9.81, 0.0);
const GYRO_BIAS: Vector3<f64> = Vector3::new(0.010, -0.008, 0.012);
const ACCEL_BIAS: Vector3<f64> = Vector3::new(0.072, -0.023, -0.12);
const GYRO_SIGMA: f64 = 2.5e-3;
const ACCEL_SIGMA: f64 = 0.03;
const POSE_RAD: f64 = 0.005;
const POSE_M: f64 = 0.01;
const SPEED_SIGMA: f64 = 0.02;

/// The sensors of a camera that tours a room.
struct Tour {
    motion: Motion,
    rng: ChaCha8Rng,
}

impl Tour {
    fn new(seed: u64) -> Self {
        Self {
            motion: Motion::room_tour(1),
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    fn normal(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| sigma * Distribution::<f64>::sample(&StandardNormal, &mut self.rng))
    }

    fn stamp(step: usize) -> Stamp {
        Stamp::from_ns(step as i64 * 5_000_000)
    }

    fn imu(&mut self, step: usize) -> ImuSample {
        let state = self.motion.state(step as f64 * DT_S);
        let body = state.world_from_camera.rotation.inverse();
        ImuSample {
            stamp: Self::stamp(step),
            gyro_rad_s: state.twist.angular_rad_s + GYRO_BIAS + self.normal(GYRO_SIGMA),
            accel_m_s2: body * (state.accel_world_m_s2 - DOWN)
                + ACCEL_BIAS
                + self.normal(ACCEL_SIGMA),
        }
    }

    fn truth(&self, step: usize) -> Pose {
        self.motion.pose(step as f64 * DT_S)
    }

    fn pose(&mut self, step: usize) -> Pose {
        let truth = self.truth(step);
        let turn = so3::exp(&self.normal(POSE_RAD));
        Pose::new(
            turn * truth.rotation,
            truth.translation + self.normal(POSE_M),
        )
    }

    fn velocity(&mut self, step: usize) -> Vector3<f64> {
        let twist = self.motion.state(step as f64 * DT_S).twist;
        twist.linear_m_s + self.normal(SPEED_SIGMA)
    }
}

fn pose_covariance() -> SMatrix<f64, 6, 6> {
    let (r, p) = (POSE_RAD * POSE_RAD, POSE_M * POSE_M);
    SMatrix::from_diagonal(&Vector6::new(r, r, r, p, p, p))
}

fn speed_covariance() -> Matrix3<f64> {
    Matrix3::identity() * (SPEED_SIGMA * SPEED_SIGMA)
}

fn filter() -> NavigationFilter {
    NavigationFilter::new(NavigationConfig::default()).unwrap()
}

/// Error of attitude, velocity and position in the filter's order.
fn error(tour: &Tour, step: usize, state: &NavigationState) -> nalgebra::SVector<f64, 9> {
    let truth = tour.motion.state(step as f64 * DT_S);
    let pose = truth.world_from_camera;
    let x = &state.nominal;
    let theta = so3::log(&(pose.rotation * x.world_from_body.rotation.inverse()));
    let v = pose.rotation * truth.twist.linear_m_s - x.velocity_m_s;
    let p = pose.translation - x.world_from_body.translation;
    nalgebra::SVector::from_iterator(theta.iter().chain(&v).chain(&p).copied())
}

/// Normalised error squared per degree of freedom.
fn nees(tour: &Tour, step: usize, state: &NavigationState) -> f64 {
    let e = error(tour, step, state);
    let covariance = state.covariance.fixed_view::<9, 9>(0, 0).into_owned();
    e.dot(&(covariance.try_inverse().unwrap() * e)) / 9.0
}
