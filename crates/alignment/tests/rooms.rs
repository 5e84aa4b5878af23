//! Accuracy in simulated rooms at 640x480: exact depth, noise, cameras, and the information bound.
//!
//! `cargo test -p sphereflow-alignment --release --test rooms -- --nocapture` prints the figures.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

use nalgebra::{Matrix6, UnitQuaternion, Vector3};
use sphereflow_alignment::{
    Config, CovarianceModel, DepthImage, VelocityEstimate, VelocityEstimator, twist_from_pose,
};
use sphereflow_core::{DepthMap, Pose, RangeMap, Twist};
use sphereflow_sim::noise::{CorrelationScale, DepthNoise, KinectNoise, KinectParameters};
use sphereflow_sim::{Motion, Renderer, Scene};
use sphereflow_sphere::Camera;

const FRAME_S: f64 = 1.0 / 30.0;

fn vga() -> Camera {
    Camera::pinhole(577.0, 577.0, 319.5, 239.5, 640, 480).unwrap()
}

/// A disparity camera with independent noise: sigma of 1/Z 1.5e-3 before and 1.71e-3 after
/// quantisation, holes, the projector's shadow, no distortion.
fn disparity_noise() -> DepthNoise {
    let parameters = KinectParameters {
        sigma_inv_m: 1.71e-3,
        correlation: vec![CorrelationScale {
            variance_share: 1.0,
            decay_per_px: 0.0,
        }],
        distortion: None,
        ..KinectParameters::default()
    };
    DepthNoise::Kinect(KinectNoise::new(parameters, 1).unwrap())
}

/// Errors of a run of pairs, sorted.
struct Errors {
    v: Vec<f64>,
    w: Vec<f64>,
    /// Squared errors over the covariance.
    normalised: Vec<f64>,
    /// Standard deviations that the covariance claims: m/s and rad/s.
    claimed_v: Vec<f64>,
    claimed_w: Vec<f64>,
    lost: usize,
}

fn quantile(values: &[f64], share: f64) -> f64 {
    values[(values.len() as f64 * share) as usize]
}

impl Errors {
    fn of(results: &[(VelocityEstimate, Twist)]) -> Self {
        let mut errors = Self {
            v: Vec::new(),
            w: Vec::new(),
            normalised: Vec::new(),
            claimed_v: Vec::new(),
            claimed_w: Vec::new(),
            lost: 0,
        };
        for (estimate, truth) in results {
            let (Some(twist), Some(covariance)) = (estimate.twist, estimate.covariance) else {
                errors.lost += 1;
                continue;
            };
            let error = twist.vector() - truth.vector();
            errors.v.push((twist.linear_m_s - truth.linear_m_s).norm());
            errors
                .w
                .push((twist.angular_rad_s - truth.angular_rad_s).norm());
            let inverse: Matrix6<f64> = covariance.try_inverse().unwrap();
            errors.normalised.push(error.dot(&(inverse * error)));
            let part = |k| covariance.fixed_view::<3, 3>(k, k).trace().sqrt();
            errors.claimed_w.push(part(0));
            errors.claimed_v.push(part(3));
        }
        for values in [
            &mut errors.v,
            &mut errors.w,
            &mut errors.normalised,
            &mut errors.claimed_v,
            &mut errors.claimed_w,
        ] {
            values.sort_by(f64::total_cmp);
        }
        errors
    }

    fn print(&self, name: &str) {
        let mean = self.normalised.iter().sum::<f64>() / self.normalised.len() as f64;
        println!(
            "{name}: {:.5} m/s (90 %: {:.5}) {:.5} rad/s ({:.5}); claimed {:.5} m/s {:.5} rad/s; \
             squared error over covariance {mean:.1} (median {:.1}); {} lost of {}",
            quantile(&self.v, 0.5),
            quantile(&self.v, 0.9),
            quantile(&self.w, 0.5),
            quantile(&self.w, 0.9),
            quantile(&self.claimed_v, 0.5),
            quantile(&self.claimed_w, 0.5),
            quantile(&self.normalised, 0.5),
            self.lost,
            self.lost + self.v.len(),
        );
    }

    fn mean_normalised(&self) -> f64 {
        self.normalised.iter().sum::<f64>() / self.normalised.len() as f64
    }
}

struct Case<'a> {
    scene: Scene,
    camera: Camera,
    noise: DepthNoise,
    turn: UnitQuaternion<f64>,
    pairs: usize,
    dt_s: f64,
    /// Seconds of the path's motion in one pair: longer than `dt_s` is faster.
    moved_s: f64,
    config: &'a Config,
}

impl Case<'_> {
    fn furnished(config: &Config) -> Case<'_> {
        Case {
            scene: Scene::furnished_room(0),
            camera: vga(),
            noise: DepthNoise::None,
            turn: UnitQuaternion::identity(),
            pairs: 24,
            dt_s: FRAME_S,
            moved_s: FRAME_S,
            config,
        }
    }

    fn run(&self, name: &str) -> Errors {
        let renderer = Renderer::new(&self.scene, &self.camera);
        let mount = Pose::new(self.turn, Vector3::zeros());
        let motion = Motion::hand_held(3);
        let mut estimator = VelocityEstimator::new(&self.camera, *self.config).unwrap();
        let all_round = self.camera.wraps_around();
        let results: Vec<(VelocityEstimate, Twist)> = (0..self.pairs)
            .map(|i| {
                let start_s = 0.8 * i as f64;
                let poses = [start_s, start_s + self.moved_s].map(|t| motion.pose(t) * mount);
                let truth = twist_from_pose(&(poses[0].inverse() * poses[1]), self.dt_s);
                let rendered = poses.map(|pose| renderer.render(&pose));
                let found = if all_round {
                    let [a, b]: [&RangeMap; 2] = [&rendered[0].range, &rendered[1].range];
                    estimator.estimate(DepthImage::Range(a), DepthImage::Range(b), self.dt_s)
                } else {
                    let mut index = 2 * i as u64;
                    let [a, b]: [DepthMap; 2] = rendered.map(|image| {
                        index += 1;
                        self.noise.apply(&image.depth, &self.camera, index).unwrap()
                    });
                    estimator.estimate(&a, &b, self.dt_s)
                };
                (found.unwrap(), truth)
            })
            .collect();
        let errors = Errors::of(&results);
        errors.print(name);
        errors
    }
}

/// Covariance of exact geometry with independent noise, as it is here.
fn independent() -> Config {
    Config {
        covariance: CovarianceModel::independent(),
        ..Config::default()
    }
}

#[test]
fn exact_depth_of_rooms_gives_the_velocity() {
    /// m/s and rad/s, medians: ten times the rounding of the depth images.
    const EXACT: f64 = 1e-4;
    /// Nine in ten: creases bias their domains.
    const MOST: f64 = 1e-3;
    let config = independent();
    let furnished = Case::furnished(&config).run("furnished, exact");
    assert!(quantile(&furnished.v, 0.5) < EXACT && quantile(&furnished.w, 0.5) < EXACT);
    assert!(quantile(&furnished.v, 0.9) < MOST && quantile(&furnished.w, 0.9) < MOST);
    let fast = Case {
        moved_s: 4.0 * FRAME_S,
        ..Case::furnished(&config)
    }
    .run("furnished, exact, four times as fast");
    assert!(quantile(&fast.v, 0.9) < MOST && quantile(&fast.w, 0.9) < MOST);
    // The floor's corner: a convex room seen ahead shows one wall, which tells half of the motion.
    let convex = Case {
        scene: Scene::thesis_room(),
        turn: UnitQuaternion::from_euler_angles(-0.6, 0.75, 0.0),
        ..Case::furnished(&config)
    }
    .run("convex, exact, a corner");
    assert!(quantile(&convex.v, 0.5) < EXACT && quantile(&convex.w, 0.5) < EXACT);
    assert!(quantile(&convex.v, 0.9) < MOST && quantile(&convex.w, 0.9) < MOST);
    assert_eq!(furnished.lost + fast.lost + convex.lost, 0);
}

/// The claimed standard deviation is that of the solve, k = 1.2: over 1.2 it is the information
/// bound of the domain means.
#[test]
fn disparity_noise_in_a_furnished_room_is_near_the_information_bound() {
    let config = independent();
    let frame = Case {
        noise: disparity_noise(),
        pairs: 100,
        ..Case::furnished(&config)
    }
    .run("furnished, disparity noise, 33 ms");
    assert!(quantile(&frame.v, 0.5) < 0.006 && quantile(&frame.w, 0.5) < 0.003);
    assert!(quantile(&frame.v, 0.9) < 0.012 && quantile(&frame.w, 0.9) < 0.006);
    let mean = frame.mean_normalised();
    assert!((4.0..12.0).contains(&mean), "{mean}");
    assert_eq!(frame.lost, 0);
    let four = Case {
        noise: disparity_noise(),
        pairs: 100,
        dt_s: 4.0 * FRAME_S,
        moved_s: 4.0 * FRAME_S,
        ..Case::furnished(&config)
    }
    .run("furnished, disparity noise, 133 ms");
    assert!(quantile(&four.v, 0.5) < 0.002 && quantile(&four.w, 0.5) < 0.001);
    let mean = four.mean_normalised();
    assert!((4.0..12.0).contains(&mean), "{mean}");
    // None converges to a wrong motion.
    assert!(quantile(&four.v, 0.99) < 0.01 && quantile(&four.w, 0.99) < 0.005);
}

#[test]
fn exact_depth_of_other_cameras_is_of_the_same_class() {
    /// m/s and rad/s, as for the pinhole: medians, and nine in ten.
    const EXACT: f64 = 1e-4;
    const MOST: f64 = 1e-3;
    let config = independent();
    let cameras = [
        (
            "fish-eye",
            Camera::kannala_brandt(
                230.0,
                230.0,
                319.5,
                239.5,
                [0.01, -0.003, 0.0, 0.0],
                640,
                480,
            )
            .unwrap(),
        ),
        (
            "FOV fish-eye",
            Camera::fov(330.0, 330.0, 319.5, 239.5, 0.9, 640, 480).unwrap(),
        ),
        ("360 degrees", Camera::equirectangular(1024, 512).unwrap()),
    ];
    for (name, camera) in cameras {
        let errors = Case {
            camera,
            pairs: 24,
            ..Case::furnished(&config)
        }
        .run(name);
        let (v, w) = (quantile(&errors.v, 0.5), quantile(&errors.w, 0.5));
        assert!(v < EXACT && w < EXACT, "{name}: {v} {w}");
        let (v, w) = (quantile(&errors.v, 0.9), quantile(&errors.w, 0.9));
        assert!(v < MOST && w < MOST, "{name}: {v} {w}");
    }
}
