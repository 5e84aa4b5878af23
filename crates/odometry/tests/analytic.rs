//! Velocities from exact depth: accuracy, signs and frames, any camera, observability, statuses.

mod scene;

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use scene::{Scene, pinhole, twist, two_poses};
use sphereflow_core::{DepthMap, Plane, Pose, Reason, TrackStatus, Twist};
use sphereflow_odometry::{Config, CovarianceModel, VelocityEstimate, estimate_velocity};
use sphereflow_sphere::Camera;

const DT_S: f64 = 1.0 / 30.0;
/// What exact depth at 30 Hz must give, m/s and rad/s: the acceptance figure of the method.
const EXACT: f64 = 1e-3;

fn somewhere() -> Pose {
    Pose::new(
        UnitQuaternion::from_euler_angles(0.1, -0.2, 0.3),
        Vector3::new(0.2, -0.1, 0.3),
    )
}

fn measure(scene: &Scene, camera: &Camera, motion: &Twist, config: &Config) -> VelocityEstimate {
    let (a, b) = two_poses(&somewhere(), motion, DT_S);
    if camera.wraps_around() {
        let (a, b) = (scene.ranges(camera, &a), scene.ranges(camera, &b));
        estimate_velocity(camera, &a, &b, DT_S, config).unwrap()
    } else {
        let (a, b) = (scene.depths(camera, &a), scene.depths(camera, &b));
        estimate_velocity(camera, &a, &b, DT_S, config).unwrap()
    }
}

fn errors(estimate: &VelocityEstimate, truth: &Twist) -> (f64, f64) {
    let found = estimate.twist.expect("lost");
    (
        (found.angular_rad_s - truth.angular_rad_s).norm(),
        (found.linear_m_s - truth.linear_m_s).norm(),
    )
}

/// Thesis: eq. (6.3), eq. (1.17): signs and frames of all six velocities.
#[test]
fn estimate_each_axis_alone_has_its_sign_and_frame() {
    for warps in [0, 1] {
        let config = Config {
            warps,
            ..Config::default()
        };
        for axis in 0..6 {
            let mut values = [0.0; 6];
            values[axis] = 0.3;
            let motion = twist(values);
            let estimate = measure(&Scene::room(), &pinhole(), &motion, &config);
            let (w, v) = errors(&estimate, &motion);
            println!(
                "warps {warps} axis {axis}: {w:.2e} rad/s {v:.2e} m/s, {:?}",
                estimate.status
            );
            assert!(w < EXACT && v < EXACT, "axis {axis}: {w} rad/s, {v} m/s");
            assert_eq!(estimate.status, TrackStatus::Tracked);
        }
    }
}

#[test]
fn estimate_general_motion_is_exact_for_every_camera() {
    let motion = twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3]);
    let cameras = [
        ("pinhole", pinhole()),
        ("360 degrees", Camera::equirectangular(512, 256).unwrap()),
    ];
    for (name, camera) in cameras {
        let estimate = measure(&Scene::room(), &camera, &motion, &Config::default());
        let (w, v) = errors(&estimate, &motion);
        println!(
            "{name}: {w:.2e} rad/s {v:.2e} m/s, score {:.3}",
            estimate.score
        );
        assert!(w < EXACT && v < EXACT, "{name}: {w} rad/s, {v} m/s");
    }
}

#[test]
fn debug_wall() {
    let motion = twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3]);
    for (name, scene) in [
        ("wall", Scene::wall(Vector3::new(0.1, 0.1, 1.0), 2.0)),
        ("sphere", Scene::Sphere(Vector3::new(0.3, 0.2, 0.1), 2.0)),
        ("ellipsoid", Scene::Ellipsoid(Vector3::new(2.0, 1.5, 2.5))),
    ] {
        for camera in [pinhole(), Camera::equirectangular(512, 256).unwrap()] {
            if camera.wraps_around() && name == "wall" {
                continue;
            }
            let e = measure(&scene, &camera, &motion, &Config::default());
            println!("{name} {:?} score {} {:?}", e.status, e.score, e.twist);
            for w in e.weak_directions {
                println!("   {:?}", w);
            }
        }
    }
}
