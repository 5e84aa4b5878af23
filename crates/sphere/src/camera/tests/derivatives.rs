//! The derivative of the pixel by the point, against differences.

use super::*;
use nalgebra::Matrix2x3;

/// Step of the central differences, of points at 2 m: truncation about step^2 times the third
/// derivative, rounding about 1e-16 * 1000 px / step = 1e-7; the tolerance is relative to the
/// derivative (100 to 1000 px/m) and leaves a factor 10.
const STEP: f64 = 2e-5;
const RELATIVE: f64 = 1e-7;

#[test]
fn jacobian_equals_central_differences() {
    for (name, camera) in samples() {
        let (mut seen, mut worst) = (0, 0.0_f64);
        for ray in directions(3_000) {
            let point = ray * 2.0;
            let Some((pixel, jacobian)) = camera.project_with_jacobian(&point) else {
                continue;
            };
            assert_eq!(Some(pixel), camera.project(&point), "{name}");
            // next to the border of a model, and where the image is stretched without bound, the
            // third derivative outgrows the step
            let wide = camera.project(&(ray + ray.cross(&Vector3::z()).cross(&ray) * -0.05));
            if wide.is_none() || jacobian.norm() > 1e3 {
                continue;
            }
            let Some(numeric) = differences(&camera, &point) else {
                continue;
            };
            seen += 1;
            worst = worst.max((numeric - jacobian).norm() / (100.0 + jacobian.norm()));
        }
        println!("{name}: {seen} points, worst {worst:.1e}");
        assert!(seen > 100, "{name}: {seen} points only");
        assert!(worst < RELATIVE, "{name}: {worst:e}");
    }
}

fn differences(camera: &Camera, point: &Vector3<f64>) -> Option<Matrix2x3<f64>> {
    let mut numeric = Matrix2x3::zeros();
    for axis in 0..3 {
        let mut step = Vector3::zeros();
        step[axis] = STEP;
        let (after, before) = (
            camera.project(&(point + step))?,
            camera.project(&(point - step))?,
        );
        if (after - before).norm() > 100.0 {
            return None; // across the seam of the whole sphere
        }
        numeric.set_column(axis, &((after - before) / (2.0 * STEP)));
    }
    Some(numeric)
}

#[test]
fn jacobian_on_the_axis_equals_central_differences() {
    for (name, camera) in samples() {
        let point = Vector3::new(0.0, 0.0, 2.0);
        let (_, jacobian) = camera.project_with_jacobian(&point).unwrap();
        let numeric = differences(&camera, &point).unwrap();
        let error = (numeric - jacobian).norm() / (100.0 + jacobian.norm());
        assert!(error < RELATIVE, "{name}: {error:e}");
    }
}

#[test]
fn jacobian_along_the_ray_vanishes() {
    // a central camera sees directions: moving a point along its ray does not move its pixel
    for (name, camera) in samples() {
        for ray in directions(500) {
            if let Some((_, jacobian)) = camera.project_with_jacobian(&ray) {
                let along = (jacobian * ray).norm();
                // rounding of products of the size of the derivative
                assert!(
                    along < 1e-12 * (1.0 + jacobian.norm()),
                    "{name}: {along:e} at {ray}"
                );
            }
        }
    }
}
