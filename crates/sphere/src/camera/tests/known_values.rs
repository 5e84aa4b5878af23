//! Values of other programs and formulas written out a second time.

use super::*;
use nalgebra::Vector2;

/// Printed with 12 decimals.
const PRINTED: f64 = 1e-9;

const POINTS: [[f64; 3]; 4] = [
    [0.3, -0.2, 1.0],
    [-0.8, 0.5, 1.2],
    [0.0, 0.0, 2.0],
    [0.6, 0.7, 1.0],
];

fn assert_pixels(camera: &Camera, expected: [[f64; 2]; 4]) {
    for (point, pixel) in POINTS.into_iter().zip(expected) {
        let found = camera.project(&point.into()).unwrap();
        assert!(
            (found - Vector2::from(pixel)).norm() < PRINTED,
            "{point:?}: {found} {pixel:?}"
        );
    }
}

#[test]
fn opencv_equals_cv2_project_points() {
    // cv2.projectPoints of OpenCV 5.0.0
    let camera = opencv([
        0.0410, -0.3286, 0.0087, -0.0051, 0.5643, 0.021, -0.015, 0.03,
    ]);
    assert_pixels(
        &camera,
        [
            [475.382142192338, 136.926579758710],
            [-43.529191115452, 466.004012654804],
            [319.5, 239.5],
            [670.550267966103, 651.633387427497],
        ],
    );
}

#[test]
fn opencv_equals_its_documented_formula() {
    let [k1, k2, p1, p2, k3, k4, k5, k6] = OPENCV_RATIONAL;
    let (x, y) = (0.37, -0.52);
    let r2: f64 = x * x + y * y;
    let g = (1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3))
        / (1.0 + k4 * r2 + k5 * r2.powi(2) + k6 * r2.powi(3));
    let u = FX * (x * g + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + CX;
    let v = FY * (y * g + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + CY;
    let found = opencv(OPENCV_RATIONAL)
        .project(&Vector3::new(3.0 * x, 3.0 * y, 3.0))
        .unwrap();
    assert!((found - Vector2::new(u, v)).norm() < 1e-11); // rounding at 500 px
}

#[test]
fn kannala_brandt_equals_cv2_fisheye() {
    // cv2.fisheye.projectPoints of OpenCV 5.0.0
    let k = [0.05, -0.012, 0.004, -0.0011];
    assert_pixels(
        &Camera::kannala_brandt(FX, FY, CX, CY, k, WIDTH, HEIGHT).unwrap(),
        [
            [471.542502809487, 139.103680684529],
            [16.914118505326, 426.815069496703],
            [319.5, 239.5],
            [580.242920015206, 540.802929795349],
        ],
    );
}

#[test]
fn fov_equals_the_printed_formulas() {
    // Thesis: eq. (1.5). Thesis: eq. (1.6). Thesis: section 6.3 (the ray).
    let w: f64 = 0.93;
    let (x, y) = (0.4_f64, -0.3_f64);
    let r_u = x.hypot(y);
    let r_d = (2.0 * r_u * (w / 2.0).tan()).atan() / w;
    let z = Vector2::new(x, y) * (r_d / r_u);
    let pixel = Vector2::new(FX * z.x + CX, FY * z.y + CY);
    let camera = fov(w);
    let found = camera.project(&Vector3::new(x, y, 1.0)).unwrap();
    assert!((found - pixel).norm() < 1e-11);

    let r = z.norm();
    let t = (r * w).tan();
    let n = (t.powi(2) / (2.0 * (w / 2.0).tan()).powi(2) + 1.0).sqrt();
    let s = t / (2.0 * r * (w / 2.0).tan());
    let eta = Vector3::new(z.x * s, z.y * s, 1.0) / n;
    assert!((camera.unproject(&pixel).unwrap() - eta).norm() < 1e-14);
}

#[test]
fn inverse_polynomial_ray_equals_the_printed_formula() {
    // Thesis: eq. (1.5): undistorted = centre + (distorted - centre) (1 + k1 r_d^2 + ...)
    let camera = inverse_polynomial([0.2, -0.03, 0.01, 0.002])
        .with_distortion_centre(0.02, -0.01)
        .unwrap();
    let d = Vector2::new(0.3 - 0.02, 0.25 + 0.01);
    let s: f64 = d.norm_squared();
    let factor = 1.0 + 0.2 * s - 0.03 * s.powi(2) + 0.01 * s.powi(3) + 0.002 * s.powi(4);
    let x = Vector2::new(0.02, -0.01) + d * factor;
    let ray = camera
        .unproject(&Vector2::new(0.3 * FX + CX, 0.25 * FY + CY))
        .unwrap();
    assert!((ray - Vector3::new(x.x, x.y, 1.0).normalize()).norm() < 1e-14);
}

#[test]
fn unified_from_xi_equals_the_formula_of_mei_and_rives() {
    let (xi, point) = (1.3, Vector3::new(0.4_f64, -0.7, 0.2));
    let camera = Camera::unified_from_xi(FX, FY, CX, CY, xi, WIDTH, HEIGHT).unwrap();
    let m = Vector2::new(point.x, point.y) / (point.z + xi * point.norm());
    let pixel = Vector2::new(FX * m.x + CX, FY * m.y + CY);
    assert!((camera.project(&point).unwrap() - pixel).norm() < 1e-11);
}

#[test]
fn double_sphere_equals_its_published_formula() {
    let (xi, alpha, point) = (-0.2, 0.57, Vector3::new(0.4_f64, -0.7, -0.1));
    let d1 = point.norm();
    let d2 = (point.x.powi(2) + point.y.powi(2) + (xi * d1 + point.z).powi(2)).sqrt();
    let m = Vector2::new(point.x, point.y) / (alpha * d2 + (1.0 - alpha) * (xi * d1 + point.z));
    let pixel = Vector2::new(160.0 * m.x + CX, 161.0 * m.y + CY);
    assert!((double_sphere(xi, alpha).project(&point).unwrap() - pixel).norm() < 1e-11);
}

#[test]
fn pinhole_skew_equals_the_calibration_matrix() {
    // Thesis: eq. (1.3). Thesis: eq. (1.4)
    let camera = Camera::pinhole_with_skew(FX, FY, CX, CY, 7.5, WIDTH, HEIGHT).unwrap();
    let matrix = nalgebra::Matrix3::new(FX, 7.5, CX, 0.0, FY, CY, 0.0, 0.0, 1.0);
    let point = Vector3::new(0.3, -0.4, 2.5);
    let homogeneous = matrix * point;
    let pixel = camera.project(&point).unwrap();
    assert!((pixel - homogeneous.xy() / homogeneous.z).norm() < 1e-11);
}
