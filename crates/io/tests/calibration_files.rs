//! CalibrationFile files: round trip of every field, and errors that name the field.
#![allow(clippy::unwrap_used, clippy::expect_used)] // tests stop where a file is not as it should be

use nalgebra::Vector3;
use proptest::prelude::*;
use sphereflow_core::Pose;
use sphereflow_io::{CalibrationFile, ImuNoise};
use sphereflow_sphere::{Calibration, Camera, DepthCorrection};
use std::path::Path;

const TEXT: &str = "model = \"pinhole\"\nwidth = 640\nheight = 480\ndepth_scale = 5000.0\n\
    [parameters]\nfx = 525.0\nfy = 525.0\ncx = 319.5\ncy = 239.5\n";

fn error_of(text: &str) -> String {
    let error = CalibrationFile::from_toml(text, Path::new("calibration.toml")).unwrap_err();
    error.to_string()
}

#[test]
fn calibration_written_then_read_is_the_same() {
    let camera = Camera::from_named(
        "opencv",
        &[
            ("fx", 517.3),
            ("fy", 516.5),
            ("cx", 318.6),
            ("cy", 255.3),
            ("k1", 0.26),
            ("k2", -0.95),
            ("p1", -0.005),
            ("p2", 0.0026),
            ("k3", 1.16),
        ],
        640,
        480,
    )
    .unwrap();
    let mut calibration = CalibrationFile::of_camera(&camera, 5000.0).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("calibration.toml");
    calibration.write(&path).unwrap();
    assert_eq!(CalibrationFile::read(&path).unwrap(), calibration);

    calibration.readout_s = Some(0.02);
    calibration.imu_offset_s = Some(-0.1 / 3.0);
    calibration.gravity_in_world_m_s2 = Some(Vector3::new(0.0, 9.81, 1e-3));
    let pose = Pose::from_parts([0.1, 0.2, 1.0 / 3.0], [0.1, 0.2, 0.3, 0.927]).unwrap();
    calibration.camera_from_imu = Some(pose);
    calibration.imu_noise = Some(ImuNoise {
        gyroscope_noise_density: 1.7e-4,
        gyroscope_random_walk: 2e-5,
        accelerometer_noise_density: 2e-3,
        accelerometer_random_walk: 3e-3,
    });
    calibration.write(&path).unwrap();
    let back = CalibrationFile::read(&path).unwrap();
    assert_eq!(back, calibration);
    assert_eq!(back.camera().unwrap(), camera);
}

#[test]
fn every_camera_model_survives_its_calibration() {
    let equirectangular = Camera::equirectangular(360, 180).unwrap();
    let calibration = CalibrationFile::of_camera(&equirectangular, 1000.0).unwrap();
    let text = calibration.to_toml(Path::new("a")).unwrap();
    let back = CalibrationFile::from_toml(&text, Path::new("a")).unwrap();
    assert_eq!(back.camera().unwrap(), equirectangular);
}

#[test]
fn errors_name_the_field() {
    CalibrationFile::from_toml(TEXT, Path::new("calibration.toml")).unwrap();
    for (from, to, parts) in [
        (
            "fx = 525.0",
            "fx = nan",
            &["parameters.fx", "finite", "NaN"][..],
        ),
        ("fx = 525.0", "fx = -525.0", &["fx", "positive", "-525"]),
        ("fx = 525.0\n", "", &["fx"]),
        ("cy = 239.5", "cy = 239.5\nk1 = 0.1", &["k1"]),
        ("pinhole", "pin-hole", &["model", "pin-hole"]),
        ("5000.0", "0.0", &["depth_scale", "positive"]),
        ("depth_scale = 5000.0\n", "", &["depth_scale", "missing"]),
        ("5000.0", "\"x\"", &["`depth_scale`", "line 4"]),
        ("5000.0", "5000.0\nreadout_s = -1.0", &["readout_s"]),
        ("5000.0", "5000.0\ntime_offset_s = inf", &["time_offset_s"]),
        (
            "5000.0",
            "5000.0\ndepthscale = 1.0",
            &["depthscale", "unknown"],
        ),
        ("640", "0", &["width"]),
        (
            "[parameters]",
            "[camera_from_imu]\ntranslation = [0.0, 0.0, 0.0]\n\
            quat_xyzw = [0.0, 0.0, 0.0, 2.0]\n[parameters]",
            &["camera_from_imu.quat_xyzw", "norm 1"],
        ),
        ("model", "= model", &["line 1"]),
    ] {
        let error = error_of(&TEXT.replace(from, to));
        for part in parts.iter().chain(&["calibration.toml"]) {
            assert!(error.contains(part), "`{part}` missing in: {error}");
        }
    }
}

proptest! {
    #[test]
    fn calibration_of_arbitrary_text_never_panics(
        text in "(?s)([a-z_]{1,12} ?= ?[-0-9.\"a-z\\[\\], ]{0,12}\n|\\[[a-z_]{1,10}\\]\n|.{0,9}){0,8}",
    ) {
        let _ = CalibrationFile::from_toml(&text, Path::new("a"));
    }
}

#[test]
fn depth_correction_and_readout_survive_the_file() {
    let correction =
        DepthCorrection::from_named(&[("z1", -0.02), ("r4", 1.0 / 30.0)], &[("one", 1e-3)])
            .unwrap();
    let mut calibration = CalibrationFile::from_toml(TEXT, Path::new("a")).unwrap();
    assert_eq!(calibration.depth_field, None);
    calibration.depth_field = Some(correction);
    calibration.readout_s = Some(-0.03);
    let text = calibration.to_toml(Path::new("a")).unwrap();
    assert!(text.contains("[depth_field.relative]"), "{text}");
    assert_eq!(
        CalibrationFile::from_toml(&text, Path::new("a")).unwrap(),
        calibration
    );
}

#[test]
fn depth_correction_errors_name_the_field() {
    for (table, part) in [
        (
            "[depth_correction.relative]\nz3 = 0.1\n",
            "depth_correction.relative.z3",
        ),
        (
            "[depth_correction.additive]\nr4 = nan\n",
            "depth_correction.additive.r4",
        ),
        ("[depth_correction.scale]\nr4 = 1.0\n", "scale"),
    ] {
        let error = error_of(&format!("{TEXT}{table}"));
        assert!(error.contains(part), "`{part}` missing in: {error}");
    }
    let all_around = Camera::equirectangular(64, 32).unwrap();
    let mut calibration = CalibrationFile::of_camera(&all_around, 1000.0).unwrap();
    calibration.depth_field = Some(DepthCorrection::default());
    let error = calibration.to_toml(Path::new("a")).unwrap_err().to_string();
    assert!(error.contains("depth_field"), "{error}");
}

#[test]
fn calibration_with_another_camera_keeps_everything_else() {
    let mut calibration = CalibrationFile::from_toml(TEXT, Path::new("a")).unwrap();
    calibration.imu_offset_s = Some(0.01);
    let camera = Camera::opencv(520.0, 521.0, 320.0, 240.0, [0.1; 8], 640, 480).unwrap();
    let other = calibration.with_camera(&camera).unwrap();
    assert_eq!(other.camera().unwrap(), camera);
    assert_eq!(
        (other.depth_scale, other.imu_offset_s),
        (5000.0, Some(0.01))
    );
    let small = Camera::pinhole(50.0, 50.0, 31.5, 23.5, 64, 48).unwrap();
    assert!(calibration.with_camera(&small).is_err());
}

#[test]
fn calibration_of_two_cameras_survives_the_file_and_the_estimators_form() {
    let colour = Camera::pinhole(520.0, 519.0, 320.0, 240.0, 640, 480).unwrap();
    let depth = Camera::pinhole(580.0, 581.0, 318.0, 241.0, 640, 480).unwrap();
    let pose = Pose::from_parts([0.025, 0.0, 1e-3], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let mut calibration = Calibration::of_depth_camera(depth);
    calibration.colour = Some(colour);
    calibration.colour_from_depth = Some(pose);
    calibration.colour_offset_s = Some(0.019);
    calibration.imu_offset_s = Some(-0.004);
    calibration.readout_s = Some(0.0255);
    calibration.deviations.insert("readout_s".into(), 4e-4);
    let file = CalibrationFile::of_calibration(&calibration, 1000.0).unwrap();
    let text = file.to_toml(Path::new("a")).unwrap();
    let back = CalibrationFile::from_toml(&text, Path::new("a")).unwrap();
    assert_eq!(back, file, "{text}");
    assert_eq!(back.calibration().unwrap(), calibration);
}

#[test]
fn calibration_of_schema_one_is_migrated() {
    let old = TEXT.replace("5000.0", "5000.0\ntime_offset_s = 0.25\nreadout_s = 0.03")
        + "[depth_correction.relative]\nr4 = -0.05\n";
    let file = CalibrationFile::from_toml(&old, Path::new("a")).unwrap();
    assert_eq!(file.imu_offset_s, Some(0.25));
    assert_eq!(file.depth.parameters["fx"], 525.0);
    let text = file.to_toml(Path::new("a")).unwrap();
    assert!(text.contains("schema = 2") && text.contains("[depth_field.relative]"));
    let back = CalibrationFile::from_toml(&text, Path::new("a")).unwrap();
    assert_eq!(back, file);
}

#[test]
fn calibration_of_a_later_schema_is_refused_by_its_number() {
    let error = error_of(&format!("schema = 7\n{TEXT}"));
    assert!(error.contains("`schema`") && error.contains('7'), "{error}");
}
