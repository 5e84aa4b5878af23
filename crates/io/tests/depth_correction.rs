//! A calibration with a depth correction: recordings opened with it have corrected depth.
#![allow(clippy::unwrap_used, clippy::expect_used)] // tests stop where a file is not as it should be

mod common;

use common::{calibration, write_recording};
use sphereflow_io::recording::*;
use sphereflow_sphere::{DepthCorrection, DepthCorrector};

#[test]
fn recording_opened_with_a_correction_has_corrected_depth() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording");
    write_recording(&path, 2);
    let plain = open_recording(&path, &OpenOptions::default()).unwrap();
    assert!(!plain.depth_corrected());
    assert_eq!(plain.readout_s(), calibration().readout_s.unwrap_or(0.0));

    let correction = DepthCorrection::from_named(&[("z1", -0.05)], &[("one", 0.02)]).unwrap();
    let mut given = calibration();
    (given.depth_field, given.readout_s) = (Some(correction), Some(0.03));
    let options = OpenOptions {
        calibration: Some(given),
        ..OpenOptions::default()
    };
    let corrected = open_recording(&path, &options).unwrap();
    assert!(corrected.depth_corrected());
    assert_eq!(corrected.readout_s(), 0.03);
    let corrector = DepthCorrector::new(plain.camera().unwrap(), &correction).unwrap();
    let streamed = corrected.stream(0..2, 2).unwrap();
    for (index, frame) in streamed.enumerate() {
        let measured = plain.frame(index).unwrap().depth.unwrap();
        let expected = corrector.apply(measured).unwrap();
        let found = frame.unwrap().depth.unwrap();
        let pairs = found.metres().data().iter().zip(expected.metres().data());
        assert!(
            pairs
                .into_iter()
                .all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
        );
        assert_ne!(
            found.metres(),
            plain.frame(index).unwrap().depth.unwrap().metres()
        );
    }
}

#[test]
fn recording_with_a_correction_of_nothing_is_not_called_corrected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording");
    write_recording(&path, 1);
    let mut given = calibration();
    given.depth_field = Some(DepthCorrection::default());
    let options = OpenOptions {
        calibration: Some(given),
        ..OpenOptions::default()
    };
    assert!(!open_recording(&path, &options).unwrap().depth_corrected());
}
