//! Real recordings: the folder named by `SPHEREFLOW_DATA`; skipped, saying so, where it is unset.
#![allow(clippy::unwrap_used)] // a test may stop where a file is not as it should be

use sphereflow_io::images::{Image, depth_from_raw, read_image, read_raw_depth};
use sphereflow_io::recording::{OpenOptions, Recording, RecordingKind, open_recording};
use sphereflow_io::trajectory::*;
use std::path::PathBuf;
use std::time::Instant;

fn data(name: &str) -> Option<PathBuf> {
    match std::env::var_os("SPHEREFLOW_DATA") {
        Some(root) => Some(PathBuf::from(root).join(name)),
        None => {
            println!("skipped: SPHEREFLOW_DATA is unset");
            None
        }
    }
}

fn open(name: &str) -> Option<Recording> {
    data(name).map(|path| open_recording(&path, &OpenOptions::default()).unwrap())
}

#[test]
fn tum_recording_opens_with_everything_in_it() {
    let Some(recording) = open("tum-fr1-rpy-a") else {
        return;
    };
    println!(
        "{:?} {:?} {:?}",
        recording.sync(),
        recording.warnings(),
        recording.notes()
    );
    assert_eq!(recording.kind(), RecordingKind::TumRgbd);
    assert_eq!(recording.len(), 360);
    assert_eq!(recording.stamps()[0].to_string(), "1305031229.528784000");
    assert_eq!(recording.depth_scale(), Some(5000.0));
    assert!(recording.calibration_source().contains("freiburg1"));
    let calibration = recording.calibration().unwrap();
    assert_eq!(calibration.depth.model, "opencv");
    assert_eq!(calibration.depth.parameters["k3"], 1.163314);
    assert!(recording.truth().unwrap().len() > 1000);
    assert!(recording.colour_registered());
    let sync = recording.sync().unwrap();
    assert!(sync.pairs > 350 && sync.max_s < 0.017, "{sync:?}");

    let frame = recording.frame(100).unwrap();
    assert_eq!(frame.colour.as_ref().unwrap().size(), (640, 480));
    assert!(frame.depth.as_ref().unwrap().known_share() > 0.3);
    let (before, stamp) = (recording.stamps()[99], recording.stamps()[100]);
    assert!(frame.imu.len() > 8, "{}", frame.imu.len());
    for sample in &frame.imu {
        assert!(sample.stamp > before && sample.stamp <= stamp);
        assert!(sample.gyro_rad_s.x.is_nan() && sample.accel_m_s2.norm() < 30.0);
    }
}

#[test]
fn seven_scenes_recording_opens_with_nominal_time() {
    let Some(recording) = open("sevenscenes-kitchen-a") else {
        return;
    };
    println!("{:?} {:?}", recording.warnings(), recording.notes());
    assert_eq!(recording.kind(), RecordingKind::SevenScenes);
    assert_eq!(
        (recording.len(), recording.truth().unwrap().len()),
        (500, 500)
    );
    assert_eq!(recording.stamps()[30].ns(), 1_000_000_000);
    assert!(!recording.colour_registered());
    assert!(recording.notes()[0].contains("30 Hz"));
    let gravity = recording.gravity_in_world().unwrap();
    assert!((gravity.norm() - 9.81).abs() < 0.01 && gravity.y > 8.0);
    let depth = recording.frame(7).unwrap().depth.unwrap();
    assert!(depth.known_share() > 0.3);
}

/// Hover and flight of a few m/s^2: the mean over the first samples is gravity's direction.
const UPWARDS_M_S2: f64 = 8.0;

#[test]
fn euroc_recording_gives_samples_truth_and_gravity_down() {
    let Some(recording) = open("euroc-v101-imu-a") else {
        return;
    };
    assert_eq!(recording.kind(), RecordingKind::EurocImu);
    assert!(recording.is_empty() && recording.camera().is_none());
    let (imu, truth) = (recording.imu(), recording.truth().unwrap());
    assert!(imu.len() > 14_000 && truth.len() > 1_400);
    let gravity = recording.gravity_in_world().unwrap();
    let mut upwards = 0.0;
    for sample in &imu[1000..1200] {
        let pose = truth.interpolate(sample.stamp, 0.1).unwrap();
        upwards -= (pose.rotation * sample.accel_m_s2).dot(&gravity.normalize()) / 200.0;
    }
    assert!(upwards > UPWARDS_M_S2, "{upwards}");
}

#[test]
fn pgm_depth_is_read_in_counts() {
    let Some(folder) = data("rgbd-pairs/slambook-joinmap") else {
        return;
    };
    let raw = read_raw_depth(&folder.join("depth/1.pgm")).unwrap();
    assert_eq!(raw.size(), (640, 480));
    let mut known: Vec<f32> = depth_from_raw(&raw, 1000.0)
        .unwrap()
        .into_plane()
        .into_vec();
    known.retain(|value| value.is_finite());
    let middle = known.len() / 2;
    let median = *known.select_nth_unstable_by(middle, f32::total_cmp).1;
    assert!((0.5..8.0).contains(&median), "{median}");
    let colour = read_image(&folder.join("color/1.png")).unwrap();
    assert!(matches!(colour, Image::Rgb8(_)));
}

#[test]
fn trajectories_of_others_are_read_and_survive_a_round_trip() {
    let Some(folder) = data("trajectories/evo") else {
        return;
    };
    let scratch = tempfile::tempdir().unwrap();
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let (trajectory, warnings) = read_trajectory_lenient(&path, None).unwrap();
        println!(
            "{} {} {:?}",
            path.display(),
            trajectory.len(),
            warnings.as_slice()
        );
        let is_csv = path.extension().unwrap() == "csv";
        assert_eq!(
            guess_format(&path).unwrap() == TrajectoryFormat::Euroc,
            is_csv
        );
        for format in [TrajectoryFormat::Tum, TrajectoryFormat::Euroc] {
            let copy = scratch.path().join("copy");
            write_trajectory(&copy, &trajectory, format).unwrap();
            assert_eq!(guess_format(&copy).unwrap(), format);
            assert_eq!(read_trajectory(&copy, None).unwrap(), trajectory);
        }
        count += 1;
    }
    assert_eq!(count, 10);
}

#[test]
fn stream_gives_the_frames_of_single_reads_in_order() {
    let Some(recording) = open("tum-fr1-rpy-a") else {
        return;
    };
    let start = Instant::now();
    let mut count = 0;
    for (offset, frame) in recording.stream(10..40, 4).unwrap().enumerate() {
        let frame = frame.unwrap();
        assert_eq!(frame.stamp, recording.stamps()[10 + offset]);
        count += 1;
    }
    assert_eq!(count, 30);
    println!(
        "stream: {:.2} ms a frame",
        start.elapsed().as_secs_f64() * 1e3 / 30.0
    );
    let last = recording
        .stream(39..40, 1)
        .unwrap()
        .next()
        .unwrap()
        .unwrap();
    let (a, b) = (last.colour, recording.frame(39).unwrap().colour);
    assert!(a == b);
    drop(recording.stream(0..360, 8).unwrap()); // ends without decoding all
}

/// Prints what the files cost: `cargo test --release -p sphereflow-io --test real_recordings --
/// --nocapture decoding_is_timed`.
#[test]
fn decoding_is_timed() {
    let Some(recording) = open("tum-fr1-rpy-a") else {
        return;
    };
    for list in ["depth", "rgb"] {
        let folder = recording.path().join(list);
        let files: Vec<PathBuf> = std::fs::read_dir(folder)
            .unwrap()
            .take(60)
            .map(|e| e.unwrap().path())
            .collect();
        let start = Instant::now();
        for file in &files {
            read_image(file).unwrap();
        }
        let ms = start.elapsed().as_secs_f64() * 1e3 / files.len() as f64;
        println!("{list}: {ms:.2} ms an image of 640x480");
    }
    let scratch = tempfile::tempdir().unwrap();
    let frame = recording.frame(50).unwrap();
    for format in [
        sphereflow_io::ColourFormat::Png,
        sphereflow_io::ColourFormat::Jpeg,
    ] {
        let path = scratch.path().join(format!("{format:?}"));
        let calibration = recording.calibration().unwrap().clone();
        let writer = sphereflow_io::RecordingWriter::create(&path, calibration).unwrap();
        let mut writer = writer.with_colour_format(format);
        let start = Instant::now();
        for index in 0..30 {
            let mut frame = frame.clone();
            frame.stamp = recording.stamps()[index];
            frame.imu.clear();
            writer.push(&frame).unwrap();
        }
        let ms = start.elapsed().as_secs_f64() * 1e3 / 30.0;
        println!("writing {format:?}: {ms:.2} ms a frame");
        writer.finish().unwrap();
    }
}
