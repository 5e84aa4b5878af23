//! What a model does not see: behind it, beyond its fold, outside its image.

use super::*;
use crate::camera::{KannalaBrandt, Opencv};
use nalgebra::Vector2;
use std::f64::consts::{FRAC_PI_2, PI};

/// A limit keeps 1e-12 of itself away from the fold.
const LIMIT: f64 = 1e-11;

fn at_angle(theta: f64) -> Vector3<f64> {
    Vector3::new(0.6 * theta.sin(), 0.8 * theta.sin(), theta.cos())
}

#[test]
fn points_behind_a_perspective_are_not_seen() {
    let pinhole = Camera::pinhole(FX, FY, CX, CY, WIDTH, HEIGHT).unwrap();
    for camera in [
        pinhole,
        opencv(OPENCV_MILD),
        inverse_polynomial([0.1, 0.0, 0.0, 0.0]),
        fov(1.0),
    ] {
        for point in [
            at_angle(2.0),
            at_angle(PI),
            at_angle(FRAC_PI_2 + 1e-9),
            Vector3::zeros(),
        ] {
            assert_eq!(camera.project(&point), None, "{point} by {camera:?}");
            assert_eq!(camera.project_with_jacobian(&point), None);
        }
    }
}

#[test]
fn no_model_sees_nan_or_the_centre() {
    for (name, camera) in samples() {
        let nan = Vector3::new(f64::NAN, 0.1, 1.0);
        assert_eq!(camera.project(&nan), None, "{name}");
        assert_eq!(
            camera.project(&Vector3::new(0.1, 0.1, f64::NAN)),
            None,
            "{name}"
        );
        assert_eq!(camera.project(&Vector3::zeros()), None, "{name}");
        assert_eq!(camera.project_with_jacobian(&nan), None, "{name}");
        assert_eq!(
            camera.unproject(&Vector2::new(f64::NAN, 10.0)),
            None,
            "{name}"
        );
        assert_eq!(
            camera.unproject(&Vector2::new(f64::INFINITY, 10.0)),
            None,
            "{name}"
        );
    }
}

#[test]
fn opencv_limit_is_the_fold_of_the_radius() {
    // r (1 + k1 r^2) turns at r = 1 / sqrt(-3 k1)
    let model = Opencv::new([-0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let fold = 1.0 / 0.9_f64.sqrt();
    assert!(
        (model.limit() - fold).abs() < LIMIT,
        "{} {fold}",
        model.limit()
    );

    let camera = opencv([-0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let inside = camera.project(&Vector3::new(0.9 * fold, 0.0, 1.0)).unwrap();
    assert!(camera.unproject(&inside).is_some());
    // this point's distorted radius is small again: a folded-back pixel in the image
    let beyond = Vector3::new(1.5 * fold, 0.0, 1.0);
    assert_eq!(camera.project(&beyond), None);
    // and beyond the largest distorted radius there is no ray
    let largest = fold * (1.0 - 0.3 * fold * fold);
    let pixel = |radius: f64| Vector2::new(CX + FX * radius, CY);
    assert!(camera.unproject(&pixel(largest * (1.0 - 1e-9))).is_some());
    assert_eq!(camera.unproject(&pixel(largest * (1.0 + 1e-6))), None);
}

#[test]
fn opencv_calibrations_in_use_see_their_whole_image() {
    // Freiburg 1 and 2 of the TUM RGB-D benchmark, camera 0 of EuRoC
    let tum_1 = [0.2624, -0.9531, -0.0054, 0.0026, 1.1633, 0.0, 0.0, 0.0];
    let tum_2 = [0.2312, -0.7849, -0.0033, -0.0001, 0.9172, 0.0, 0.0, 0.0];
    let euroc = [
        -0.28340811,
        0.07395907,
        0.00019359,
        1.76187114e-05,
        0.0,
        0.0,
        0.0,
        0.0,
    ];
    let cameras = [
        Camera::opencv(517.3, 516.5, 318.6, 255.3, tum_1, 640, 480).unwrap(),
        Camera::opencv(520.9, 521.0, 325.1, 249.7, tum_2, 640, 480).unwrap(),
        Camera::opencv(458.654, 457.296, 367.215, 248.375, euroc, 752, 480).unwrap(),
    ];
    for camera in cameras {
        for row in 0..camera.height() {
            for col in 0..camera.width() {
                let pixel = Vector2::new(col as f64, row as f64);
                assert!(camera.unproject(&pixel).is_some(), "{pixel} of {camera:?}");
            }
        }
    }
    let folding = Opencv::new(OPENCV_BARREL)
        .unwrap()
        .limit()
        .atan()
        .to_degrees();
    println!("the strong barrel sees {folding} degrees");
}

#[test]
fn opencv_limit_stops_before_a_pole() {
    let model = Opencv::new([0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0]).unwrap();
    assert!((model.limit() - 2.0).abs() < 1e-9, "{}", model.limit()); // 1 - r^2/4 = 0
}

#[test]
fn opencv_tangential_terms_shrink_the_limit_to_where_the_map_is_one_to_one() {
    // along -p, m = r - 3 |p| r^2 turns at r = 1 / (6 |p|)
    let model = Opencv::new([0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0]).unwrap();
    assert!(
        (model.limit() - 1.0 / 0.6).abs() < LIMIT,
        "{}",
        model.limit()
    );
    let camera = opencv([0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(camera.project(&Vector3::new(-1.7, 0.0, 1.0)), None);
    assert!(camera.project(&Vector3::new(-1.6, 0.0, 1.0)).is_some());
}

#[test]
fn inverse_polynomial_limit_is_the_fold_of_the_polynomial() {
    // Thesis: eq. (1.5): r_d (1 - 0.2 r_d^2) turns at r_d = 1 / sqrt(0.6), at r_u = 2/3 of that
    let camera = inverse_polynomial([-0.2, 0.0, 0.0, 0.0]);
    let fold = 1.0 / 0.6_f64.sqrt();
    let pixel = |radius: f64| Vector2::new(CX + FX * radius, CY);
    assert!(camera.unproject(&pixel(fold * (1.0 - 1e-9))).is_some());
    assert_eq!(camera.unproject(&pixel(fold * (1.0 + 1e-9))), None);
    let at = |r_u: f64| camera.project(&Vector3::new(r_u, 0.0, 1.0));
    assert!(at(fold * 2.0 / 3.0 * (1.0 - 1e-9)).is_some());
    assert_eq!(at(fold * 2.0 / 3.0 * (1.0 + 1e-9)), None);
}

#[test]
fn kannala_brandt_sees_behind_itself_up_to_the_fold() {
    let camera = kannala_brandt([0.0; 4]);
    assert!(camera.project(&at_angle(2.5)).is_some());
    assert!(camera.project(&at_angle(PI - 1e-9)).is_some());
    assert_eq!(camera.project(&Vector3::new(0.0, 0.0, -1.0)), None); // every direction at once
    // 1 - 3 * 0.1 theta^2 = 0
    let model = KannalaBrandt::new([-0.1, 0.0, 0.0, 0.0]).unwrap();
    let fold = 1.0 / 0.3_f64.sqrt();
    assert!((model.limit() - fold).abs() < LIMIT);
    let camera = kannala_brandt([-0.1, 0.0, 0.0, 0.0]);
    assert!(camera.project(&at_angle(fold - 1e-9)).is_some());
    assert_eq!(camera.project(&at_angle(fold + 1e-9)), None);
    assert_eq!(camera.unproject(&Vector2::new(CX + 190.0 * fold, CY)), None);
}

/// The unified model's border (Usenko, Demmel and Cremers 2018): z > -w1 d.
fn w1(alpha: f64) -> f64 {
    if alpha <= 0.5 {
        alpha / (1.0 - alpha)
    } else {
        (1.0 - alpha) / alpha
    }
}

#[test]
fn unified_and_double_sphere_see_exactly_where_they_are_one_to_one() {
    for alpha in [0.0, 0.2, 0.5, 0.65, 0.9, 1.0] {
        let w1 = w1(alpha);
        for xi in [-0.6, -0.2, 0.0, 0.3, 0.8_f64] {
            let root = (1.0 - xi * xi + w1 * w1 * xi * xi).sqrt();
            let w2 = xi - w1 * w1 * xi + w1 * root;
            for (camera, border) in [(unified(alpha), w1), (double_sphere(xi, alpha), w2)] {
                let seen = |z: f64| camera.project(&at_angle(z.acos())).is_some();
                assert!(seen(1e-7 - border), "alpha {alpha} xi {xi}");
                let all = border > 1.0 - 1e-7;
                assert!(all || !seen(-border - 1e-7), "alpha {alpha} xi {xi}");
            }
        }
    }
}

#[test]
fn double_sphere_border_of_the_paper_lies_within_for_its_lenses() {
    // and is no border of the model: with alpha = 0 it lets through what is behind the image plane
    let printed = |w1: f64, xi: f64| (w1 + xi) / (2.0 * w1 * xi + xi * xi + 1.0).sqrt();
    for (xi, alpha) in [
        (-0.2, 0.57),
        (-0.27, 0.55),
        (-0.18, 0.59),
        (0.02, 0.6),
        (0.3, 0.65),
    ] {
        let z: f64 = 1e-9 - printed(w1(alpha), xi);
        assert!(
            double_sphere(xi, alpha)
                .project(&at_angle(z.acos()))
                .is_some(),
            "{xi} {alpha}"
        );
    }
    let z: f64 = 1e-9 - printed(0.0, -0.6);
    assert_eq!(double_sphere(-0.6, 0.0).project(&at_angle(z.acos())), None);
}

#[test]
fn unified_image_is_a_disc_above_one_half() {
    let camera = unified(0.8);
    let radius = 1.0 / 0.6_f64.sqrt();
    let pixel = |r: f64| Vector2::new(CX + 250.0 * r, CY);
    assert!(camera.unproject(&pixel(radius * (1.0 - 1e-9))).is_some());
    assert_eq!(camera.unproject(&pixel(radius * (1.0 + 1e-9))), None);
}
