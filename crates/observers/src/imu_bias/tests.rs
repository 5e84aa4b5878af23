//! Tests of the estimators of IMU biases on simulated motion.

use super::kinematics::Kinematics;
use super::*;
use crate::{Reason, Sensor, Status};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sphereflow_sim::Motion;
use sphereflow_sim::motion::{Curve, Wave};

mod bad_input;
mod bad_table;
mod convergence;
mod lyapunov;
mod observability;
mod spikes;
mod weak;

const DT_S: f64 = 0.005;
const DOWN: Vector3<f64> = Vector3::new(0.0, 9.81, 0.0);
const GYRO_BIAS: Vector3<f64> = Vector3::new(0.010, -0.008, 0.012);
const ACCEL_BIAS: Vector3<f64> = Vector3::new(0.072, -0.023, -0.12);

/// A hand-held camera that also looks around: half a radian and more each way within 15 s, 0.4 rad/s
/// rms. What tells gravity from a bias is the angle, not the rate.
fn looking_around() -> Motion {
    let wave = |low: [f64; 2], high: [f64; 2]| {
        Curve::waves(
            0.0,
            [
                Wave::hz(low[0], low[1], 0.0),
                Wave::hz(high[0], high[1], 1.0),
            ],
        )
    };
    let mut motion = Motion::hand_held(3);
    motion.yaw_rad = wave([0.9, 0.07], [0.05, 0.5]);
    motion.pitch_rad = wave([0.6, 0.09], [0.04, 0.4]);
    motion.roll_rad = wave([0.7, 0.05], [0.04, 0.6]);
    motion
}

/// Unit field in the world, 65 degrees of dip.
fn field() -> Vector3<f64> {
    let (sin, cos) = 65.0_f64.to_radians().sin_cos();
    Vector3::new(0.0, sin, cos)
}

/// Standard deviations of one reading.
#[derive(Clone, Copy)]
struct Noise {
    gyro: f64,
    accel: f64,
    mag: f64,
    linear: f64,
    angular: f64,
}

/// Of the numbers that the thesis's sensors have, with the best velocities that images can give.
const BEST_FLOW: Noise = Noise {
    gyro: 2.5e-3,
    accel: 0.028,
    mag: 0.01,
    linear: 0.0025,
    angular: 0.0013,
};
const EXACT: Noise = Noise {
    gyro: 0.0,
    accel: 0.0,
    mag: 0.0,
    linear: 0.0,
    angular: 0.0,
};

fn config(method: ImuBiasMethod) -> ImuBiasConfig {
    ImuBiasConfig {
        method,
        field_dot_down: Some(field().dot(&DOWN) / 9.81),
        field_sigma: 0.014,
        ..ImuBiasConfig::default()
    }
}

/// The truth at an instant.
fn truth(motion: &Motion, t_s: f64) -> Kinematics {
    let state = motion.state(t_s);
    Kinematics {
        velocity: state.twist.linear_m_s,
        gravity: state.world_from_camera.rotation.inverse() * DOWN,
        gyro_bias: GYRO_BIAS,
        accel_bias: ACCEL_BIAS,
    }
}

/// 200 Hz of readings with velocities at `velocity_hz`.
fn samples(
    motion: &Motion,
    seconds: f64,
    velocity_hz: f64,
    noise: Noise,
    seed: u64,
) -> Vec<ImuBiasSample> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = move |sigma: f64| -> Vector3<f64> {
        Vector3::from_fn(|_, _| sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng))
    };
    let mut next_velocity_s = 0.0;
    let count = (seconds / DT_S).round() as usize;
    (0..count)
        .map(|i| {
            let t_s = i as f64 * DT_S;
            let state = motion.state(t_s);
            let body = state.world_from_camera.rotation.inverse();
            let due = t_s >= next_velocity_s - 1e-9;
            if due {
                next_velocity_s += 1.0 / velocity_hz;
            }
            let velocity = due.then(|| {
                VelocityMeasurement::isotropic(
                    state.twist.linear_m_s + normal(noise.linear),
                    noise.linear.max(1e-3),
                    Some(state.twist.angular_rad_s + normal(noise.angular)),
                    noise.angular.max(1e-3),
                )
            });
            ImuBiasSample {
                dt_s: DT_S,
                gyro_rad_s: state.twist.angular_rad_s + GYRO_BIAS + normal(noise.gyro),
                accel_m_s2: body * (state.accel_world_m_s2 - DOWN)
                    + ACCEL_BIAS
                    + normal(noise.accel),
                velocity,
                mag: Some(body * field() + normal(noise.mag)),
            }
        })
        .collect()
}
