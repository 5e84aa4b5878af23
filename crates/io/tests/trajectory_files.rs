//! Trajectory files: exact round trips, and errors that name file, line, expected and found.
#![allow(clippy::unwrap_used, clippy::expect_used)] // tests stop where a file is not as it should be

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;
use sphereflow_core::{Pose, Stamp, Trajectory};
use sphereflow_io::trajectory::*;
use std::fs;
use std::path::PathBuf;

fn any_pose() -> impl Strategy<Value = Pose> {
    let unit = -1.0..1.0f64;
    (
        [unit.clone(), unit.clone(), unit.clone(), unit],
        [-1e4..1e4f64, -1e-7..1e-7f64, -10.0..10.0f64],
    )
        .prop_filter("a direction", |(q, _)| {
            q.iter().map(|v| v * v).sum::<f64>() > 1e-3
        })
        .prop_map(|([x, y, z, w], t)| {
            Pose::new(
                UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
                Vector3::from(t),
            )
        })
}

fn any_trajectory() -> impl Strategy<Value = Trajectory> {
    let steps = prop::collection::vec((1..2_000_000_000i64, any_pose()), 1..20);
    (0..1_500_000_000_000_000_000i64, steps).prop_map(|(start, steps)| {
        let mut trajectory = Trajectory::new();
        let mut ns = start;
        for (step, pose) in steps {
            ns += step;
            trajectory.push(Stamp::from_ns(ns), pose).unwrap();
        }
        trajectory
    })
}

fn bits(trajectory: &Trajectory) -> Vec<(i64, Vec<u64>)> {
    let pose_bits = |pose: &Pose| {
        let quaternion = pose.quat_xyzw();
        let numbers = pose.translation.iter().chain(&quaternion);
        numbers.map(|v| v.to_bits()).collect()
    };
    trajectory
        .iter()
        .map(|(stamp, pose)| (stamp.ns(), pose_bits(pose)))
        .collect()
}

/// Rounding of matrix to quaternion and back: below 1e-15 but for a few rotations of 100 000.
const MATRIX_ROUNDING: f64 = 4e-15;

/// A time soon after 1970 in nanoseconds is a date of today in microseconds.
#[test]
fn euroc_header_that_names_nanoseconds_is_believed() {
    let stamp = Stamp::from_ns(1_580_092_258_152_241);
    let trajectory = Trajectory::from_vecs(vec![stamp], vec![Pose::identity()]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.csv");
    write_trajectory(&path, &trajectory, TrajectoryFormat::Euroc).unwrap();
    let back = read_trajectory(&path, Some(TrajectoryFormat::Euroc)).unwrap();
    assert_eq!(back.stamps(), trajectory.stamps());
}

proptest! {
    #[test]
    fn tum_and_euroc_written_then_read_give_every_bit(trajectory in any_trajectory()) {
        let folder = tempfile::tempdir().unwrap();
        for format in [TrajectoryFormat::Tum, TrajectoryFormat::Euroc] {
            let path = folder.path().join("t.txt");
            write_trajectory(&path, &trajectory, format).unwrap();
            let back = read_trajectory(&path, Some(format)).unwrap();
            prop_assert_eq!(bits(&back), bits(&trajectory), "{}", format);
        }
    }

    #[test]
    fn kitti_written_then_read_then_written_is_the_same_file(trajectory in any_trajectory()) {
        let folder = tempfile::tempdir().unwrap();
        let [first, second, times] = ["a", "b", "t"].map(|name| folder.path().join(name));
        write_kitti(&first, &trajectory).unwrap();
        write_kitti_times(&times, &trajectory).unwrap();
        let back = read_kitti(&first, Some(&times)).unwrap();
        prop_assert_eq!(back.stamps(), trajectory.stamps());
        for (a, b) in back.poses().iter().zip(trajectory.poses()) {
            prop_assert_eq!(a.translation, b.translation);
            let (p, q) = (a.rotation.quaternion(), b.rotation.quaternion());
            let difference = (p - q).norm().min((p + q).norm());
            prop_assert!(difference < MATRIX_ROUNDING, "{}", difference);
        }
        write_kitti(&second, &back).unwrap();
        prop_assert_eq!(fs::read(&first).unwrap(), fs::read(&second).unwrap());
        let again = read_kitti(&second, Some(&times)).unwrap();
        prop_assert_eq!(bits(&again), bits(&back));
    }

    #[test]
    fn readers_of_arbitrary_text_never_panic(text in "(?s)[-0-9a-z.,# \n\r\t]{0,200}|(?s).{0,80}") {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.txt");
        fs::write(&path, text).unwrap();
        let _ = guess_format(&path);
        for format in [TrajectoryFormat::Tum, TrajectoryFormat::Kitti, TrajectoryFormat::Euroc] {
            let _ = read_trajectory(&path, Some(format));
            let _ = read_trajectory_lenient(&path, Some(format));
        }
    }
}

fn file_of(text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trajectory.txt");
    fs::write(&path, text).unwrap();
    (folder, path)
}

fn error_of(text: &str) -> String {
    let (_folder, path) = file_of(text);
    let error = read_trajectory(&path, Some(TrajectoryFormat::Tum)).unwrap_err();
    error.to_string()
}

#[test]
fn tum_columns_are_xyzw_and_metres() {
    let (_folder, path) = file_of("# head\n1.5, 1, 2, 3, 0, 0, 0.6, 0.8\n\n2.5\t4 5 6e0 0 0 0 1\n");
    let trajectory = read_trajectory(&path, None).unwrap();
    assert_eq!(trajectory.stamps()[0].ns(), 1_500_000_000);
    let pose = trajectory.poses()[0];
    assert_eq!(pose.translation, Vector3::new(1.0, 2.0, 3.0));
    assert_eq!(pose.quat_xyzw(), [0.0, 0.0, 0.6, 0.8]);
    assert_eq!(trajectory.poses()[1].translation.z, 6.0);
}

#[test]
fn tum_writer_uses_nine_decimals_of_integer_time() {
    let mut trajectory = Trajectory::new();
    let stamp = Stamp::from_ns(1_305_031_229_528_748_001);
    trajectory.push(stamp, Pose::identity()).unwrap();
    let (_folder, path) = file_of("");
    write_tum(&path, &trajectory, "world_from_camera").unwrap();
    assert_eq!(
        fs::read_to_string(&path).unwrap(),
        "# world_from_camera\n# t tx ty tz qx qy qz qw\n1305031229.528748001 0.000000000 \
         0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 1.000000000\n"
    );
}

#[test]
fn euroc_columns_are_nanoseconds_and_wxyz() {
    let (_folder, path) = file_of("#t\n1403715273262142976,1,2,3,0.8,0,0,0.6,9,9,9\n");
    assert_eq!(guess_format(&path).unwrap(), TrajectoryFormat::Euroc);
    let trajectory = read_trajectory(&path, None).unwrap();
    assert_eq!(trajectory.stamps()[0].ns(), 1_403_715_273_262_142_976);
    assert_eq!(trajectory.poses()[0].quat_xyzw(), [0.0, 0.0, 0.6, 0.8]);
}

#[test]
fn kitti_columns_are_row_major_and_stamps_the_index_in_seconds() {
    let (_folder, path) = file_of("0 -1 0 1 1 0 0 2 0 0 1 3\n1 0 0 0 0 1 0 0 0 0 1 0\n");
    let trajectory = read_trajectory(&path, None).unwrap();
    assert_eq!(trajectory.stamps()[1].ns(), 1_000_000_000);
    let mapped = trajectory.poses()[0].transform(&Vector3::x());
    assert!((mapped - Vector3::new(1.0, 3.0, 3.0)).norm() < MATRIX_ROUNDING);
}

#[test]
fn kitti_with_other_number_of_times_is_an_error() {
    let row = "1 0 0 0 0 1 0 0 0 0 1 0\n";
    for (poses, times) in [(2, "0\n"), (1, "0\n1\n")] {
        let (_a, path) = file_of(&row.repeat(poses));
        let (_b, times) = file_of(times);
        let error = read_kitti(&path, Some(&times)).unwrap_err().to_string();
        assert!(error.contains("one a time"), "{error}");
    }
}

#[test]
fn row_of_seven_columns_is_an_error_with_line_and_both_numbers() {
    let error = error_of("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 1\n");
    for part in ["trajectory.txt:2:", "8 columns", "found 7 columns"] {
        assert!(error.contains(part), "{part} missing in: {error}");
    }
    let (_folder, path) = file_of("2 0 0 0 0 0 1\n");
    assert!(
        guess_format(&path)
            .unwrap_err()
            .to_string()
            .contains("7 columns")
    );
}

#[test]
fn numbers_that_are_none_are_errors_with_line() {
    for bad in ["nan", "inf", "x", "", "1.2.3"] {
        let error = error_of(&format!("1,0,0,{bad},0,0,0,1\n"));
        assert!(
            error.contains(":1: expected a finite number in column 4"),
            "{error}"
        );
    }
    assert!(error_of("abc 0 0 0 0 0 0 1\n").contains("decimal seconds in column 1, found `abc`"));
    assert!(error_of("1 0 0 0 0 0 0 0.5\n").contains("norm 1"));
    assert!(error_of("# only comments\n").contains("no poses"));
}

#[test]
fn stamps_that_do_not_increase_are_an_error_or_counted() {
    let text = "1 0 0 0 0 0 0 1\n3 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n3 0 0 0 0 0 0 1\n\
                3 0 0 0 0 0 0 1\n4 0 0 0 0 0 0 1\n";
    let error = error_of(text);
    assert!(
        error.contains(":3: expected a stamp after 3.000000000 s"),
        "{error}"
    );
    let (_folder, path) = file_of(text);
    let (trajectory, warnings) = read_trajectory_lenient(&path, None).unwrap();
    assert_eq!(trajectory.len(), 3);
    assert_eq!(warnings.total(), 3);
    assert!(
        warnings.as_slice()[0].first.contains("line 3"),
        "{warnings:?}"
    );
}

#[test]
fn pose_that_is_not_finite_is_not_written() {
    let mut trajectory = Trajectory::new();
    let broken = Pose::new(UnitQuaternion::identity(), Vector3::new(0.0, f64::NAN, 0.0));
    trajectory.push(Stamp::from_ns(5), broken).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.txt");
    for format in [
        TrajectoryFormat::Tum,
        TrajectoryFormat::Kitti,
        TrajectoryFormat::Euroc,
    ] {
        assert!(write_trajectory(&path, &trajectory, format).is_err());
        assert!(!path.exists());
    }
}
