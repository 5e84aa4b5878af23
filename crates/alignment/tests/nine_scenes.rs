//! The scenes whose unseen motions are known: dimension and directions from one range image each.
//!
//! `cargo test -p sphereflow-alignment --test nine_scenes -- --nocapture` prints the spectra.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

mod scene;

use nalgebra::{Matrix6, Vector2, Vector3, Vector6};
use scene::{pinhole, somewhere, twist};
use sphereflow_alignment::{Information, direction_name, information, pose_from_twist};
use sphereflow_core::{DepthMap, Plane, Pose, RangeMap};
use sphereflow_sphere::Camera;

/// Sine of the largest angle between what is unseen and what was predicted.
const ONE_DEGREE: f64 = 0.01745;
/// What changes the image less than this share of the best seen motion is unseen.
const UNSEEN: f64 = 0.01;

/// Range from a point of the world along a unit ray; NaN where nothing is hit.
type Caster = Box<dyn Fn(&Vector3<f64>, &Vector3<f64>) -> f64>;

/// An ellipsoid about the origin, from inside.
fn ellipsoid(axes: [f64; 3]) -> Caster {
    let inverse = Vector3::from(axes).map(|a| 1.0 / a);
    Box::new(move |origin, ray| {
        let (o, r) = (origin.component_mul(&inverse), ray.component_mul(&inverse));
        let (a, b, c) = (r.dot(&r), r.dot(&o), o.dot(&o) - 1.0);
        (-b + (b * b - a * c).sqrt()) / a
    })
}

/// Walls `normal . X = distance`, from the side of the origin.
fn walls(list: &[([f64; 3], f64)]) -> Caster {
    let list: Vec<_> = list
        .iter()
        .map(|(n, d)| (Vector3::from(*n).normalize(), *d))
        .collect();
    Box::new(move |origin, ray| {
        list.iter()
            .map(|(normal, distance)| (distance - normal.dot(origin)) / normal.dot(ray))
            .filter(|t| *t > 0.0)
            .fold(f64::NAN, f64::min)
    })
}

/// A round room about the y axis with floor and ceiling, from inside.
fn round_room(radius: f64, half_height: f64) -> Caster {
    let caps = walls(&[
        ([0.0, 1.0, 0.0], half_height),
        ([0.0, -1.0, 0.0], half_height),
    ]);
    Box::new(move |origin, ray| {
        let (o, r) = (Vector2::new(origin.x, origin.z), Vector2::new(ray.x, ray.z));
        let (a, b, c) = (r.dot(&r), r.dot(&o), o.dot(&o) - radius * radius);
        let side = (-b + (b * b - a * c).sqrt()) / a;
        side.min(caps(origin, ray))
    })
}

/// Ranges of a whole-sphere camera, depths of the others.
fn see(camera: &Camera, pose: &Pose, caster: &Caster) -> Information {
    let image = |along: fn(&Vector3<f64>) -> f64| {
        Plane::from_fn(camera.width(), camera.height(), |x, y| {
            let ray = camera.unproject(&Vector2::new(x as f64, y as f64)).unwrap();
            (caster(&pose.translation, &(pose.rotation * ray)) * along(&ray)) as f32
        })
    };
    if camera.wraps_around() {
        information(camera, &RangeMap::new(image(|_| 1.0))).unwrap()
    } else {
        information(camera, &DepthMap::new(image(|ray| ray.z))).unwrap()
    }
}

/// `[omega, v]` of a camera at `pose` that turns about an axis of the world.
fn rotation(pose: &Pose, axis: Vector3<f64>, point: Vector3<f64>) -> Vector6<f64> {
    let omega = pose.rotation.inverse() * axis;
    let v = -omega.cross(&pose.inverse().transform(&point));
    Vector6::new(omega.x, omega.y, omega.z, v.x, v.y, v.z)
}

/// `[omega, v]` of a camera at `pose` that moves along a direction of the world.
fn translation(pose: &Pose, along: Vector3<f64>) -> Vector6<f64> {
    let v = pose.rotation.inverse() * along;
    Vector6::new(0.0, 0.0, 0.0, v.x, v.y, v.z)
}

fn print(name: &str, found: &Information) {
    let [a, b, c, d, e, f] = found.eigenvalues.map(|v| v / found.eigenvalues[5]);
    println!(
        "{name}: {a:.1e} {b:.1e} {c:.1e} {d:.3} {e:.3} {f:.0}, score {:.4}, {:.2} m",
        found.score, found.mean_range_m
    );
    for direction in found.unseen(UNSEEN) {
        println!("    unseen: {}", direction_name(&direction).unwrap());
    }
}

/// The unseen motions are as many as predicted, and the same.
fn assert_unseen(name: &str, found: &Information, predicted: &[Vector6<f64>]) {
    print(name, found);
    let range = found.mean_range_m;
    let scale = Matrix6::from_diagonal(&Vector6::new(range, range, range, 1.0, 1.0, 1.0));
    let unseen: Vec<Vector6<f64>> = found.unseen(UNSEEN).iter().map(|d| scale * d).collect();
    assert_eq!(unseen.len(), predicted.len(), "{name}");
    // Each prediction within the span of what is unseen, and the other way round as the dimensions
    // agree and the predictions are independent.
    for direction in predicted {
        let unit = (scale * direction).normalize();
        let within: Vector6<f64> = unseen.iter().map(|d| d * d.dot(&unit)).sum();
        let outside = (unit - within).norm();
        println!(
            "    predicted motion is {:.2} degrees off",
            outside.asin().to_degrees()
        );
        assert!(outside < ONE_DEGREE, "{name}: {outside}");
    }
}

fn whole() -> Camera {
    Camera::equirectangular(640, 320).unwrap()
}

fn axes() -> [Vector3<f64>; 3] {
    [Vector3::x(), Vector3::y(), Vector3::z()]
}

/// Thesis: Theorem 3: every axis through the centre is a rotation axis. The same of a painted
/// sphere, as long as its paint is not looked at.
#[test]
fn sphere_hides_the_three_rotations_about_its_centre() {
    let centred = Pose::new(somewhere().rotation, Vector3::zeros());
    for (name, camera) in [
        ("sphere, all of it", whole()),
        ("sphere, a view", pinhole()),
    ] {
        for pose in [centred, somewhere()] {
            let found = see(&camera, &pose, &ellipsoid([2.0; 3]));
            let predicted = axes().map(|axis| rotation(&pose, axis, Vector3::zeros()));
            assert_unseen(name, &found, &predicted);
        }
    }
}

/// Thesis: Theorem 3: one rotation axis.
#[test]
fn spheroid_hides_the_rotation_about_its_axis() {
    let pose = somewhere();
    let found = see(&whole(), &pose, &ellipsoid([2.0, 1.5, 2.0]));
    let predicted = rotation(&pose, Vector3::y(), Vector3::zeros());
    assert_unseen("spheroid", &found, &[predicted]);
}

/// Thesis: Theorem 3: one rotation axis.
#[test]
fn round_room_hides_the_rotation_about_its_axis() {
    let pose = somewhere();
    let found = see(&whole(), &pose, &round_room(2.5, 1.3));
    let predicted = rotation(&pose, Vector3::y(), Vector3::zeros());
    assert_unseen("round room with floor and ceiling", &found, &[predicted]);
}

/// Thesis: Theorem 3: no rotation axis, nothing unseen.
#[test]
fn ellipsoid_of_three_axes_hides_nothing() {
    let found = see(&whole(), &somewhere(), &ellipsoid([2.0, 1.5, 2.5]));
    assert_unseen("ellipsoid", &found, &[]);
}

/// Thesis: Theorem 3: no rotation axis, nothing unseen.
#[test]
fn box_room_hides_nothing() {
    let room = [
        ([1.0, 0.0, 0.0], 1.5),
        ([-1.0, 0.0, 0.0], 1.5),
        ([0.0, 1.0, 0.0], 2.25),
        ([0.0, -1.0, 0.0], 2.25),
        ([0.0, 0.0, 1.0], 2.0),
        ([0.0, 0.0, -1.0], 2.0),
    ];
    let found = see(&whole(), &somewhere(), &walls(&room));
    assert_unseen("box room", &found, &[]);
    assert!(found.score > 0.2, "{}", found.score);
}

/// Thesis: Theorem 3, for a camera with a limited view: what slides on itself goes unseen.
#[test]
fn one_wall_hides_its_rotation_and_two_translations() {
    let pose = somewhere();
    let normal = Vector3::new(0.2, 0.1, 1.0).normalize();
    let found = see(&pinhole(), &pose, &walls(&[([0.2, 0.1, 1.0], 2.5)]));
    let aside = normal.cross(&Vector3::y()).normalize();
    let predicted = [
        rotation(&pose, normal, pose.translation),
        translation(&pose, aside),
        translation(&pose, normal.cross(&aside)),
    ];
    assert_unseen("one wall", &found, &predicted);
}

/// Thesis: Theorem 3, for a camera with a limited view.
#[test]
fn two_walls_and_an_endless_corridor_hide_the_translation_along_them() {
    let pose = Pose::new(somewhere().rotation, Vector3::new(0.2, -0.1, 0.0));
    let edge = [([1.0, 0.0, 0.6], 2.0), ([-1.0, 0.0, 0.8], 2.2)];
    let found = see(&pinhole(), &pose, &walls(&edge));
    assert_unseen("two walls", &found, &[translation(&pose, Vector3::y())]);
    let corridor = [
        ([1.0, 0.0, 0.0], 1.0),
        ([-1.0, 0.0, 0.0], 1.0),
        ([0.0, 1.0, 0.0], 1.4),
        ([0.0, -1.0, 0.0], 1.2),
    ];
    let found = see(&pinhole(), &pose, &walls(&corridor));
    let along = translation(&pose, Vector3::z());
    assert_unseen("corridor without end", &found, &[along]);
}

/// Thesis: Theorem 3, for a camera with a limited view: the end wall is enough.
#[test]
fn corridor_with_an_end_wall_and_a_corner_hide_nothing() {
    let pose = Pose::new(somewhere().rotation, Vector3::new(0.2, -0.1, 0.0));
    let corridor = [
        ([1.0, 0.0, 0.0], 1.0),
        ([-1.0, 0.0, 0.0], 1.0),
        ([0.0, 1.0, 0.0], 1.4),
        ([0.0, -1.0, 0.0], 1.2),
        ([0.0, 0.0, 1.0], 4.0),
    ];
    let end = see(&pinhole(), &pose, &walls(&corridor));
    assert_unseen("corridor with an end wall", &end, &[]);
    let corner = [
        ([1.0, 0.0, 1.0], 2.0),
        ([-1.0, 0.0, 1.0], 2.2),
        ([0.0, 1.0, 0.3], 1.2),
    ];
    let corner = see(&pinhole(), &pose, &walls(&corner));
    assert_unseen("corner with floor", &corner, &[]);
    assert!(end.score > 2.0 * UNSEEN && corner.score > 5.0 * UNSEEN);
}

/// The matrix is that of the true derivatives of the range, by central differences of the poses.
#[test]
fn information_is_the_gram_matrix_of_differences() {
    /// Means over domains of 3 degrees against values at points.
    const AVERAGING: f64 = 2e-3;
    const STEP_S: f64 = 1e-4;
    let (camera, pose, caster) = (pinhole(), somewhere(), ellipsoid([2.0, 1.5, 2.5]));
    let found = see(&camera, &pose, &caster);
    let coarse = camera.binned(8).unwrap();
    let (mut matrix, mut area, mut mean) = (Matrix6::<f64>::zeros(), 0.0, 0.0);
    let solid = sphereflow_sphere::SphereGrid::new(&coarse).unwrap();
    for (i, ray) in solid.rays().iter().enumerate() {
        let range = |values: [f64; 6], time_s: f64| {
            let moved = pose * pose_from_twist(&twist(values), time_s);
            caster(&moved.translation, &(moved.rotation * ray))
        };
        let row = Vector6::from_fn(|k, _| {
            let mut values = [0.0; 6];
            values[k] = 1.0;
            (range(values, STEP_S) - range(values, -STEP_S)) / (2.0 * STEP_S)
        });
        let weight = solid.solid_angle()[i];
        matrix += row * row.transpose() * weight;
        mean += range([0.0; 6], 0.0) * weight;
        area += weight;
    }
    matrix /= area;
    let error = (found.matrix - matrix).norm() / matrix.norm();
    assert!(error < AVERAGING, "{error}: {} {matrix}", found.matrix);
    assert!((found.mean_range_m - mean / area).abs() < AVERAGING);
}

/// Thesis: Theorem 3, on what a noisy camera sees: noise must not make a wall look known.
#[test]
fn one_wall_with_a_noisy_camera_still_hides_three_motions() {
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
    use rand_distr::{Distribution, Normal};
    let camera = Camera::pinhole(580.0, 580.0, 319.5, 239.5, 640, 480).unwrap();
    let normal = Vector3::new(0.2, 0.1, 1.0).normalize();
    let noise = Normal::new(0.0, 1.5e-3).unwrap(); // of the inverse depth, 1/m
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let image = Plane::from_fn(640, 480, |x, y| {
        let ray = camera.unproject(&Vector2::new(x as f64, y as f64)).unwrap();
        let inverse = normal.dot(&ray) / (2.5 * ray.z);
        (1.0 / (inverse + noise.sample(&mut random))) as f32
    });
    let found = information(&camera, &DepthMap::new(image)).unwrap();
    print("one wall with noise", &found);
    assert_eq!(found.unseen(UNSEEN).len(), 3);
}

#[test]
fn information_of_nothing_known_is_nothing() {
    let unknown = DepthMap::new(Plane::filled(320, 240, f32::NAN));
    let found = information(&pinhole(), &unknown).unwrap();
    assert_eq!((found.score, found.domains), (0.0, 0));
    assert_eq!(found.unseen(UNSEEN).len(), 6);
    let small = DepthMap::new(Plane::filled(32, 24, 1.0));
    let error = information(&pinhole(), &small).unwrap_err().to_string();
    assert!(
        error.starts_with("depth: expected shape 320x240"),
        "{error}"
    );
}
