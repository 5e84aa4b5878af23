//! Row motions, times, depth fields and their priors: every Jacobian against differences.

use super::derivatives::{cameras, check, normal_matrix};
use crate::Loss;
use crate::bundle::{BundleProblem, DeviceCalibration, ReadDepth, RowMotion};
use nalgebra::{Matrix2, UnitQuaternion, Vector2, Vector3, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// Central differences with a step of 1e-5 of numbers of size 1.
const DIFFERENCE: f64 = 1e-9;
/// What the second order leaves of 15 ms at 2.7 rad/s and 1 m/s, 2 m away: (w t)^3 / 6 of 2 m.
const THIRD_ORDER_M: f64 = 5e-5;
const DEVICE: [&str; 10] = crate::bundle::device::NAMES;

pub(super) fn motion() -> RowMotion {
    RowMotion {
        omega: Vector3::new(1.2, -2.0, 1.4),
        velocity: Vector3::new(0.3, -0.5, 0.8),
        omega_rate: Vector3::new(8.0, 5.0, -11.0),
        velocity_rate: Vector3::new(-4.0, 3.0, 6.0),
    }
}

#[test]
fn derivatives_of_a_moved_point_equal_differences() {
    let (rows, y, h) = (motion(), Vector3::new(0.4, -0.3, 2.0), 1e-5);
    for t in [-0.02, 0.0, 0.015] {
        let found = rows.with_derivatives(&y, t);
        assert_eq!(found.point, rows.seen_at(&y, t));
        let by_time = (rows.seen_at(&y, t + h) - rows.seen_at(&y, t - h)) / (2.0 * h);
        assert!((by_time - found.by_time).norm() < DIFFERENCE);
        for axis in 0..3 {
            let step = Vector3::from_fn(|r, _| if r == axis { h } else { 0.0 });
            let difference = rows.seen_at(&(y + step), t) - rows.seen_at(&(y - step), t);
            let error = (difference / (2.0 * h) - found.by_point.column(axis)).norm();
            assert!(error < DIFFERENCE, "{t} {axis} {error:e}");
        }
        let back = rows.in_pose(&found.point, t).unwrap();
        assert!((back - y).norm() < 1e-14);
    }
}

#[test]
fn moved_point_equals_that_of_a_camera_that_turns_and_drives() {
    let rows = RowMotion {
        omega_rate: Vector3::zeros(),
        velocity_rate: Vector3::zeros(),
        ..motion()
    };
    let y = Vector3::new(0.4, -0.3, 2.0);
    for t in [-0.015, 0.015] {
        let w = rows.omega * t;
        let v = rows.velocity * t;
        let later = se3::exp(&Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z));
        let error = (rows.seen_at(&y, t) - later.inverse().transform(&y)).norm();
        assert!(error < THIRD_ORDER_M, "{error:e}");
    }
}

/// Two moving views of five points at pixels with and without a depth, away from the minimum.
fn sample(camera: usize, loss: impl Fn(f64) -> Loss) -> BundleProblem {
    let camera = &cameras()[camera];
    let mut problem = BundleProblem::new();
    problem.add_camera(camera.clone());
    problem
        .set_device(
            0,
            &DeviceCalibration {
                readout_s: 0.03,
                colour_offset_s: 0.015,
                depth_field: [0.02, -0.03, 0.01, 0.02, -0.01, 0.05, 0.03, -0.06],
            },
        )
        .unwrap();
    for k in 0..2 {
        let turn = UnitQuaternion::from_euler_angles(0.1, -0.2 + 0.1 * f64::from(k), 0.3);
        let pose = Pose::new(turn, Vector3::new(0.3 * f64::from(k), -0.1, 0.05));
        problem.add_pose(pose, 0).unwrap();
        problem.set_row_motion(k as usize, motion()).unwrap();
    }
    for k in 0..5 {
        let x = Vector3::new(0.4 * f64::from(k) - 0.8, 0.3 - 0.2 * f64::from(k), 2.0);
        let at = problem.pose(0).unwrap().transform(&x);
        let point = problem.add_point(at).unwrap();
        for view in 0..2 {
            let x = problem.pose(view).unwrap().inverse().transform(&at);
            let pixel = camera.project(&x).unwrap() + Vector2::new(5.0, -3.0);
            let read = ReadDepth {
                inv_depth: 1.1 / x.z,
                sigma: 0.1,
                colour_offset_s: 0.02,
                by_offset: 0.7 - 0.3 * f64::from(k),
                place: [x.x / x.z + 0.02, x.y / x.z - 0.03],
            };
            let spread = Matrix2::new(40.0, 6.0, 6.0, 30.0);
            problem
                .add_sighting(view, point, pixel, &spread, (k != 3).then_some(read))
                .unwrap();
        }
    }
    for (k, name) in DEVICE.into_iter().chain(["fx", "cx"]).enumerate() {
        problem
            .add_camera_prior(0, name, 0.1 * k as f64, 0.2 + 0.1 * k as f64)
            .unwrap();
    }
    problem.losses.pixel = loss(0.8);
    problem.losses.inverse_depth = loss(0.6);
    problem
}

#[test]
fn gradient_by_poses_points_and_device_equals_differences() {
    for (camera, lens) in [
        (0, &["fx", "fy", "cx", "cy"][..]),
        (1, &["fx", "fy", "cx", "cy", "k1"]),
        (2, &[]),
        (3, &["focal", "k1"]),
    ] {
        let names: Vec<&str> = lens.iter().chain(&DEVICE).copied().collect();
        let losses: [fn(f64) -> Loss; 3] = [|_| Loss::Quadratic, Loss::Cauchy, Loss::Huber];
        for loss in losses {
            let mut problem = sample(camera, loss);
            problem.free_intrinsics(0, &names).unwrap();
            check(problem, names[0]);
        }
    }
}

#[test]
fn gradient_of_a_known_device_equals_differences() {
    check(sample(1, |_| Loss::Quadratic), "known device");
}

#[test]
fn normal_matrix_of_sightings_equals_that_of_differences() {
    let mut problem = sample(1, |_| Loss::Quadratic);
    let names: Vec<&str> = ["fx", "k1"].into_iter().chain(DEVICE).collect();
    problem.free_intrinsics(0, &names).unwrap();
    // priors have no residuals among those that are compared
    problem.forget_camera_priors();
    assert_eq!(normal_matrix(problem), 2 * 36 + 12 * 12 + 2 * 6 * 12);
}

#[test]
fn bad_device_arguments_are_errors_by_name() {
    let mut problem = sample(1, |_| Loss::Quadratic);
    let (pixel, spread) = (Vector2::new(300.0, 200.0), Matrix2::identity());
    let good = ReadDepth {
        inv_depth: 0.5,
        sigma: 0.1,
        colour_offset_s: 0.0,
        by_offset: 0.0,
        place: [0.1, 0.2],
    };
    let mut add = |pose, read| problem.add_sighting(pose, 0, pixel, &spread, Some(read));
    for (name, found) in [
        ("pose", add(2, good)),
        (
            "inv_depth",
            add(
                0,
                ReadDepth {
                    inv_depth: 0.0,
                    ..good
                },
            ),
        ),
        (
            "sigma",
            add(
                0,
                ReadDepth {
                    sigma: f64::NAN,
                    ..good
                },
            ),
        ),
        (
            "by_offset",
            add(
                0,
                ReadDepth {
                    by_offset: f64::NAN,
                    ..good
                },
            ),
        ),
    ] {
        let text = found.unwrap_err().to_string();
        assert!(text.starts_with(name), "{name}: {text}");
    }
    let still = RowMotion {
        omega: Vector3::repeat(f64::NAN),
        ..RowMotion::default()
    };
    let wrong = DeviceCalibration {
        readout_s: f64::INFINITY,
        ..DeviceCalibration::default()
    };
    for (name, found) in [
        ("omega", problem.set_row_motion(0, still)),
        ("device", problem.set_device(0, &wrong)),
        (
            "camera",
            problem.set_device(1, &DeviceCalibration::default()),
        ),
        ("name", problem.add_camera_prior(0, "k9", 0.0, 1.0)),
        ("sigma", problem.add_camera_prior(0, "k1", 0.0, 0.0)),
        (
            "free intrinsics",
            problem.free_intrinsics(0, &["readout_s", "readout_s"]),
        ),
    ] {
        let text = found.unwrap_err().to_string();
        assert!(text.starts_with(name), "{name}: {text}");
    }
}
