//! Optical flow of images with noise: the settings that follow it against fixed ones.

#![allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to

#[path = "../../depth/tests/scene/mod.rs"]
// the sequence of section 4.1.1, which dense depth is tested on
mod scene;

use nalgebra::Vector2;
use scene::{Frame, Sequence};
use sphereflow_core::Plane;
use sphereflow_flow::{FlowField, TvL1Config, tv_l1};

/// Where the points of the first frame are in the second, minus where they were.
fn truth(sequence: &Sequence, first: &Frame, second: &Frame) -> FlowField {
    let (camera, (width, height)) = (sequence.camera(), first.range.size());
    let second_from_first = second.pose.inverse() * first.pose;
    let move_of = |x: usize, y: usize| {
        let here = Vector2::new(x as f64, y as f64);
        let point = camera.unproject(&here)? * f64::from(first.range[(x, y)]);
        Some(camera.project(&second_from_first.transform(&point))? - here)
    };
    let plane = |axis: usize| {
        Plane::from_fn(width, height, |x, y| {
            move_of(x, y).map_or(f32::NAN, |moved| moved[axis] as f32)
        })
    };
    FlowField {
        u: plane(0),
        v: plane(1),
    }
}

/// The settings of images without noise, and those that were found best by hand with much.
fn fixed() -> [TvL1Config; 2] {
    [(0.25, 0.2, 0.5), (0.1, 0.3, 0.6)].map(|(lambda, split, presmooth_px)| TvL1Config {
        lambda: Some(lambda),
        split: Some(split),
        presmooth_px: Some(presmooth_px),
        ..TvL1Config::default()
    })
}

/// A simulated pair, and the error of settings on it: with a pyramid, and warm from a flow known before.
struct Pair {
    images: [Plane<f32>; 2],
    truth: FlowField,
    start: FlowField,
}

impl Pair {
    fn new(frames: [usize; 2], sigma: f64) -> Self {
        let sequence = Sequence::room(320, 240, sigma);
        let [first, second] = frames.map(|index| sequence.frame(index));
        let truth = truth(&sequence, &first, &second);
        let images = [first.image, second.image];
        let start = tv_l1(&images[0], &images[1], &TvL1Config::default(), None).unwrap();
        Self {
            images,
            truth,
            start,
        }
    }

    fn errors(&self, config: TvL1Config) -> [f64; 2] {
        let warm = TvL1Config {
            warps: TvL1Config::warm().warps,
            levels: TvL1Config::warm().levels,
            ..config
        };
        [(config, None), (warm, Some(&self.start))].map(|(config, start)| {
            let [first, second] = &self.images;
            let flow = tv_l1(first, second, &config, start).unwrap();
            flow.endpoint_error(&self.truth).unwrap()
        })
    }
}

/// How much worse than the better of the fixed settings those that follow the noise may be.
const MARGIN: f64 = 1.1;

#[test]
fn tv_l1_defaults_with_noise_are_as_good_as_the_better_of_two_fixed_settings() {
    // A pair of small and one of larger motion.
    for frames in [[20, 21], [100, 103]] {
        for sigma in [3.0, 10.0] {
            let pair = Pair::new(frames, sigma);
            let (own, others) = (
                pair.errors(TvL1Config::default()),
                fixed().map(|c| pair.errors(c)),
            );
            println!(
                "frames {frames:?}, noise {sigma}: cold and warm {own:.3?} px, fixed {others:.3?}"
            );
            for (k, own) in own.into_iter().enumerate() {
                let best = others[0][k].min(others[1][k]);
                assert!(own <= MARGIN * best, "{own} {others:?}");
            }
        }
    }
}

#[test]
fn tv_l1_defaults_without_noise_are_exactly_the_settings_for_that() {
    // Images rounded to whole grey levels count as without noise.
    for frames in [[20, 21], [100, 103]] {
        let pair = Pair::new(frames, 0.0);
        let (own, others) = (
            pair.errors(TvL1Config::default()),
            fixed().map(|c| pair.errors(c)),
        );
        println!("frames {frames:?}, noise 0: cold and warm {own:.3?} px, fixed {others:.3?}");
        assert_eq!(own, others[0]);
    }
}
