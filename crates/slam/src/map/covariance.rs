//! How the covariance of a pose follows from that of the one before and of the motion between.

use nalgebra::{Matrix6, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// Covariance of `world_from_b`, `[rotation, translation]` in the frame of `b`, given that of
/// `world_from_a` in the frame of `a` and that of the motion `a_from_b` in the frame of `a`
/// (of the `xi` in `exp(xi) * a_from_b`); the two are independent.
///
/// A step `delta_a` of `a` and an error `xi` of the motion move `b` by `Ad(b_from_a) (delta_a + xi)`.
pub fn compose(a: &Matrix6<f64>, a_from_b: &Pose, motion: &Matrix6<f64>) -> Matrix6<f64> {
    let carry = se3::adjoint(&a_from_b.inverse());
    let sum = carry * (a + motion) * carry.transpose();
    (sum + sum.transpose()) / 2.0
}

/// What a pose that is predicted with constant velocity may be off by after `dt_s` seconds, in its
/// own frame: white noise of the accelerations of a hand-held camera.
pub fn predicted(start: &Matrix6<f64>, start_from_end: &Pose, dt_s: f64) -> Matrix6<f64> {
    let (angle, length) = (
        0.5 * ANGULAR_ACCELERATION_RAD_S2 * dt_s * dt_s,
        0.5 * ACCELERATION_M_S2 * dt_s * dt_s,
    );
    let (w, v) = (angle * angle, length * length);
    let grown = Matrix6::from_diagonal(&Vector6::new(w, w, w, v, v, v));
    compose(start, start_from_end, &Matrix6::zeros()) + grown
}

/// Standard deviation of a hand-held camera's linear acceleration per axis, m/s^2. Larger: a
/// predicted pose claims less. From the recordings of hand-held cameras, which reach 2 to 4.
const ACCELERATION_M_S2: f64 = 3.0;
/// The same of the angular acceleration, rad/s^2: hands turn a camera by 10 to 20.
const ANGULAR_ACCELERATION_RAD_S2: f64 = 15.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compose_agrees_with_perturbed_poses_by_differences() {
        let a = se3::exp(&Vector6::new(0.3, -0.2, 0.5, 1.0, 2.0, -1.0));
        let a_from_b = se3::exp(&Vector6::new(-0.4, 0.1, 0.2, 0.5, -0.3, 0.8));
        let b = a * a_from_b;
        let (sigma_a, sigma_m) = (
            Matrix6::from_diagonal(&Vector6::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)),
            Matrix6::from_diagonal(&Vector6::new(0.5, 0.1, 0.2, 2.0, 1.0, 0.3)),
        );
        let step = 1e-6;
        let mut expected = Matrix6::zeros();
        for k in 0..6 {
            let mut delta = Vector6::zeros();
            delta[k] = step;
            let moved = b.inverse() * (a * (se3::exp(&delta) * a_from_b));
            let by = se3::log(&moved) / step;
            expected += by * by.transpose() * (sigma_a[(k, k)] + sigma_m[(k, k)]);
        }
        let found = compose(&sigma_a, &a_from_b, &sigma_m);
        // one-sided differences of a step of 1e-6
        assert!((found - expected).norm() < 1e-4 * expected.norm());
    }

    #[test]
    fn predicted_covariance_grows_with_time() {
        let start = Matrix6::identity() * 1e-6;
        let trace = |dt_s| predicted(&start, &Pose::identity(), dt_s).trace();
        assert!(trace(0.1) < trace(0.5) && trace(0.5) < trace(2.0));
    }
}
