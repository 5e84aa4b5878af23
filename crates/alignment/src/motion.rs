//! Twists and rigid motions: the exponential and logarithm of SE(3).

use nalgebra::Vector6;
use sphereflow_core::{Pose, Twist};
use sphereflow_sphere::lie::se3;

/// The pose `start_from_end` of a body that moves with a constant `twist` (in its own frame) for
/// `dt_s` seconds: `exp([omega, v] dt)`.
pub fn pose_from_twist(twist: &Twist, dt_s: f64) -> Pose {
    se3::exp(&(twist.vector() * dt_s))
}

/// The constant twist that makes the motion `start_from_end` in `dt_s` seconds: `log / dt`.
/// Rotations up to pi.
pub fn twist_from_pose(start_from_end: &Pose, dt_s: f64) -> Twist {
    Twist::from_vector(&(se3::log(start_from_end) / dt_s))
}

/// A motion in metres: rotation counts at the scene's mean range.
pub(crate) fn size_m(motion: &Vector6<f64>, range_m: f64) -> f64 {
    motion.fixed_rows::<3>(3).norm() + range_m * motion.fixed_rows::<3>(0).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    fn twist(values: [f64; 6]) -> Twist {
        Twist::from_vector(&values.into())
    }

    proptest! {
        #[test]
        fn twist_through_pose_and_back_is_the_same(
            values in proptest::array::uniform6(-3.0..3.0_f64), small in 0..9_i32,
        ) {
            let given = twist(values.map(|v| v * 10.0_f64.powi(-small)));
            let back = twist_from_pose(&pose_from_twist(&given, 0.5), 0.5);
            // rounding of an arc tangent and of the inverse of V
            prop_assert!((back.vector() - given.vector()).norm() < 1e-12 * (1.0 + given.vector().norm()));
        }
    }

    #[test]
    fn pose_of_twist_is_the_limit_of_small_steps() {
        let given = twist([0.4, -0.9, 0.3, 1.0, -2.0, 0.5]);
        let steps = 20_000;
        let step = Pose::new(
            UnitQuaternion::from_scaled_axis(given.angular_rad_s / f64::from(steps)),
            given.linear_m_s / f64::from(steps),
        );
        let product = (0..steps).fold(Pose::identity(), |pose, _| pose * step);
        let (d, a) = product.distance_and_angle(&pose_from_twist(&given, 1.0));
        // Euler steps are good to |omega x v| / (2 steps)
        assert!(d < 1e-4 && a < 1e-7, "{d} {a}");
    }
}
