//! Point clouds: written and read back, cut ones refused.
#![allow(clippy::unwrap_used, clippy::expect_used)] // tests stop where a file is not as it should be

use proptest::prelude::*;
use sphereflow_io::ply::{ColouredPoint, read_ply, write_ply};
use std::fs;

proptest! {
    #[test]
    fn cloud_written_then_read_is_the_same(
        raw in prop::collection::vec((prop::array::uniform3(-1e6..1e6f32), any::<[u8; 3]>()), 0..50),
    ) {
        let points: Vec<_> = raw
            .into_iter()
            .map(|(position_m, colour)| ColouredPoint { position_m, colour })
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        write_ply(&path, "world_from_camera\nmetres", points.iter().copied()).unwrap();
        prop_assert_eq!(read_ply(&path).unwrap(), points);
    }
}

#[test]
fn cut_foreign_and_unfinite_clouds_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    let point = ColouredPoint {
        position_m: [1.0, 2.0, 3.0],
        colour: [1, 2, 3],
    };
    write_ply(&path, "", [point; 4]).unwrap();
    let bytes = fs::read(&path).unwrap();
    assert_eq!(
        bytes.len(),
        bytes
            .windows(11)
            .position(|w| w == b"end_header\n")
            .unwrap()
            + 11
            + 60
    );
    for length in 0..bytes.len() {
        fs::write(&path, &bytes[..length]).unwrap();
        assert!(read_ply(&path).is_err());
    }
    let unknown = ColouredPoint {
        position_m: [f32::NAN; 3],
        ..point
    };
    let other = folder.path().join("b.ply");
    assert!(
        write_ply(&other, "", [unknown])
            .unwrap_err()
            .to_string()
            .contains("finite")
    );
    assert!(!other.exists());
}
