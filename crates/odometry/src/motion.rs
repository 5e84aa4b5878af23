//! Twists and rigid motions: the exponential and logarithm of SE(3).

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use sphereflow_core::{Pose, Twist};

/// Below this angle the series of V replaces its closed form, whose terms cancel.
const SMALL_ANGLE: f64 = 1e-4;

/// The pose `start_from_end` of a body that moves with a constant `twist` (in its own frame) for
/// `dt_s` seconds: `exp([omega, v] dt)`.
pub fn pose_from_twist(twist: &Twist, dt_s: f64) -> Pose {
    let turn = twist.angular_rad_s * dt_s;
    let angle2 = turn.norm_squared();
    let angle = angle2.sqrt();
    let (a, b) = if angle < SMALL_ANGLE {
        (0.5 - angle2 / 24.0, 1.0 / 6.0 - angle2 / 120.0)
    } else {
        (
            (1.0 - angle.cos()) / angle2,
            (angle - angle.sin()) / (angle2 * angle),
        )
    };
    let cross = turn.cross_matrix();
    let v = Matrix3::identity() + cross * a + cross * cross * b;
    Pose::new(
        UnitQuaternion::from_scaled_axis(turn),
        v * twist.linear_m_s * dt_s,
    )
}

/// The constant twist that makes the motion `start_from_end` in `dt_s` seconds: `log / dt`.
/// Rotations below pi.
pub fn twist_from_pose(start_from_end: &Pose, dt_s: f64) -> Twist {
    let turn: Vector3<f64> = start_from_end.rotation.scaled_axis();
    let angle2 = turn.norm_squared();
    let angle = angle2.sqrt();
    let c = if angle < SMALL_ANGLE {
        1.0 / 12.0 + angle2 / 720.0
    } else {
        (1.0 - 0.5 * angle / (0.5 * angle).tan()) / angle2
    };
    let cross = turn.cross_matrix();
    let v_inverse = Matrix3::identity() - cross * 0.5 + cross * cross * c;
    Twist {
        angular_rad_s: turn / dt_s,
        linear_m_s: v_inverse * start_from_end.translation / dt_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
