//! Recordings written and read back, and what the writer refuses.
#![allow(clippy::unwrap_used, clippy::expect_used)] // tests stop where a file is not as it should be

mod common;

use common::{SIZE, assert_same_frame, calibration, frame, truth, write_recording};
use sphereflow_core::Plane;
use sphereflow_io::recording::*;
use sphereflow_io::{ColourFormat, RecordingWriter};

const FRAMES: usize = 6;

#[test]
fn recording_written_then_read_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording");
    write_recording(&path, FRAMES);
    let recording = open_recording(&path, &OpenOptions::default()).unwrap();
    assert_eq!(recording.kind(), RecordingKind::TumRgbd);
    assert_eq!(recording.len(), FRAMES);
    assert_eq!(recording.truth(), Some(&truth(FRAMES)));
    assert_eq!(recording.calibration(), Some(&calibration()));
    assert_eq!(
        recording.calibration_source(),
        "calibration.toml of the recording"
    );
    assert_eq!(
        recording.gravity_in_world(),
        calibration().gravity_in_world_m_s2
    );
    assert!(
        recording.warnings().is_empty(),
        "{:?}",
        recording.warnings()
    );
    assert_eq!(recording.sync().unwrap().max_s, 0.0);
    for index in 0..FRAMES {
        assert_same_frame(&recording.frame(index).unwrap(), &frame(index));
    }
    assert!(recording.frame(FRAMES).is_err());
    assert!(recording.stream(0..FRAMES + 1, 2).is_err());
}

#[test]
fn writer_refuses_what_would_not_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording");
    write_recording(&path, 1);
    let error = RecordingWriter::create(&path, calibration())
        .unwrap_err()
        .to_string();
    assert!(error.contains("empty folder"), "{error}");

    let new = folder.path().join("new");
    let mut writer = RecordingWriter::create(&new, calibration()).unwrap();
    let mut wrong = frame(0);
    wrong.depth = None;
    assert!(
        writer
            .push(&wrong)
            .unwrap_err()
            .to_string()
            .contains("frame.depth")
    );
    let mut wrong = frame(0);
    wrong.colour = Some(Plane::filled(2, 2, [0; 3]));
    let error = writer.push(&wrong).unwrap_err().to_string();
    assert!(
        error.contains("frame.colour") && error.contains("64x48"),
        "{error}"
    );
    writer.push(&frame(0)).unwrap();
    assert!(
        writer
            .push(&frame(0))
            .unwrap_err()
            .to_string()
            .contains("frame.stamp")
    );
    assert_eq!(writer.len(), 1);
    assert!(!new.exists() && folder.path().join("new.partial").exists());
    assert!(RecordingWriter::create(&new, calibration()).is_err());
    drop(writer);
    let partial = folder.path().join("new.partial");
    let error = open_recording(&partial, &OpenOptions::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("cut short"), "{error}");
}

#[test]
fn frames_without_colour_and_jpeg_colour_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r");
    let writer = RecordingWriter::create(&path, calibration()).unwrap();
    let mut writer = writer.with_colour_format(ColourFormat::Jpeg);
    let mut dark = frame(0);
    dark.colour = None;
    writer.push(&dark).unwrap();
    writer.push(&frame(1)).unwrap();
    writer.finish().unwrap();
    let recording = open_recording(&path, &OpenOptions::default()).unwrap();
    assert!(recording.frame(0).unwrap().colour.is_none());
    let colour = recording.frame(1).unwrap().colour.unwrap();
    assert_eq!(colour.size(), SIZE);
}
