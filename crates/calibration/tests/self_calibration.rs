//! Self-calibration on simulated recordings, whose errors are known.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

use nalgebra::Vector2;
use sphereflow_calibration::{
    CalibrationStatus, SelfCalibration, SelfCalibrationConfig, SelfCalibrator,
};
use sphereflow_core::{DepthMap, Plane, RangeMap, Stamp};
use sphereflow_sim::noise::{InverseDepthDistortion, KinectParameters};
use sphereflow_sim::{DepthNoiseParameters, Motion, Scene, SimConfig, Simulator};
use sphereflow_sphere::{Camera, DepthCorrection, DepthCorrector};

const SIZE: (usize, usize) = (320, 240);

fn camera(k1: f64) -> Camera {
    let lens = [k1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    Camera::opencv(262.5, 262.5, 159.5, 119.5, lens, SIZE.0, SIZE.1).unwrap()
}

/// Three seconds in the hand in a furnished room.
fn simulation(camera: Camera) -> SimConfig {
    SimConfig {
        duration_s: 3.0,
        ..SimConfig::perfect(Scene::furnished_room(3), camera, Motion::hand_held(5))
    }
}

/// The frames of a simulation as the calibrator of `known` takes them, changed by `measure`.
fn calibrate(
    simulation: SimConfig,
    known: &Camera,
    config: SelfCalibrationConfig,
    measure: impl Fn(DepthMap) -> DepthMap,
) -> SelfCalibration {
    let simulator = Simulator::new(simulation).unwrap();
    let mut calibrator = SelfCalibrator::new(known, config).unwrap();
    for simulated in simulator.frames() {
        let frame = simulated.unwrap().frame;
        calibrator
            .push(&measure(frame.depth.unwrap()), frame.stamp)
            .unwrap();
    }
    let mut told = Vec::new();
    let found = calibrator
        .solve(|done, total| told.push((done, total)))
        .unwrap();
    assert!(told.windows(2).all(|w| w[0].0 <= w[1].0) && told.iter().all(|t| t.0 <= t.1));
    println!(
        "{}: {} pairs, residual {:.2e} to {:.2e} 1/m, inflation {:.1}",
        found.status, found.pairs, found.residual_before, found.residual_after, found.inflation
    );
    for p in &found.parameters {
        println!(
            "  {:<16} {:>9.5} +- {:.5} of {:.5}",
            p.name, p.value, p.std, p.prior_std
        );
    }
    found
}

/// Enough pairs for a test.
fn few_pairs() -> SelfCalibrationConfig {
    SelfCalibrationConfig {
        max_pairs: 120,
        iterations: 8,
        ..SelfCalibrationConfig::default()
    }
}

fn field_only() -> SelfCalibrationConfig {
    SelfCalibrationConfig {
        lens: false,
        readout: false,
        ..few_pairs()
    }
}

/// Rms over the image of what is wrong with 1/Z at `distance_m`, 1/m, besides a common factor, which
/// no motion shows: `wrong` distorts true depth, `correction` is what was found.
fn field_error(wrong: &dyn Fn(f64, f64, f64) -> f64, correction: &DepthCorrection) -> f64 {
    let mut errors = Vec::new();
    for distance_m in [2.0, 3.5] {
        for (x, y) in (0..SIZE.0 * SIZE.1)
            .step_by(97)
            .map(|i| (i % SIZE.0, i / SIZE.0))
        {
            let ray = camera(0.0)
                .unproject(&Vector2::new(x as f64, y as f64))
                .unwrap();
            let (z1, z2) = (ray.x / ray.z, ray.y / ray.z);
            let (factor, offset) = correction.factor_and_offset(z1, z2);
            let corrected = factor * wrong(1.0 / distance_m, z1, z2) + offset;
            errors.push(corrected * distance_m);
        }
    }
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    (errors.iter().map(|e| (e / mean - 1.0).powi(2)).sum::<f64>() / n).sqrt()
}

#[test]
fn field_of_exact_depth_is_recovered() {
    // 1/Z_measured = 1/Z - a: a tilt and an offset as Kinects have them.
    let a =
        DepthCorrection::from_named(&[], &[("z1", 0.02), ("r4", 0.04), ("one", 0.004)]).unwrap();
    let opposite = DepthCorrection::new([0.0; 9], a.additive().map(|c| -c)).unwrap();
    let distort = DepthCorrector::new(&camera(0.0), &opposite).unwrap();
    let found = calibrate(
        simulation(camera(0.0)),
        &camera(0.0),
        field_only(),
        |depth| distort.apply(depth).unwrap(),
    );
    assert_eq!(found.status, CalibrationStatus::Calibrated);
    let wrong = |inverse: f64, z1: f64, z2: f64| inverse - a.factor_and_offset(z1, z2).1;
    let before = field_error(&wrong, &DepthCorrection::default());
    let after = field_error(&wrong, &found.correction);
    println!("field wrong by {before:.2e}, then {after:.2e}");
    // What is left is in combinations that three seconds hardly show.
    assert!(before > 9e-3 && after < 0.25 * before, "{before} {after}");
    assert!(found.residual_after < 0.7 * found.residual_before);
}

#[test]
fn field_of_a_noisy_kinect_is_recovered_in_part_and_its_errors_are_within_the_covariance() {
    let distortion = InverseDepthDistortion::default();
    let simulation = SimConfig {
        depth_noise: DepthNoiseParameters::Kinect(KinectParameters {
            distortion: Some(distortion),
            ..KinectParameters::default()
        }),
        duration_s: 8.0,
        ..simulation(camera(0.0))
    };
    let config = SelfCalibrationConfig {
        max_pairs: 240,
        iterations: 4,
        ..field_only()
    };
    let found = calibrate(simulation, &camera(0.0), config, |depth| depth);
    assert_eq!(found.status, CalibrationStatus::Calibrated);
    let wrong = |inverse: f64, z1: f64, z2: f64| {
        let r2 = z1 * z1 + z2 * z2;
        inverse * (1.0 + distortion.tilt * z1 + distortion.quartic * r2 * r2)
    };
    let before = field_error(&wrong, &DepthCorrection::default());
    let after = field_error(&wrong, &found.correction);
    println!("field wrong by {before:.2e}, then {after:.2e}");
    assert!(after < 0.6 * before, "{before} {after}");
    let tilt = found
        .parameters
        .iter()
        .find(|p| p.name == "relative.z1")
        .unwrap();
    // 1/Z = 1/Z_measured / (1 + tilt z1): the relative term takes the tilt back.
    assert!(
        (tilt.value + distortion.tilt).abs() < 4.0 * tilt.std,
        "{tilt:?}"
    );
}

#[test]
fn lens_is_recovered() {
    let config = SelfCalibrationConfig {
        field: false,
        readout: false,
        ..few_pairs()
    };
    let found = calibrate(simulation(camera(-0.1)), &camera(0.0), config, |depth| {
        depth
    });
    assert_eq!(found.status, CalibrationStatus::Calibrated);
    // Where the ray of a pixel at the border points, in the image plane: k1 is worth 0.026 there.
    for (x, y) in [(10.0, 10.0), (310.0, 120.0), (160.0, 230.0)] {
        let at = |camera: &Camera| {
            let ray = camera.unproject(&Vector2::new(x, y)).unwrap();
            Vector2::new(ray.x / ray.z, ray.y / ray.z)
        };
        let (truth, before) = (at(&camera(-0.1)), at(&camera(0.0)));
        let after = (at(&found.camera) - truth).norm();
        // Half of what is left is focal length, of which three seconds show little.
        assert!(after < 0.5 * (before - truth).norm(), "{after}");
    }
    let k1 = found.parameters.iter().find(|p| p.name == "k1").unwrap();
    assert!((k1.value + 0.1).abs() < 0.01, "{k1:?}");
}

#[test]
fn readout_is_recovered_within_two_milliseconds() {
    for readout_s in [0.03, -0.015] {
        let simulation = SimConfig {
            readout_s,
            ..simulation(camera(0.0))
        };
        let config = SelfCalibrationConfig {
            max_pairs: 60,
            ..SelfCalibrationConfig::readout_only()
        };
        let found = calibrate(simulation, &camera(0.0), config, |depth| depth);
        assert_eq!(found.status, CalibrationStatus::Calibrated);
        assert!(
            (found.readout_s - readout_s).abs() < 2e-3,
            "{}",
            found.readout_s
        );
        assert!(found.rms_rate_rad_s > 0.2 && found.parameters[0].observable);
        assert!(found.correction.is_identity() && found.camera == camera(0.0));
    }
}

#[test]
fn standing_camera_calibrates_nothing() {
    let simulation = SimConfig {
        motion: Motion::still(),
        depth_noise: DepthNoiseParameters::Kinect(KinectParameters::default()),
        duration_s: 1.0,
        ..simulation(camera(0.0))
    };
    for config in [
        SelfCalibrationConfig::default(),
        SelfCalibrationConfig::readout_only(),
    ] {
        let config = SelfCalibrationConfig {
            readout_s: 0.01,
            ..config
        };
        let found = calibrate(simulation.clone(), &camera(0.0), config, |depth| depth);
        assert!(
            matches!(&found.status, CalibrationStatus::NotObservable(why) if why.contains("moved"))
        );
        assert_eq!((found.camera, found.readout_s), (camera(0.0), 0.01));
        assert!(found.correction.is_identity());
        assert!(
            found
                .parameters
                .iter()
                .all(|p| !p.observable && p.std == p.prior_std)
        );
    }
}

#[test]
fn what_cannot_be_calibrated_is_an_error() {
    let config = SelfCalibrationConfig::default();
    let all_around = Camera::equirectangular(64, 32).unwrap();
    let error = SelfCalibrator::new(&all_around, config)
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("camera"), "{error}");
    let nothing = SelfCalibrationConfig {
        lens: false,
        field: false,
        readout: false,
        ..config
    };
    let error = SelfCalibrator::new(&camera(0.0), nothing)
        .unwrap_err()
        .to_string();
    assert!(error.contains("readout"), "{error}");
    let mut calibrator = SelfCalibrator::new(&camera(0.0), config).unwrap();
    let small = DepthMap::new(Plane::filled(8, 8, 1.0));
    assert!(calibrator.push(&small, Stamp::from_ns(0)).is_err());
    let range = RangeMap::new(Plane::filled(SIZE.0, SIZE.1, 1.0));
    let error = calibrator
        .push(&range, Stamp::from_ns(0))
        .unwrap_err()
        .to_string();
    assert!(error.contains("range along the ray"), "{error}");
    assert!(calibrator.is_empty());
}
