//! Cameras from named parameters, and errors that name what is wrong.

use super::*;
use crate::camera::MODEL_NAMES;

#[test]
fn named_parameters_of_every_model_make_the_same_camera() {
    for (name, camera) in samples() {
        if name == "unified from xi" || camera.model_name() == "equirectangular" {
            assert!(MODEL_NAMES.contains(&camera.model_name()));
        }
        let params = camera.named_parameters();
        let again = Camera::from_named(camera.model_name(), &params, WIDTH, HEIGHT).unwrap();
        assert_eq!(again, camera, "{name}");
        let values: Vec<f64> = params.iter().map(|(_, value)| *value).collect();
        assert_eq!(camera.with_parameters(&values).unwrap(), camera, "{name}");
        assert!(camera.with_parameters(&[1.0]).is_err());
        // binned: other numbers, still the same camera
        let half = camera.binned(2).unwrap();
        let again = Camera::from_named(
            half.model_name(),
            &half.named_parameters(),
            half.width(),
            half.height(),
        );
        assert_eq!(again.unwrap(), half, "{name}");
    }
}

#[test]
fn every_model_name_is_shown_by_a_sample() {
    for name in MODEL_NAMES {
        assert!(
            samples()
                .iter()
                .any(|(_, camera)| camera.model_name() == name),
            "{name}"
        );
    }
}

#[test]
fn parameter_that_is_nan_is_named() {
    for (_, camera) in samples() {
        let params = camera.named_parameters();
        for i in 0..params.len() {
            let mut bad = params.clone();
            bad[i].1 = f64::NAN;
            let error = Camera::from_named(camera.model_name(), &bad, WIDTH, HEIGHT).unwrap_err();
            let text = error.to_string();
            assert!(text.starts_with(&format!("{}:", bad[i].0)), "{text}");
            assert!(text.contains("NaN"), "{text}");
        }
    }
}

#[test]
fn parameter_that_is_missing_is_named_unless_optional() {
    let optional = ["skew", "k2", "k3", "k4", "k5", "k6", "dx", "dy"];
    for (_, camera) in samples() {
        let params = camera.named_parameters();
        for i in 0..params.len() {
            let mut fewer = params.clone();
            let (name, _) = fewer.remove(i);
            match Camera::from_named(camera.model_name(), &fewer, WIDTH, HEIGHT) {
                Ok(_) => assert!(optional.contains(&name), "{name} may be left out"),
                Err(error) => assert!(error.to_string().contains(&format!("`{name}`")), "{error}"),
            }
        }
    }
}

#[test]
fn parameter_that_is_unknown_or_repeated_is_named() {
    for (_, camera) in samples() {
        let mut params = camera.named_parameters();
        params.push(("kappa", 0.1));
        let error = Camera::from_named(camera.model_name(), &params, WIDTH, HEIGHT).unwrap_err();
        assert!(error.to_string().contains("unknown `kappa`"), "{error}");
    }
    let twice = [
        ("fx", 1.0),
        ("fx", 2.0),
        ("fy", 1.0),
        ("cx", 0.0),
        ("cy", 0.0),
    ];
    let error = Camera::from_named("pinhole", &twice, 4, 4).unwrap_err();
    assert!(error.to_string().contains("second `fx`"), "{error}");
}

#[test]
fn model_that_is_unknown_is_named() {
    let params: [(String, f64); 0] = [];
    let error = Camera::from_named("fisheye", &params, 4, 4)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("fisheye") && error.contains("kannala_brandt"),
        "{error}"
    );
}

#[test]
fn parameters_outside_their_domain_are_named() {
    let named = |result: sphereflow_core::Result<Camera>, name: &str| {
        let text = result.unwrap_err().to_string();
        assert!(text.starts_with(&format!("{name}:")), "{text}");
    };
    named(Camera::fov(FX, FY, CX, CY, 0.0, 4, 4), "w");
    named(Camera::fov(FX, FY, CX, CY, 3.2, 4, 4), "w");
    named(Camera::fov(-FX, FY, CX, CY, 0.9, 4, 4), "fx");
    named(Camera::unified(FX, FY, CX, CY, 1.1, 4, 4), "alpha");
    named(Camera::unified_from_xi(FX, FY, CX, CY, -0.1, 4, 4), "xi");
    named(
        Camera::double_sphere(FX, FY, CX, CY, [1.0, 0.5], 4, 4),
        "xi",
    );
    named(
        Camera::double_sphere(FX, 0.0, CX, CY, [0.0, 0.5], 4, 4),
        "fy",
    );
    named(Camera::pinhole(FX, FY, f64::INFINITY, CY, 4, 4), "cx");
    named(Camera::fov(FX, FY, CX, CY, 0.9, 4, 0), "width, height");
    let sphere = Camera::equirectangular(64, 32).unwrap();
    named(Camera::new(sphere.model().clone(), 64, 31), "width, height");
    named(unified(0.3).with_distortion_centre(0.0, 0.0), "dx, dy");
}
