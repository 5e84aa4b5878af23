//! Recordings: streams of frames, and folders that are not as they should be.
#![allow(clippy::unwrap_used, clippy::expect_used)] // tests stop where a file is not as it should be

mod common;

use common::{assert_same_frame, calibration, frame, stamp, write_recording};
use proptest::prelude::*;
use sphereflow_core::{Plane, RgbdFrame};
use sphereflow_io::images::{Image, write_image};
use sphereflow_io::recording::*;
use std::fs;
use std::path::{Path, PathBuf};

const FRAMES: usize = 6;

fn recorded() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording");
    write_recording(&path, FRAMES);
    (folder, path)
}

fn open(path: &Path) -> Recording {
    open_recording(path, &OpenOptions::default()).unwrap()
}

fn error_of(path: &Path) -> String {
    open_recording(path, &OpenOptions::default())
        .unwrap_err()
        .to_string()
}

fn edit(path: &Path, change: impl FnOnce(String) -> String) {
    let text = fs::read_to_string(path).unwrap();
    fs::write(path, change(text)).unwrap();
}

#[test]
fn stream_gives_frames_in_order_whatever_the_prefetch() {
    let (_folder, path) = recorded();
    let recording = open(&path);
    for prefetch in [0, 1, 2, 3, 100] {
        let stream = recording.stream(1..FRAMES, prefetch).unwrap();
        assert_eq!(stream.len(), FRAMES - 1);
        let frames: Vec<RgbdFrame> = stream.map(|frame| frame.unwrap()).collect();
        assert_eq!(frames.len(), FRAMES - 1);
        for (offset, read) in frames.iter().enumerate() {
            assert_same_frame(read, &frame(1 + offset));
        }
    }
    assert_eq!(recording.stream(2..2, 4).unwrap().count(), 0);
    let mut dropped_early = recording.stream(0..FRAMES, 1).unwrap();
    assert!(dropped_early.next().unwrap().is_ok());
}

#[test]
fn truncated_image_is_an_error_item_and_the_stream_goes_on() {
    let (_folder, path) = recorded();
    let broken = path.join(format!("depth/{}.png", stamp(2)));
    let bytes = fs::read(&broken).unwrap();
    fs::write(&broken, &bytes[..bytes.len() / 2]).unwrap();
    let recording = open(&path);
    let frames: Vec<_> = recording.stream(0..FRAMES, 3).unwrap().collect();
    let good: Vec<bool> = frames.iter().map(Result::is_ok).collect();
    assert_eq!(good, [true, true, false, true, true, true]);
    let error = frames[2].as_ref().unwrap_err().to_string();
    assert!(error.contains(&format!("{}.png", stamp(2))), "{error}");
    assert!(error.contains("corrupt"), "{error}");
}

#[test]
fn empty_unknown_and_missing_folders_say_what_was_looked_for() {
    let folder = tempfile::tempdir().unwrap();
    let error = error_of(folder.path());
    for part in [
        "depth.txt",
        "frame-000000.depth.png",
        "imu0.csv",
        "an empty folder",
    ] {
        assert!(error.contains(part), "{part} missing in: {error}");
    }
    fs::write(folder.path().join("holiday.mp4"), "").unwrap();
    assert!(error_of(folder.path()).contains("holiday.mp4"));
    assert!(error_of(&folder.path().join("absent")).contains("absent"));
}

#[test]
fn missing_depth_list_is_an_error_that_names_it() {
    let (_folder, path) = recorded();
    fs::remove_file(path.join("depth.txt")).unwrap();
    assert!(
        error_of(&path).contains("expected depth.txt"),
        "{}",
        error_of(&path)
    );
}

#[test]
fn rows_out_of_order_and_missing_files_are_counted() {
    let (_folder, path) = recorded();
    edit(&path.join("depth.txt"), |text| {
        let row = |index| format!("{0} depth/{0}.png\n", stamp(index));
        format!("{text}{}{}", row(FRAMES - 1), row(0))
    });
    fs::remove_file(path.join(format!("rgb/{}.png", stamp(3)))).unwrap();
    edit(&path.join("imu.csv"), |text| {
        format!("{text}5,0,0,0,0,0,0\n")
    });
    let recording = open(&path);
    let texts: Vec<String> = recording
        .warnings()
        .as_slice()
        .iter()
        .map(ToString::to_string)
        .collect();
    let all = texts.join("\n");
    for part in [
        "depth.txt: row with a repeated stamp left out (line 8",
        "depth.txt: row with an unsorted stamp left out (line 9",
        "rgb.txt: listed file is missing",
        "depth image without colour within the tolerance",
        "imu.csv: sample with an unsorted stamp left out",
    ] {
        assert!(all.contains(part), "{part} missing in: {all}");
    }
    assert_eq!(recording.len(), FRAMES);
    assert!(recording.frame(3).unwrap().colour.is_none());
}

#[test]
fn colour_without_depth_is_left_out_and_counted() {
    let (_folder, path) = recorded();
    edit(&path.join("depth.txt"), |text| {
        let without = |row: &&str| !row.contains(&stamp(4).to_string());
        text.lines()
            .filter(without)
            .map(|row| format!("{row}\n"))
            .collect()
    });
    let recording = open(&path);
    assert_eq!(recording.len(), FRAMES - 1);
    let warnings = recording.warnings();
    let warning = &warnings.as_slice()[0];
    assert!(
        warning.text.contains("colour image without depth"),
        "{warning}"
    );
    assert_eq!(warning.count, 1);
}

#[test]
fn wrong_depth_scale_is_an_error_with_a_hint() {
    let (_folder, path) = recorded();
    edit(&path.join("calibration.toml"), |text| {
        text.replace("depth_scale = 5000.0", "depth_scale = 1.0")
    });
    let error = error_of(&path);
    assert!(
        error.contains("median depth") && error.contains("5000"),
        "{error}"
    );
    let insisted = OpenOptions {
        depth_scale: Some(1.0),
        ..OpenOptions::default()
    };
    let recording = open_recording(&path, &insisted).unwrap();
    assert!(
        recording.warnings().as_slice()[0]
            .text
            .contains("depth scale looks wrong")
    );
    assert!(
        recording
            .calibration_source()
            .contains("given by the caller")
    );
    let nonsense = OpenOptions {
        depth_scale: Some(f64::NAN),
        ..OpenOptions::default()
    };
    assert!(
        open_recording(&path, &nonsense)
            .unwrap_err()
            .to_string()
            .contains("depth_scale")
    );
}

#[test]
fn unknown_camera_of_another_size_is_an_error_not_a_guess() {
    let (_folder, path) = recorded();
    fs::remove_file(path.join("calibration.toml")).unwrap();
    let error = error_of(&path);
    assert!(
        error.contains("calibration.toml") && error.contains("64x48"),
        "{error}"
    );
    let given = OpenOptions {
        calibration: Some(calibration()),
        ..OpenOptions::default()
    };
    let recording = open_recording(&path, &given).unwrap();
    assert_eq!(recording.calibration_source(), "given by the caller");
    let mut other = calibration();
    other.depth.width = 320;
    let given = OpenOptions {
        calibration: Some(other),
        ..OpenOptions::default()
    };
    let error = open_recording(&path, &given).unwrap_err().to_string();
    assert!(
        error.contains("320x48") && error.contains("64x48"),
        "{error}"
    );
}

#[test]
fn calibration_of_tum_camera_is_chosen_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let depth = Plane::filled(640, 480, 5000_u16);
    for (name, header, model, source) in [
        ("rgbd_dataset_freiburg3_office", "", "pinhole", "freiburg3"),
        (
            "a",
            "# file: 'rgbd_dataset_freiburg2_desk.bag'\n",
            "opencv",
            "freiburg2",
        ),
        ("b", "", "pinhole", "ROS default"),
    ] {
        let path = folder.path().join(name);
        fs::create_dir_all(&path).unwrap();
        write_image(&path.join("1.png"), &Image::Grey16(depth.clone())).unwrap();
        fs::write(path.join("depth.txt"), format!("{header}1.0 1.png\n")).unwrap();
        let recording = open(&path);
        assert!(recording.calibration_source().contains(source));
        assert_eq!(recording.calibration().unwrap().depth.model, model);
        assert!(
            recording.warnings().as_slice()[0]
                .text
                .contains("no rgb.txt")
        );
        assert!(recording.frame(0).unwrap().colour.is_none());
    }
}

#[test]
fn seven_scenes_gaps_and_bad_poses_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let depth = Image::Grey16(Plane::filled(640, 480, 1500));
    for number in [0, 1, 3] {
        let name = |kind: &str| folder.path().join(format!("frame-00000{number}.{kind}"));
        write_image(&name("depth.png"), &depth).unwrap();
        let first = if number == 1 { "nan" } else { "1" };
        let pose = format!("{first} 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
        fs::write(name("pose.txt"), pose).unwrap();
    }
    let recording = open(folder.path());
    assert_eq!((recording.len(), recording.truth().unwrap().len()), (3, 2));
    assert_eq!(recording.stamps()[2].ns(), 100_000_000);
    let all = format!("{:?}", recording.warnings());
    for part in [
        "gap in the frame numbers",
        "pose file left out",
        "depth image without colour",
    ] {
        assert!(all.contains(part), "{part} missing in: {all}");
    }
}

#[test]
fn euroc_tree_is_found_from_above_and_within() {
    let folder = tempfile::tempdir().unwrap();
    let mav = folder.path().join("mav0");
    fs::create_dir_all(mav.join("imu0")).unwrap();
    fs::create_dir_all(mav.join("state_groundtruth_estimate0")).unwrap();
    fs::write(
        mav.join("imu0/data.csv"),
        "#t\n1000,1,2,3,4,5,6\n2000,1,2,3,4,5,6\n",
    )
    .unwrap();
    let truth = mav.join("state_groundtruth_estimate0/data.csv");
    fs::write(truth, "1000,0,0,0,1,0,0,0,9,9,9\n").unwrap();
    for path in [folder.path(), mav.as_path()] {
        let recording = open(path);
        assert_eq!(recording.kind(), RecordingKind::EurocImu);
        assert_eq!(
            (recording.imu().len(), recording.truth().unwrap().len()),
            (2, 1)
        );
        assert!(recording.frame(0).is_err());
    }
    fs::write(mav.join("imu0/data.csv"), "1000,1,2,3,4,5\n").unwrap();
    assert!(error_of(&mav).contains("7 columns"));
}

proptest! {
    #[test]
    fn recording_of_arbitrary_lists_never_panics(
        text in "(?s)[-0-9a-z./,# \n]{0,120}",
        name in prop::sample::select(vec![
            "depth.txt", "rgb.txt", "groundtruth.txt", "imu.csv", "mag.csv", "calibration.toml",
        ]),
    ) {
        let (_folder, path) = recorded();
        fs::write(path.join(name), text).unwrap();
        let _ = open_recording(&path, &OpenOptions::default());
    }
}

#[test]
fn recording_may_be_shared_between_threads() {
    fn shared<T: Send + Sync + Clone + 'static>() {}
    fn sent<T: Send + 'static>() {}
    shared::<Recording>();
    sent::<FrameStream>();
}
