//! Tests of every camera model: there and back, derivatives, limits, names, published formulas.

mod crops_and_bins;
mod derivatives;
mod known_values;
mod limits;
mod names;
mod round_trip;

use super::Camera;
use nalgebra::Vector3;

const FX: f64 = 525.0;
const FY: f64 = 520.0;
const CX: f64 = 319.5;
const CY: f64 = 239.5;
const WIDTH: usize = 640;
const HEIGHT: usize = 480;

fn opencv(distortion: [f64; 8]) -> Camera {
    Camera::opencv(FX, FY, CX, CY, distortion, WIDTH, HEIGHT).unwrap()
}

fn inverse_polynomial(k: [f64; 4]) -> Camera {
    Camera::inverse_polynomial(FX, FY, CX, CY, k, WIDTH, HEIGHT).unwrap()
}

fn fov(w: f64) -> Camera {
    Camera::fov(FX, FY, CX, CY, w, WIDTH, HEIGHT).unwrap()
}

fn kannala_brandt(k: [f64; 4]) -> Camera {
    Camera::kannala_brandt(190.0, 191.0, CX, CY, k, WIDTH, HEIGHT).unwrap()
}

fn unified(alpha: f64) -> Camera {
    Camera::unified(250.0, 251.0, CX, CY, alpha, WIDTH, HEIGHT).unwrap()
}

fn double_sphere(xi: f64, alpha: f64) -> Camera {
    Camera::double_sphere(160.0, 161.0, CX, CY, [xi, alpha], WIDTH, HEIGHT).unwrap()
}

/// A structured-light camera's OpenCV calibration: five terms, of mixed signs.
const OPENCV_MILD: [f64; 8] = [0.041, -0.3286, 0.0087, -0.0051, 0.5643, 0.0, 0.0, 0.0];
/// A wide lens that folds back at 45 degrees from the axis.
const OPENCV_BARREL: [f64; 8] = [-0.45, 0.12, 0.001, -0.002, -0.03, 0.0, 0.0, 0.0];
/// All eight terms, as of a time-of-flight camera.
const OPENCV_RATIONAL: [f64; 8] = [0.45, 0.21, 3e-5, -4e-5, 0.011, 0.79, 0.33, 0.058];
/// Kannala-Brandt of a 190-degree lens.
const KB_WIDE: [f64; 4] = [0.0034, 0.0007, -0.0020, 0.0002];

/// Every model with realistic and with strong parameters.
fn samples() -> Vec<(&'static str, Camera)> {
    let decentred = |camera: Camera| camera.with_distortion_centre(0.013, -0.021).unwrap();
    vec![
        (
            "pinhole",
            Camera::pinhole(FX, FY, CX, CY, WIDTH, HEIGHT).unwrap(),
        ),
        (
            "skewed",
            Camera::pinhole_with_skew(FX, FY, CX, CY, 7.5, WIDTH, HEIGHT).unwrap(),
        ),
        ("opencv without distortion", opencv([0.0; 8])),
        ("opencv mild", opencv(OPENCV_MILD)),
        ("opencv barrel", opencv(OPENCV_BARREL)),
        ("opencv rational", opencv(OPENCV_RATIONAL)),
        (
            "opencv pincushion",
            opencv([0.3, 0.1, 0.01, 0.02, 0.0, 0.0, 0.0, 0.0]),
        ),
        (
            "inverse polynomial barrel",
            inverse_polynomial([0.25, 0.1, 0.0, 0.0]),
        ),
        (
            "inverse polynomial pincushion",
            decentred(inverse_polynomial([-0.2, 0.02, -0.001, 0.0])),
        ),
        (
            "inverse polynomial strong",
            decentred(inverse_polynomial([0.8, 0.5, 0.3, 0.1])),
        ),
        ("fov mild", fov(0.5)),
        ("fov strong", decentred(fov(1.6))),
        ("fov nearly pinhole", fov(1e-5)),
        ("kannala-brandt equidistant", kannala_brandt([0.0; 4])),
        ("kannala-brandt wide", kannala_brandt(KB_WIDE)),
        (
            "kannala-brandt folding",
            kannala_brandt([-0.08, 0.01, -0.004, 0.0]),
        ),
        ("unified pinhole", unified(0.0)),
        ("unified weak", unified(0.3)),
        ("unified paracatadioptric", unified(0.5)),
        ("unified strong", unified(0.8)),
        ("unified orthographic", unified(1.0)),
        (
            "unified from xi",
            Camera::unified_from_xi(FX, FY, CX, CY, 1.3, WIDTH, HEIGHT).unwrap(),
        ),
        ("double sphere", double_sphere(-0.2, 0.57)),
        ("double sphere wide", double_sphere(0.4, 0.65)),
        ("double sphere weak", double_sphere(-0.3, 0.4)),
        (
            "equirectangular",
            Camera::equirectangular(WIDTH, HEIGHT).unwrap(),
        ),
    ]
}

/// Directions all over the sphere: a Fibonacci lattice.
fn directions(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
        let (flat, longitude) = ((1.0 - z * z).sqrt(), golden * i as f64);
        Vector3::new(flat * longitude.cos(), flat * longitude.sin(), z)
    })
}
