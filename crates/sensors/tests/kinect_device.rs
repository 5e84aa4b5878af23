//! The driver of the Kinect against the simulated device: parameters, streams, losses, unplugging.
#![allow(clippy::unwrap_used)] // helpers of tests may unwrap

use sphereflow_core::{Plane, Stamp};
use sphereflow_sensors::Error;
use sphereflow_sensors::disparity::DisparityModel;
use sphereflow_sensors::kinect::{Camera, Content, Mode};
use sphereflow_sensors::sim::{KinectScript, KinectSimulator, Picture};
use std::time::Duration;

const TIMEOUT: Duration = Duration::from_secs(5);
const STARTED: Stamp = Stamp::from_ns(1_800_000_000_000_000_000);

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

fn camera(script: KinectScript) -> Camera<KinectSimulator> {
    Camera::open(KinectSimulator::new(script, STARTED, picture)).unwrap()
}

#[test]
fn camera_reads_its_own_parameters() {
    let camera = camera(KinectScript::default());
    let model = camera.model();
    assert_eq!(model.shift, 200);
    // as 32-bit numbers hold them
    assert!((model.pixel_cm - DisparityModel::TYPICAL.pixel_cm).abs() < 1e-8);
}

#[test]
fn camera_gives_every_pixel_of_both_streams_over_a_wrap_of_the_clock() {
    let script = KinectScript {
        first_tick: u32::MAX - 5_000_000,
        ..KinectScript::default()
    };
    let mut camera = camera(script);
    camera.start(Mode::DEPTH_11).unwrap();
    camera.start(Mode::BAYER).unwrap();
    let (mut depths, mut colours) = (0, 0);
    let mut last: Option<Stamp> = None;
    for _ in 0..20 {
        let frame = camera.next_frame(TIMEOUT).unwrap().unwrap();
        assert!(frame.missing.is_empty());
        match frame.content {
            Content::Depth(raw, depth) => {
                assert_eq!(raw, picture(depths).0);
                assert_eq!(
                    depth.known_share(),
                    camera.model().table().apply(&raw).known_share()
                );
                if let Some(last) = last.replace(frame.stamp) {
                    let step = frame.stamp.seconds_since(last);
                    assert!((step - 1.0 / 30.0).abs() < 1e-4, "{step}");
                }
                depths += 1;
            }
            Content::Colour(colour) => {
                assert_eq!(colour[(320, 240)], [(20 * colours) as u8, 90, 200]);
                let last = last.unwrap();
                // streams of one clock: their fits differ by what one arrival was later, 0 here
                assert!(frame.stamp.seconds_since(last).abs() < 1e-6);
                colours += 1;
            }
            Content::Infrared(_) => panic!("no infrared was started"),
        }
    }
    assert_eq!((depths, colours), (10, 10));
    assert_eq!(camera.faults(&Mode::DEPTH_11).unwrap().lost, 0);
    for mode in [Mode::DEPTH_11, Mode::BAYER] {
        let ticks = camera.tick_faults(&mode).unwrap();
        assert_eq!((ticks.wraps, ticks.steps_back, ticks.jumps), (1, 0, 0));
    }
}

#[test]
fn camera_with_lost_packets_reports_each() {
    let mut camera = camera(KinectScript {
        lose_every: 100,
        ..KinectScript::default()
    });
    camera.start(Mode::DEPTH_11).unwrap();
    let mut incomplete = 0;
    for _ in 0..10 {
        let frame = camera.next_frame(TIMEOUT).unwrap().unwrap();
        incomplete += u32::from(!frame.missing.is_empty());
        let Content::Depth(raw, _) = frame.content else {
            panic!("depth alone was started")
        };
        for range in &frame.missing {
            let inside = range.start * 8 / 11 + 1..range.end * 8 / 11 - 1;
            assert!(raw.data()[inside].iter().all(|pixel| *pixel == 2047));
        }
    }
    let faults = camera.faults(&Mode::DEPTH_11).unwrap();
    assert_eq!(faults.lost, 24); // of 2420 packets
    assert!(incomplete >= 9);
}

#[test]
fn camera_that_is_unplugged_says_so() {
    let mut camera = camera(KinectScript {
        unplug_after: 1000,
        ..KinectScript::default()
    });
    camera.start(Mode::DEPTH_11).unwrap();
    let error = (0..10)
        .find_map(|_| camera.next_frame(TIMEOUT).err())
        .unwrap();
    assert!(matches!(error, Error::Unplugged { .. }), "{error}");
}

#[test]
fn camera_started_and_stopped_again_and_again_goes_on() {
    let mut camera = camera(KinectScript::default());
    for _ in 0..5 {
        camera.start(Mode::DEPTH_11).unwrap();
        assert!(camera.next_frame(TIMEOUT).unwrap().is_some());
        camera.stop().unwrap();
        assert!(
            camera
                .next_frame(Duration::from_millis(5))
                .unwrap()
                .is_none()
        );
    }
}
