//! Pixel to ray to pixel, and ray to pixel to ray.

use super::*;
use nalgebra::Vector2;
use proptest::prelude::*;

/// Round trips are closed or iterated to the last bit; what remains is rounding, about f * 1e-13.
const PIXEL: f64 = 1e-9;
/// Unit vectors are normalised in the last step.
const NORM: f64 = 1e-15;
/// At the border of a model the pixel does not move with the ray to first order, so that half of
/// the digits of the angle are lost there: the square root of 1e-14, and a factor.
const ANGLE: f64 = 1e-6;

/// The pixel of the ray of `pixel`, in pixels from it; `None` where the model has no ray.
fn pixel_error(camera: &Camera, pixel: &Vector2<f64>) -> Option<f64> {
    let ray = camera.unproject(pixel)?;
    assert!((ray.norm() - 1.0).abs() < NORM * 4.0, "{pixel} {ray}");
    match camera.project(&ray) {
        Some(again) => Some((again - pixel).norm()),
        None => panic!("the ray {ray} of {pixel} is not seen by {camera:?}"),
    }
}

#[test]
fn pixel_to_ray_to_pixel_returns_on_a_dense_grid() {
    for (name, camera) in samples() {
        let (mut seen, mut worst) = (0, 0.0_f64);
        for row in -100..(HEIGHT as i32 + 100) {
            for col in (-130..(WIDTH as i32 + 130)).step_by(2) {
                let pixel = Vector2::new(f64::from(col) + 0.25, f64::from(row) - 0.125);
                if camera.wraps_around() && !camera.contains(&pixel) {
                    continue; // the same rays again
                }
                if let Some(error) = pixel_error(&camera, &pixel) {
                    seen += 1;
                    worst = worst.max(error);
                }
            }
        }
        println!("{name}: {seen} pixels, worst {worst:.1e} px");
        assert!(
            seen > 50_000,
            "{name} has a ray at {seen} of 306000 pixels only"
        );
        assert!(worst < PIXEL, "{name}: {worst:e} px");
    }
}

#[test]
fn ray_to_pixel_to_ray_returns_and_never_from_a_folded_pixel() {
    for (name, camera) in samples() {
        let mut seen = 0;
        for ray in directions(100_000) {
            let Some(pixel) = camera.project(&ray) else {
                continue;
            };
            let far = (pixel - Vector2::new(CX, CY)).norm() > 1e5;
            if far {
                continue; // next to 90 degrees from a pinhole's axis
            }
            seen += 1;
            let again = camera.unproject(&pixel);
            let again = again.unwrap_or_else(|| panic!("{name}: no ray at {pixel} of {ray}"));
            assert!((again - ray).norm() < ANGLE, "{name}: {ray} became {again}");
        }
        assert!(seen > 4_000, "{name} sees {seen} of 100000 directions only");
    }
}

#[test]
fn fov_round_trip_holds_up_to_the_model_limit() {
    // Thesis: eq. (1.6): r_d < pi / (2 w) has a ray in front of the camera.
    let (camera, w) = (fov(1.2), 1.2);
    let limit = std::f64::consts::FRAC_PI_2 / w;
    for part in [0.5, 0.99, 0.999_999, 1.0 - 1e-12, 1.0 - 1e-15] {
        let pixel = Vector2::new(CX + FX * limit * part * 0.6, CY + FY * limit * part * 0.8);
        let error = pixel_error(&camera, &pixel).unwrap();
        assert!(error < PIXEL, "{part}: {error:e} px");
    }
    let beyond = Vector2::new(CX + FX * limit * (1.0 + 1e-9), CY);
    assert_eq!(camera.unproject(&beyond), None);
}

/// Any model with any parameters in its domain.
fn any_camera() -> impl Strategy<Value = Camera> {
    let k = |size: f64| proptest::array::uniform4(-size..size);
    prop_oneof![
        (k(0.5), k(0.3), k(0.1))
            .prop_map(|(n, d, p)| { opencv([n[0], n[1], p[0], p[1], n[2], d[0], d[1], d[2]]) }),
        (k(0.5), -0.1..0.1, -0.1..0.1).prop_map(|(k, dx, dy)| {
            inverse_polynomial(k)
                .with_distortion_centre(dx, dy)
                .unwrap()
        }),
        (0.01..3.0, -0.1..0.1, -0.1..0.1)
            .prop_map(|(w, dx, dy)| fov(w).with_distortion_centre(dx, dy).unwrap()),
        k(0.2).prop_map(kannala_brandt),
        (0.0..=1.0).prop_map(unified),
        (-0.9..0.9, 0.0..=1.0).prop_map(|(xi, alpha)| double_sphere(xi, alpha)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_camera_any_pixel_returns(
        camera in any_camera(), u in -100.0..740.0, v in -100.0..580.0,
    ) {
        if let Some(error) = pixel_error(&camera, &Vector2::new(u, v)) {
            prop_assert!(error < PIXEL, "{error:e} px");
        }
    }

    #[test]
    fn any_camera_any_direction_is_unseen_or_returns(
        camera in any_camera(), longitude in -3.1..3.1, axis in 0.0..3.1, range in 0.1..50.0,
    ) {
        let (longitude, axis): (f64, f64) = (longitude, axis);
        let flat = axis.sin();
        let ray = Vector3::new(flat * longitude.cos(), flat * longitude.sin(), axis.cos());
        let pixel = camera.project(&(ray * range));
        if let Some(pixel) = pixel.filter(|p| p.norm() < 1e5) {
            let again = camera.unproject(&pixel);
            prop_assert!(again.is_some(), "no ray at {pixel}");
            prop_assert!((again.unwrap() - ray).norm() < ANGLE, "{ray} became {again:?}");
        }
    }
}
