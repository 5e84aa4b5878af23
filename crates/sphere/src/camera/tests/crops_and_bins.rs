//! Cameras of binned and cropped images.

use super::*;
use nalgebra::Vector2;

/// The same formula with scaled numbers: rounding only.
const RAY: f64 = 1e-12;

#[test]
fn binned_pixel_has_the_ray_of_the_middle_of_its_bin() {
    for (name, camera) in samples() {
        for factor in [2, 4, 5, 8] {
            let small = camera.binned(factor).unwrap();
            assert_eq!(
                (small.width(), small.height()),
                (WIDTH / factor, HEIGHT / factor)
            );
            let middle = |i: usize| (i * factor) as f64 + 0.5 * (factor as f64 - 1.0);
            for (col, row) in [(0, 0), (13, 37), (40, 30), (79, 59)] {
                let fine = camera.unproject(&Vector2::new(middle(col), middle(row)));
                let coarse = small.unproject(&Vector2::new(col as f64, row as f64));
                match (fine, coarse) {
                    (Some(a), Some(b)) => assert!((a - b).norm() < RAY, "{name} / {factor}"),
                    (a, b) => assert_eq!(a, b, "{name} / {factor}"),
                }
            }
        }
    }
}

#[test]
fn binned_twice_is_binned_once() {
    for (name, camera) in samples() {
        let (a, b) = (
            camera.binned(2).unwrap().binned(2).unwrap(),
            camera.binned(4).unwrap(),
        );
        let pixel = Vector2::new(70.3, 61.9);
        let difference = a.unproject(&pixel).unwrap() - b.unproject(&pixel).unwrap();
        assert!(difference.norm() < RAY, "{name}");
    }
}

#[test]
fn cropped_pixel_keeps_its_ray() {
    for (name, camera) in samples() {
        if camera.wraps_around() {
            let error = camera.cropped(0, 0, 10, 10).unwrap_err().to_string();
            assert!(error.contains("equirectangular"), "{error}");
            continue;
        }
        let part = camera.cropped(200, 130, 240, 200).unwrap();
        assert_eq!((part.width(), part.height()), (240, 200));
        let whole = camera.unproject(&Vector2::new(275.5, 201.25)).unwrap();
        let again = part.unproject(&Vector2::new(75.5, 71.25)).unwrap();
        assert!((whole - again).norm() < RAY, "{name}");
    }
}

#[test]
fn crop_that_leaves_the_image_is_an_error() {
    let camera = fov(0.9);
    for (x0, y0, width, height) in [
        (1, 0, 640, 1),
        (0, 480, 1, 1),
        (usize::MAX, 0, 2, 2),
        (0, 0, 0, 5),
    ] {
        assert!(
            camera.cropped(x0, y0, width, height).is_err(),
            "{x0} {y0} {width} {height}"
        );
    }
}
