//! The random part of the Kinect noise against the statistics measured on real recordings.

use super::*;
use sphereflow_core::{DepthMap, Plane};
use sphereflow_sphere::camera::Camera;

pub(super) const WIDTH: usize = 640;
pub(super) const HEIGHT: usize = 480;
pub(super) const FOCAL_PX: f64 = 525.0;
/// Measured on real recordings, at the distances of [`LAGS_PX`].
const MEASURED_CORRELATION: [f64; 5] = [0.77, 0.6, 0.4, 0.22, 0.1];
const LAGS_PX: [usize; 5] = [1, 2, 4, 8, 16];
/// The measured correlations come from two recordings that differ by this much.
const CORRELATION_TOLERANCE: f64 = 0.07;
/// Three standard errors of a standard deviation over four frames, of which about one pixel in
/// sixty is independent.
const SIGMA_TOLERANCE: f64 = 0.04;

pub(super) fn camera() -> Camera {
    Camera::pinhole(FOCAL_PX, FOCAL_PX, 319.5, 239.5, WIDTH, HEIGHT).unwrap()
}

/// A slanted plane whose 1/Z runs from `from` at the left border to `to` at the right.
pub(super) fn plane(from: f64, to: f64) -> DepthMap {
    DepthMap::new(Plane::from_fn(WIDTH, HEIGHT, |x, y| {
        let along = (x as f64 + 0.3 * y as f64) / (WIDTH as f64 + 0.3 * HEIGHT as f64);
        (1.0 / (from + (to - from) * along)) as f32
    }))
}

/// Noise alone: no holes, shadow, distortion.
pub(super) fn bare() -> KinectParameters {
    KinectParameters {
        hole_share: 0.0,
        projector_right_m: 0.0,
        distortion: None,
        ..KinectParameters::default()
    }
}

pub(super) fn noisy(parameters: KinectParameters, truth: &DepthMap, frame: u64) -> DepthMap {
    let noise = KinectNoise::new(parameters, 7).unwrap();
    noise.apply(truth, &camera(), frame).unwrap()
}

/// Error of 1/Z of every pixel, NaN where unknown.
pub(super) fn inverse_errors(read: &DepthMap, truth: &DepthMap) -> Vec<f64> {
    let pairs = read.metres().data().iter().zip(truth.metres().data());
    pairs
        .map(|(r, t)| 1.0 / f64::from(*r) - 1.0 / f64::from(*t))
        .collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn kinect_noise_of_inverse_depth_has_the_stated_sigma_flat_in_range() {
    for (from, to) in [(0.2, 0.3), (0.5, 0.8), (1.5, 2.2)] {
        let truth = plane(from, to);
        let errors: Vec<f64> = (0..4)
            .flat_map(|frame| inverse_errors(&noisy(bare(), &truth, frame), &truth))
            .collect();
        let (sigma, mean) = (
            rms(&errors),
            errors.iter().sum::<f64>() / errors.len() as f64,
        );
        println!("1/Z {from}-{to}: sigma {sigma:.3e}, mean {mean:.1e}");
        assert!(
            (sigma / 1.8e-3 - 1.0).abs() < SIGMA_TOLERANCE,
            "1/Z from {from} to {to}: sigma {sigma}"
        );
        assert!(mean.abs() < SIGMA_TOLERANCE * 1.8e-3, "mean {mean}");
    }
}

#[test]
fn kinect_noise_autocorrelation_is_the_measured_one_along_rows_and_columns() {
    // The steeper the surface, the whiter its rounding error: 40 degrees from frontal, where a pixel
    // crosses a third of a step, give 0.70 across at 1 pixel instead of 0.76. The recordings pool
    // surfaces of all slants, and so does this test.
    let (mut across, mut down, mut variance) = ([0.0; 5], [0.0; 5], 0.0);
    for (frame, to) in [0.55, 0.6, 0.7, 0.9, 1.2].into_iter().enumerate() {
        let truth = plane(0.4, to);
        let errors = inverse_errors(&noisy(bare(), &truth, frame as u64), &truth);
        for i in (0..HEIGHT - 16).flat_map(|y| (0..WIDTH - 16).map(move |x| y * WIDTH + x)) {
            variance += errors[i] * errors[i];
            for (k, d) in LAGS_PX.into_iter().enumerate() {
                across[k] += errors[i] * errors[i + d];
                down[k] += errors[i] * errors[i + d * WIDTH];
            }
        }
    }
    for k in 0..LAGS_PX.len() {
        let (a, d, lag) = (across[k] / variance, down[k] / variance, LAGS_PX[k]);
        println!("{lag} px: {a:.3} across, {d:.3} down");
        let expected = MEASURED_CORRELATION[k];
        assert!(
            (a - expected).abs() < CORRELATION_TOLERANCE
                && (d - expected).abs() < CORRELATION_TOLERANCE,
            "{lag} px: {a} across, {d} down, measured {expected}"
        );
    }
}

#[test]
fn kinect_noise_of_block_means_falls_slowly_as_measured() {
    // Standard deviation of block means by block size in pixels, 1e-3 1/m: the range of the two
    // recordings, widened by 15 % because theirs are robust estimates that include real surfaces.
    let measured = [
        (2, 1.60, 1.69),
        (4, 1.38, 1.48),
        (8, 1.11, 1.20),
        (16, 0.85, 0.91),
    ];
    let truth = plane(0.4, 1.2);
    let errors = inverse_errors(&noisy(bare(), &truth, 0), &truth);
    for (size, low, high) in measured {
        let mut means = Vec::new();
        for y in (0..HEIGHT - size + 1).step_by(size) {
            for x in (0..WIDTH - size + 1).step_by(size) {
                let block = (0..size * size).map(|i| errors[(y + i / size) * WIDTH + x + i % size]);
                means.push(block.sum::<f64>() / (size * size) as f64);
            }
        }
        let sigma = rms(&means) * 1e3;
        println!("blocks of {size} px: {sigma:.2}e-3");
        assert!(
            sigma > low * 0.85 && sigma < high * 1.15,
            "blocks of {size} px: {sigma}e-3, measured {low} to {high}"
        );
    }
}

#[test]
fn kinect_inverse_depths_are_multiples_of_the_quantum_and_free_without_it() {
    let truth = plane(0.4, 1.2);
    // Rounding of two f32 reciprocals of numbers near 400 quanta.
    let tolerance = 400.0 * 3e-7;
    let off_grid = |map: &DepthMap| {
        let data = map.metres().data().iter();
        data.map(|z| 1.0 / (f64::from(*z) * 2.85e-3))
            .filter(|steps| (steps - steps.round()).abs() > tolerance)
            .count()
    };
    assert_eq!(off_grid(&noisy(bare(), &truth, 0)), 0);
    let free = KinectParameters {
        quantum_inv_m: 0.0,
        ..bare()
    };
    assert!(off_grid(&noisy(free, &truth, 0)) > WIDTH * HEIGHT * 9 / 10);
    let silent = KinectParameters {
        sigma_inv_m: 0.0,
        ..bare()
    };
    let errors = inverse_errors(&noisy(silent, &truth, 0), &truth);
    let largest = errors.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    assert!(largest <= 2.85e-3 / 2.0 + 1e-6, "rounding error {largest}");
}
