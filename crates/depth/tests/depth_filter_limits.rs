//! What the depth filter cannot see, and what it is not to be given.

#![allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to

mod scene;

use scene::Sequence;
use sphereflow_core::{Plane, Pose, Stamp, Twist};
use sphereflow_depth::{
    DepthFilter, DepthFilterConfig, DepthReason, DepthStatus, DepthStep, VelocityNoise,
};
use sphereflow_sim::SimConfig;

/// Seventy times read bilinearly at a pixel's own place, metres.
const ROUNDING_M: f32 = 0.01;

fn small() -> (Sequence, DepthFilter) {
    let sequence = Sequence::room(160, 120, 0.0);
    let filter = DepthFilter::new(sequence.camera(), DepthFilterConfig::default()).unwrap();
    (sequence, filter)
}

fn step(filter: &mut DepthFilter, image: &Plane<f32>, pose: &Pose, index: i64) -> DepthStep {
    filter.step(image, pose, Stamp::from_ns(index)).unwrap()
}

#[test]
fn depth_filter_without_translation_keeps_its_state_and_says_why() {
    // Thesis: section 2.2: without linear motion depth is not observable.
    let (sequence, mut filter) = small();
    for index in 0..20 {
        let frame = sequence.frame(index);
        step(&mut filter, &frame.image, &frame.pose, index as i64);
    }
    // As long as a past image was seen from elsewhere, there is parallax; after 64 frames there is none.
    let frame = sequence.frame(19);
    let mut last = DepthStatus::Started;
    for index in 20..100 {
        last = step(&mut filter, &frame.image, &frame.pose, index).status;
    }
    let (before, uncertain) = filter.range();
    for index in 100..240 {
        let status = step(&mut filter, &frame.image, &frame.pose, index).status;
        assert_eq!(status, last);
    }
    assert!(
        matches!(
            last,
            DepthStatus::Unobservable(DepthReason::NoMotion { .. })
        ),
        "{last:?}"
    );
    let (after, more_uncertain) = filter.range();
    let pairs = before.data().iter().zip(after.data());
    let moved = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(moved < ROUNDING_M, "{moved}");
    let mean = |p: &Plane<f32>| p.data().iter().sum::<f32>() / p.data().len() as f32;
    assert!(mean(&more_uncertain) > 1.1 * mean(&uncertain));
}

#[test]
fn depth_filter_of_images_that_say_nothing_is_unusable_with_a_reason() {
    let (sequence, mut filter) = small();
    let frame = sequence.frame(0);
    assert_eq!(
        step(&mut filter, &frame.image, &frame.pose, 0).status,
        DepthStatus::Started
    );
    for (index, value) in [(1, 0.0_f32), (2, 256.0), (3, f32::NAN)] {
        let image = Plane::filled(160, 120, value);
        let status = step(
            &mut filter,
            &image,
            &sequence.frame(index).pose,
            index as i64,
        )
        .status;
        assert!(
            matches!(status, DepthStatus::Unusable(_)),
            "{value}: {status:?}"
        );
    }
    // No lag of the defaults reaches back over the gap.
    for (index, expected) in [(5, DepthStatus::Started), (6, DepthStatus::Updated)] {
        let frame = sequence.frame(index);
        let status = step(&mut filter, &frame.image, &frame.pose, index as i64).status;
        assert_eq!(status, expected);
    }
    assert!(
        filter
            .range()
            .0
            .data()
            .iter()
            .all(|d| d.is_finite() && *d > 0.0)
    );
}

#[test]
fn depth_filter_of_bad_input_names_it_and_is_as_before() {
    let (sequence, mut filter) = small();
    let frame = sequence.frame(0);
    step(&mut filter, &frame.image, &frame.pose, 7);
    let before = filter.range();
    let wrong = Plane::filled(161, 120, 1.0);
    let error = filter
        .step(&wrong, &frame.pose, Stamp::from_ns(8))
        .unwrap_err();
    assert!(error.to_string().contains("image"), "{error}");
    let mut broken = frame.pose;
    broken.translation.x = f64::NAN;
    let error = filter
        .step(&frame.image, &broken, Stamp::from_ns(8))
        .unwrap_err();
    assert!(error.to_string().contains("world_from_camera"), "{error}");
    let nan = Twist {
        linear_m_s: [f64::NAN; 3].into(),
        ..Twist::default()
    };
    let none = VelocityNoise::default();
    assert!(
        filter
            .step_with_velocity(&frame.image, &nan, 0.1, none)
            .is_err()
    );
    let bad = VelocityNoise {
        linear_m_s: -1.0,
        ..none
    };
    let error = filter
        .step_with_velocity(&frame.image, &Twist::default(), 0.1, bad)
        .unwrap_err();
    assert!(error.to_string().contains("noise.linear_m_s"), "{error}");
    let late = step(&mut filter, &frame.image, &frame.pose, 7).status;
    assert_eq!(late, DepthStatus::Skipped(DepthReason::StampNotIncreasing));
    assert_eq!(before, filter.range());
}

#[test]
fn depth_filter_settings_out_of_their_domain_are_refused_by_name() {
    let camera = SimConfig::thesis_camera(160, 120).unwrap();
    let default = DepthFilterConfig::default;
    for (config, name) in [
        (
            DepthFilterConfig {
                binning: 0,
                ..default()
            },
            "binning",
        ),
        (
            DepthFilterConfig {
                lags: vec![],
                ..default()
            },
            "lags",
        ),
        (
            DepthFilterConfig {
                lags: vec![4, 1],
                ..default()
            },
            "lags",
        ),
        (
            DepthFilterConfig {
                sigma_grey: Some(-1.0),
                ..default()
            },
            "sigma_grey",
        ),
        (
            DepthFilterConfig {
                initial_range_m: 0.0,
                ..default()
            },
            "initial_range_m",
        ),
        (
            DepthFilterConfig {
                memory: 2.0,
                ..default()
            },
            "memory",
        ),
    ] {
        let error = DepthFilter::new(&camera, config).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
}
