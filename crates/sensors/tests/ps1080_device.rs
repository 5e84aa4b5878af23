//! The driver of the PS1080 against the simulated device: parameters, formats, losses.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests may

use sphereflow_core::{Plane, Stamp};
use sphereflow_sensors::ps1080::{
    Camera, Content, DepthFormat, ImageFormat, Resolution, StreamSettings,
};
use sphereflow_sensors::sim::{Picture, Ps1080Simulator};
use std::time::Duration;

const TIMEOUT: Duration = Duration::from_secs(5);

fn picture(index: usize) -> Picture {
    let disparity = Plane::from_fn(640, 480, |x, y| match (x * 3 + y) % 17 {
        0 => 2047,
        _ => (500 + (x + 2 * y + 40 * index) % 500) as u16,
    });
    (
        disparity,
        Plane::filled(640, 480, [(20 * index) as u8, 90, 200]),
    )
}

fn camera(lose_every: u16) -> Camera<Ps1080Simulator> {
    let started = Stamp::from_ns(1_800_000_000_000_000_000);
    Camera::open(Ps1080Simulator::new(lose_every, started, picture)).unwrap()
}

fn settings<F>(format: F) -> StreamSettings<F> {
    StreamSettings {
        format,
        resolution: Resolution::Vga,
        rate_hz: 30,
    }
}

#[test]
fn camera_reads_version_and_paged_parameters() {
    let camera = camera(0);
    assert_eq!((camera.version().major, camera.version().build), (5, 22));
    assert_eq!(
        (camera.model().shift, camera.model().baseline_cm),
        (200, 7.5)
    );
}

#[test]
fn camera_gives_every_pixel_in_every_format() {
    for (depth, image) in [
        (DepthFormat::Packed11, ImageFormat::Uyvy),
        (DepthFormat::Compressed, ImageFormat::CompressedYuv),
    ] {
        let mut camera = camera(0);
        camera.start_depth(settings(depth)).unwrap();
        camera.start_image(settings(image)).unwrap();
        let (mut depths, mut colours, mut last) = (0, 0, None);
        for _ in 0..8 {
            let frame = camera.next_frame(TIMEOUT).unwrap().unwrap();
            assert!(frame.complete, "{depth:?}");
            match frame.content {
                Content::Depth(raw, _) => {
                    assert_eq!(raw, picture(depths).0, "{depth:?}");
                    if let Some(last) = last.replace(frame.stamp) {
                        let step = frame.stamp.seconds_since(last);
                        assert!((step - 1.0 / 30.0).abs() < 1e-6, "{step}");
                    }
                    depths += 1;
                }
                Content::Colour(colour) => {
                    let (found, seen) = (colour[(9, 9)], [(20 * colours) as u8, 90, 200]);
                    // rounding of YUV, amplified by 2
                    assert!((0..3).all(|c| found[c].abs_diff(seen[c]) <= 3), "{found:?}");
                    colours += 1;
                }
            }
        }
        assert_eq!((depths, colours), (4, 4));
        camera.stop().unwrap();
        assert!(
            camera
                .next_frame(Duration::from_millis(5))
                .unwrap()
                .is_none()
        );
    }
}

#[test]
fn camera_with_lost_packets_marks_the_frames_and_counts_them() {
    let mut camera = camera(100);
    camera.start_depth(settings(DepthFormat::Packed11)).unwrap();
    let frames: Vec<_> = (0..9)
        .map(|_| camera.next_frame(TIMEOUT).unwrap().unwrap())
        .collect();
    // 141 packets a frame
    let faults = camera.faults()[0].unwrap();
    assert!((11..=13).contains(&faults.lost), "{faults:?}");
    assert!(frames.iter().filter(|frame| !frame.complete).count() >= 8);
}
