//! Files as they come from the field: each is read, with a warning, or refused by its cause.
#![allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to

use sphereflow_core::Plane;
use sphereflow_io::images::{Image, read_image, write_image};
use sphereflow_io::problems::{read_bundle, read_g2o};
use sphereflow_io::trajectory::{guess_format, read_trajectory, read_trajectory_lenient};
use sphereflow_io::{OpenOptions, open_recording};
use std::fs;
use std::path::{Path, PathBuf};

fn file(folder: &Path, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(&path, text).unwrap();
    path
}

fn poses(count: usize, stamp: impl Fn(usize) -> String, separator: &str) -> String {
    let row = |k: usize| {
        let fields = [&stamp(k), "0.5", "1", "2", "0", "0", "0", "1"];
        fields.join(separator) + "\n"
    };
    (0..count).map(row).collect()
}

#[test]
fn times_in_other_units_are_read_leniently_and_named_strictly() {
    let folder = tempfile::tempdir().unwrap();
    let microseconds = poses(
        20,
        |k| (1_600_000_000_000_000 + 40_000 * k).to_string(),
        " ",
    );
    let path = file(folder.path(), "a.txt", microseconds);
    let (read, warnings) = read_trajectory_lenient(&path, None).unwrap();
    assert_eq!(read.stamps()[1].ns(), 1_600_000_000_040_000_000);
    assert!(
        format!("{warnings:?}").contains("microseconds"),
        "{warnings:?}"
    );
    let error = read_trajectory(&path, None).unwrap_err().to_string();
    assert!(error.contains("microseconds"), "{error}");
    let exponent = poses(20, |k| format!("{}e+14", 16_000.0 + 0.01 * k as f64), ",");
    let path = file(
        folder.path(),
        "b.csv",
        exponent.replace("0,0,0,1", "1,0,0,0"),
    );
    assert_eq!(guess_format(&path).unwrap().to_string(), "euroc");
    assert_eq!(
        read_trajectory(&path, None).unwrap().stamps()[1].ns(),
        1_600_001_000_000_000_000
    );
}

#[test]
fn rows_of_nan_headers_and_one_bad_row_are_left_out_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "time;x;y;z;qx;qy;qz;qw\n".to_string();
    text += &poses(12, |k| format!("{}.25", k), ";");
    text += "12.25;nan;nan;nan;nan;nan;nan;nan\n13.25;1;2\n";
    let path = file(folder.path(), "a.txt", text);
    let (read, warnings) = read_trajectory_lenient(&path, None).unwrap();
    assert_eq!((read.len(), warnings.total()), (12, 2));
    let error = read_trajectory(&path, None).unwrap_err().to_string();
    assert!(error.contains(":14:"), "{error}");
    let positions = file(folder.path(), "p.txt", "1.5 0 0 0\n1.6 0 0 1\n");
    let format = Some(sphereflow_io::trajectory::TrajectoryFormat::Tum);
    let error = read_trajectory(&positions, format).unwrap_err().to_string();
    assert!(error.contains("without orientation"), "{error}");
}

#[test]
fn compressed_files_and_decimal_commas_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let packed: [(&[u8], &str); 4] = [
        (b"\x1f\x8b\x08 and so on", "gunzip"),
        (b"BZh91AY and so on", "bunzip2"),
        (b"\xfd7zXZ\0 and so on", "unxz"),
        (b"PK\x03\x04 and so on", "unzip"),
    ];
    for (bytes, remedy) in packed {
        let path = file(folder.path(), "a.bin", bytes);
        for error in [
            read_bundle(&path).unwrap_err().to_string(),
            read_trajectory(&path, None).unwrap_err().to_string(),
            read_image(&path).unwrap_err().to_string(),
        ] {
            assert!(error.contains(remedy), "{error}");
        }
    }
    let commas = file(
        folder.path(),
        "a.txt",
        poses(3, |k| format!("{k}.25"), " ").replace('.', ","),
    );
    let error = read_trajectory(&commas, None).unwrap_err().to_string();
    assert!(error.contains("decimal comma"), "{error}");
}

#[test]
fn points_of_a_graph_follow_the_poses_that_see_them() {
    let folder = tempfile::tempdir().unwrap();
    let text = "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n\
                VERTEX_SE3:QUAT 3 1 0 0 0 0 0 1\n\
                VERTEX_TRACKXYZ 9 5 5 5\n\
                EDGE_SE3_TRACKXYZ 3 9 0 0 2 0 4 0 0 4 0 4\n\
                EDGE_SE3_PRIOR 3 0 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";
    let read = read_g2o(&file(folder.path(), "a.g2o", text)).unwrap();
    assert_eq!(read.warnings().total(), 2);
    let out = folder.path().join("b.g2o");
    read.write(&out).unwrap();
    let written = fs::read_to_string(&out).unwrap();
    assert!(written.contains("VERTEX_TRACKXYZ 9 1 2 0"), "{written}");
    assert_eq!(read_g2o(&out).unwrap().warnings().total(), 2);
}

fn depth(size: (usize, usize)) -> Plane<u16> {
    let counts =
        (0..size.0 * size.1).map(|k| 900 + 3 * (k % size.0) as u16 + (k / size.0) as u16 * 9);
    Plane::from_vec(size.0, size.1, counts.collect()).unwrap()
}

#[test]
fn depth_with_the_low_byte_first_is_recognised() {
    let folder = tempfile::tempdir().unwrap();
    let image = depth((64, 48));
    let path = folder.path().join("a.pgm");
    write_image(&path, &Image::Grey16(image.clone())).unwrap();
    assert_eq!(read_image(&path).unwrap(), Image::Grey16(image.clone()));
    let mut bytes = b"P5\n64 48\n65535\n".to_vec();
    bytes.extend(image.data().iter().flat_map(|count| count.to_le_bytes()));
    fs::write(&path, bytes).unwrap();
    assert_eq!(read_image(&path).unwrap(), Image::Grey16(image));
}

/// A folder of three frames with an association file; colour of `size`.
fn associated(folder: &Path, colour: (usize, usize)) {
    let mut rows = String::new();
    for k in 0..3 {
        let (d, c) = (
            folder.join(format!("depth/{k}.png")),
            folder.join(format!("rgb/{k}.png")),
        );
        file(folder, "depth/.keep", "");
        file(folder, "rgb/.keep", "");
        write_image(&d, &Image::Grey16(depth((640, 480)))).unwrap();
        let plane = Plane::from_vec(colour.0, colour.1, vec![[7, 8, 9]; colour.0 * colour.1]);
        write_image(&c, &Image::Rgb8(plane.unwrap())).unwrap();
        rows += &format!("{k}.5 depth/{k}.png {k}.52 rgb/{k}.png\n");
    }
    file(folder, "my_assoc.txt", rows);
}

#[test]
fn colour_of_any_kind_leaves_depth_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let options = OpenOptions {
        depth_scale: Some(1000.0),
        ..OpenOptions::default()
    };
    for (size, kept, word) in [
        ((320, 240), true, "resampled"),
        ((640, 360), false, "shape"),
    ] {
        associated(path, size);
        let recording = open_recording(path, &options).unwrap();
        let frame = recording.frame(1).unwrap();
        assert!(frame.depth.is_some());
        assert_eq!(frame.colour.is_some(), kept);
        let said = format!("{:?}", recording.warnings());
        assert!(
            said.contains(word) && said.contains("intrinsics are a guess"),
            "{said}"
        );
    }
    let whole = fs::read(path.join("rgb/1.png")).unwrap();
    fs::write(path.join("rgb/1.png"), &whole[..whole.len() / 2]).unwrap();
    let recording = open_recording(path, &options).unwrap();
    assert!(recording.frame(1).unwrap().colour.is_none());
    assert!(format!("{:?}", recording.warnings()).contains("cannot be read"));
}
