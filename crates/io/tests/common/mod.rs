//! A small synthetic recording for the tests.
#![allow(dead_code, clippy::unwrap_used)] // each test program uses a part; tests may unwrap

use nalgebra::Vector3;
use sphereflow_core::{DepthMap, ImuSample, MagSample, Plane, Pose, RgbdFrame, Stamp, Trajectory};
use sphereflow_io::{CalibrationFile, RecordingWriter};
use sphereflow_sphere::Camera;
use std::path::Path;

pub const SIZE: (usize, usize) = (64, 48);
pub const SCALE: f64 = 5000.0;
const START_NS: i64 = 1_305_031_229_528_748_001;

pub fn calibration() -> CalibrationFile {
    let camera = Camera::pinhole(60.0, 61.0, 31.5, 23.5, SIZE.0, SIZE.1).unwrap();
    let mut calibration = CalibrationFile::of_camera(&camera, SCALE).unwrap();
    calibration.gravity_in_world_m_s2 = Some(Vector3::new(0.0, 9.81, 0.0));
    calibration
}

pub fn stamp(index: usize) -> Stamp {
    Stamp::from_ns(START_NS + 33_333_333 * index as i64)
}

/// Depth in whole counts, so that storing it loses nothing; some of it unknown.
pub fn frame(index: usize) -> RgbdFrame {
    let depth = Plane::from_fn(SIZE.0, SIZE.1, |x, y| match (x + y) % 11 {
        0 => f32::NAN,
        _ => (5000 + 100 * index + 37 * x + 11 * y) as f32 / SCALE as f32,
    });
    let colour = Plane::from_fn(SIZE.0, SIZE.1, |x, y| [x as u8, y as u8, index as u8]);
    let at = |k: i64| Stamp::from_ns(stamp(index).ns() - 5_000_000 * k);
    let imu = [2, 1, 0].map(|k| ImuSample {
        stamp: at(k),
        gyro_rad_s: Vector3::new(0.1, -1.0 / 3.0, 1e-9),
        accel_m_s2: Vector3::new(0.0, -9.81, index as f64 / 7.0),
    });
    let mag = MagSample {
        stamp: at(0),
        mag_ut: Vector3::new(20.0, 1.0 / 3.0, -40.0),
    };
    RgbdFrame {
        stamp: stamp(index),
        colour: Some(colour),
        depth: Some(DepthMap::new(depth)),
        range: None,
        imu: imu.to_vec(),
        mag: vec![mag],
        ..RgbdFrame::default()
    }
}

pub fn truth(count: usize) -> Trajectory {
    let stamps = (0..count).map(stamp).collect();
    let pose =
        |index: usize| Pose::from_parts([index as f64 / 3.0, 0.0, 1.0], [0.0, 0.0, 0.6, 0.8]);
    Trajectory::from_vecs(stamps, (0..count).map(|i| pose(i).unwrap()).collect()).unwrap()
}

pub fn write_recording(path: &Path, count: usize) {
    let mut writer = RecordingWriter::create(path, calibration()).unwrap();
    for index in 0..count {
        writer.push(&frame(index)).unwrap();
    }
    writer.set_truth(truth(count));
    writer.finish().unwrap();
}

/// NaN is not equal to itself: unknown depth is compared by its bits.
pub fn assert_same_frame(a: &RgbdFrame, b: &RgbdFrame) {
    let bits = |frame: &RgbdFrame| {
        let depth = frame.depth.as_ref().unwrap().metres().data();
        depth.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(a), bits(b));
    assert_eq!((a.stamp, &a.imu, &a.mag), (b.stamp, &b.imu, &b.mag));
    assert!(a.colour == b.colour);
}
