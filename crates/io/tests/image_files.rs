//! Images: written and read back, corrupt ones refused, depth in counts and in metres.
#![allow(clippy::unwrap_used, clippy::expect_used)] // tests stop where a file is not as it should be

use proptest::prelude::*;
use sphereflow_core::{DepthMap, Plane};
use sphereflow_io::images::*;
use std::fs;

fn samples() -> [Image; 3] {
    [
        Image::Grey8(Plane::from_fn(33, 17, |x, y| (7 * x + 3 * y) as u8)),
        Image::Grey16(Plane::from_fn(33, 17, |x, y| (1021 * x + 77 * y) as u16)),
        Image::Rgb8(Plane::from_fn(33, 17, |x, y| [x as u8, y as u8, 200])),
    ]
}

#[test]
fn png_and_pgm_written_then_read_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    for image in samples() {
        for extension in ["png", "pgm"] {
            let path = folder.path().join(format!("a.{extension}"));
            if matches!((&image, extension), (Image::Rgb8(_), "pgm")) {
                assert!(write_image(&path, &image).is_err());
                continue;
            }
            write_image(&path, &image).unwrap();
            assert_eq!(read_image(&path).unwrap(), image);
        }
    }
}

#[test]
fn pgm_of_sixteen_bits_has_the_high_byte_first_and_keeps_counts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.pgm");
    fs::write(&path, b"P5\n# kinect\n2 1\n4095\n\x01\x02\x00\x07").unwrap();
    let raw = read_raw_depth(&path).unwrap();
    assert_eq!(raw.data(), [0x0102, 7]);
}

/// Quality 92 on a smooth image.
const JPEG_LOSS: i32 = 12;

#[test]
fn jpeg_written_then_read_is_near_and_has_no_depth() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.jpg");
    let [_, depth, _] = samples();
    assert!(write_image(&path, &depth).is_err());
    let colour = Plane::from_fn(32, 32, |x, y| [(100 + 2 * x) as u8, (50 + y) as u8, 128]);
    write_image(&path, &Image::Rgb8(colour.clone())).unwrap();
    let back = read_colour(&path).unwrap();
    for (a, b) in colour
        .data()
        .as_flattened()
        .iter()
        .zip(back.data().as_flattened())
    {
        assert!(
            (i32::from(*a) - i32::from(*b)).abs() <= JPEG_LOSS,
            "{a} {b}"
        );
    }
    assert!(
        read_raw_depth(&path)
            .unwrap_err()
            .to_string()
            .contains("16-bit")
    );
}

#[test]
fn truncated_images_are_errors_with_path_wherever_they_end() {
    let folder = tempfile::tempdir().unwrap();
    let [_, depth, colour] = samples();
    for (name, image) in [("a.png", &depth), ("a.pgm", &depth), ("a.jpg", &colour)] {
        let path = folder.path().join(name);
        write_image(&path, image).unwrap();
        let bytes = fs::read(&path).unwrap();
        // The last bytes of a PNG are its end chunk, without which the image is still whole.
        let whole = if name == "a.png" {
            bytes.len() - 12
        } else {
            bytes.len()
        };
        for length in 0..whole {
            fs::write(&path, &bytes[..length]).unwrap();
            let error = read_image(&path).expect_err(&format!("{name} cut to {length} bytes"));
            assert!(error.to_string().contains(name), "{error}");
        }
    }
}

#[test]
fn depth_counts_to_metres_and_back_round_and_saturate() {
    let raw = Plane::from_vec(4, 1, vec![0, 5000, 65535, 1]).unwrap();
    let depth = depth_from_raw(&raw, 5000.0).unwrap();
    let metres = depth.metres().data();
    assert!(metres[0].is_nan() && metres[2].is_nan());
    assert_eq!(metres[1], 1.0);
    let edge = DepthMap::new(Plane::from_vec(4, 1, vec![65.534, 65.535, 1e9, 0.0014]).unwrap());
    let counts = raw_from_depth(&edge, 1000.0).unwrap();
    assert_eq!(counts.data(), [65534, 0, 0, 1]);
    for scale in [0.0, -1.0, f64::NAN] {
        let error = depth_from_raw(&raw, scale).unwrap_err().to_string();
        assert!(error.contains("depth_scale"), "{error}");
    }
}

proptest! {
    #[test]
    fn every_count_survives_metres(
        counts in prop::collection::vec(0..65535_u16, 64), scale in 1.0..20_000.0f64,
    ) {
        let raw = Plane::from_vec(8, 8, counts).unwrap();
        let depth = depth_from_raw(&raw, scale).unwrap();
        prop_assert_eq!(raw_from_depth(&depth, scale).unwrap(), raw);
    }

    #[test]
    fn reader_of_arbitrary_bytes_never_panics(
        head in prop::sample::select(vec![
            &b"P5 "[..], b"P5\n9999999999 99999999 255\n", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"",
        ]),
        tail in prop::collection::vec(any::<u8>(), 0..64),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, [head, &tail].concat()).unwrap();
        let _ = read_image(&path);
        let _ = sphereflow_io::ply::read_ply(&path);
    }

    #[test]
    fn reader_of_damaged_images_never_panics(
        extension in prop::sample::select(vec!["png", "jpg", "pgm"]),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("a.{extension}"));
        let [grey, _, _] = samples();
        write_image(&path, &grey).unwrap();
        let mut bytes = fs::read(&path).unwrap();
        for (index, byte) in damage {
            let index = index.index(bytes.len());
            bytes[index] = byte;
        }
        fs::write(&path, &bytes).unwrap();
        let _ = read_image(&path);
    }
}
