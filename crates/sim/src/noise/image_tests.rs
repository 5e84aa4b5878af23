//! Image and independent depth noise: their statistics, and that they follow the seed alone.

use super::*;
use sphereflow_core::{DepthMap, Plane, Stamp};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
/// Four standard errors of a standard deviation of 76 800 numbers.
const SIGMA_TOLERANCE: f64 = 0.01;

fn stamp(seconds: f64) -> Stamp {
    Stamp::default().plus_seconds(seconds)
}

fn grey_image(parameters: ImageNoiseParameters, seed: u64, at: Stamp, frame: u64) -> Plane<f32> {
    let mut image = Plane::filled(WIDTH, HEIGHT, 128.0);
    let noise = ImageNoise::new(parameters, seed).unwrap();
    noise.apply_grey(&mut image, at, frame);
    image
}

fn mean_and_sigma(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let variance = values.map(|v| (v - mean).powi(2)).sum::<f64>() / count;
    (mean, variance.sqrt())
}

#[test]
fn image_noise_has_the_stated_sigma_on_grey_and_colour() {
    let parameters = ImageNoiseParameters {
        sigma_grey: 5.0,
        ..ImageNoiseParameters::default()
    };
    let grey = grey_image(parameters, 1, stamp(0.0), 0);
    let (mean, sigma) = mean_and_sigma(grey.data().iter().map(|v| f64::from(*v)));
    assert!((sigma / 5.0 - 1.0).abs() < SIGMA_TOLERANCE, "{sigma}");
    assert!((mean - 128.0).abs() < 0.1, "{mean}");
    let mut colour = Plane::filled(WIDTH, HEIGHT, [128_u8, 100, 60]);
    ImageNoise::new(parameters, 1)
        .unwrap()
        .apply_rgb(&mut colour, stamp(0.0), 0);
    // Rounding to whole levels adds 1/12 to the variance.
    let expected = (25.0_f64 + 1.0 / 12.0).sqrt();
    for (channel, level) in [128.0, 100.0, 60.0].into_iter().enumerate() {
        let (mean, sigma) = mean_and_sigma(colour.data().iter().map(|p| f64::from(p[channel])));
        assert!((sigma / expected - 1.0).abs() < SIGMA_TOLERANCE, "{sigma}");
        assert!((mean - level).abs() < 0.1, "{mean}");
    }
}

#[test]
fn image_noise_by_default_changes_nothing_and_black_stays_at_zero_or_above() {
    let mut colour = Plane::from_fn(16, 9, |x, y| [x as u8, y as u8, 0]);
    let before = colour.clone();
    ImageNoise::default().apply_rgb(&mut colour, stamp(1.0), 3);
    assert_eq!(colour, before);
    let parameters = ImageNoiseParameters {
        sigma_grey: 30.0,
        ..ImageNoiseParameters::default()
    };
    let mut extremes = Plane::from_fn(64, 64, |x, _| if x < 32 { [0_u8; 3] } else { [255; 3] });
    ImageNoise::new(parameters, 0)
        .unwrap()
        .apply_rgb(&mut extremes, stamp(0.0), 0);
    let wrapped = (0..64).flat_map(|y| (0..64).map(move |x| (x, y)));
    let wrapped = wrapped.filter(|&(x, y)| (extremes[(x, y)][0] > 127) != (x >= 32));
    assert_eq!(wrapped.count(), 0, "noise wrapped around");
}

#[test]
fn image_flicker_follows_the_stamp_and_makes_bands_with_a_rolling_shutter() {
    let flicker = Flicker {
        amplitude: 0.1,
        frequency_hz: 100.0,
        phase_rad: 0.0,
    };
    let shutter = RollingShutter::new(0.03, HEIGHT).unwrap();
    let with = |rolling_shutter, at| {
        let parameters = ImageNoiseParameters {
            flicker: Some(flicker),
            rolling_shutter,
            ..ImageNoiseParameters::default()
        };
        grey_image(parameters, 0, at, 0)
    };
    // A quarter of a period after a Unix time of whole seconds: the crest.
    let crest = Stamp::from_ns(1_305_031_229_002_500_000);
    let global = with(None, crest);
    assert!(global.data().iter().all(|v| (v - 140.8).abs() < 1e-3));
    let banded = with(Some(shutter), crest);
    for y in [0, 40, 120, 239] {
        let expected = 128.0 * flicker.gain(shutter.row_stamp(crest, y));
        assert!(
            (f64::from(banded[(5, y)]) - expected).abs() < 1e-3,
            "row {y}"
        );
    }
    // 30 ms hold three periods: 80 rows each, so row 40 is half a period from row 80.
    assert!(
        banded[(0, 80)] < 116.0 || banded[(0, 40)] < 116.0,
        "no dark band"
    );
}

#[test]
fn image_vignetting_darkens_the_corners_by_the_stated_share() {
    let parameters = ImageNoiseParameters {
        vignetting: 0.25,
        ..ImageNoiseParameters::default()
    };
    let image = grey_image(parameters, 0, stamp(0.0), 0);
    for corner in [(0, 0), (WIDTH - 1, HEIGHT - 1), (0, HEIGHT - 1)] {
        assert!((image[corner] - 96.0).abs() < 1e-3, "{}", image[corner]);
    }
    assert!((image[(160, 120)] - 128.0).abs() < 0.01);
}

#[test]
fn image_noise_is_the_same_with_one_and_two_threads_and_differs_by_seed_and_frame() {
    let parameters = ImageNoiseParameters {
        sigma_grey: 2.0,
        blur_sigma_px: 0.8,
        vignetting: 0.2,
        ..ImageNoiseParameters::default()
    };
    let with_threads = |count| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .build()
            .unwrap();
        pool.install(|| grey_image(parameters, 4, stamp(0.0), 2))
    };
    let reference = with_threads(1);
    assert_eq!(reference, with_threads(2));
    assert_ne!(reference, grey_image(parameters, 5, stamp(0.0), 2));
    assert_ne!(reference, grey_image(parameters, 4, stamp(0.0), 3));
}

#[test]
fn image_noise_parameters_out_of_range_are_errors_that_name_them() {
    let flicker = |amplitude| Flicker {
        amplitude,
        frequency_hz: 50.0,
        phase_rad: 0.0,
    };
    let none = ImageNoiseParameters::default();
    let cases = [
        (
            "sigma_grey",
            ImageNoiseParameters {
                sigma_grey: -1.0,
                ..none
            },
        ),
        (
            "blur_sigma_px",
            ImageNoiseParameters {
                blur_sigma_px: f64::NAN,
                ..none
            },
        ),
        (
            "vignetting",
            ImageNoiseParameters {
                vignetting: 1.5,
                ..none
            },
        ),
        (
            "flicker.amplitude",
            ImageNoiseParameters {
                flicker: Some(flicker(-0.1)),
                ..none
            },
        ),
    ];
    for (name, parameters) in cases {
        let error = ImageNoise::new(parameters, 0).unwrap_err().to_string();
        assert!(error.contains(name), "{name}: {error}");
    }
}

#[test]
fn independent_noise_has_the_stated_sigma_of_inverse_depth_and_no_correlation() {
    let truth = DepthMap::new(Plane::filled(WIDTH, HEIGHT, 2.0));
    let read = IndependentNoise::new(1.5e-3, 0.0, 3)
        .unwrap()
        .apply(&truth, 0);
    let data = read.metres().data();
    let errors: Vec<f64> = data.iter().map(|z| 1.0 / f64::from(*z) - 0.5).collect();
    let (mean, sigma) = mean_and_sigma(errors.iter().copied());
    assert!((sigma / 1.5e-3 - 1.0).abs() < SIGMA_TOLERANCE, "{sigma}");
    assert!(
        mean.abs() < 4.0 * 1.5e-3 / (errors.len() as f64).sqrt(),
        "{mean}"
    );
    let products: f64 = errors.windows(2).map(|w| w[0] * w[1]).sum();
    let correlation = products / errors.len() as f64 / sigma.powi(2);
    assert!(correlation.abs() < 0.015, "{correlation}");
}

#[test]
fn independent_noise_is_the_same_with_one_and_two_threads_and_differs_by_seed() {
    let truth = DepthMap::new(Plane::filled(WIDTH, HEIGHT, 2.0));
    let read = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let noise = IndependentNoise::new(1.5e-3, 2.85e-3, seed).unwrap();
        pool.install(|| noise.apply(&truth, 1))
    };
    assert_eq!(read(1, 8), read(2, 8));
    assert_ne!(read(1, 8), read(1, 9));
    let error = IndependentNoise::new(-1.0, 0.0, 0).unwrap_err().to_string();
    assert!(error.contains("sigma_inv_m"), "{error}");
}
