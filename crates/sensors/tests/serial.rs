//! The real serial port code against a simulated Epson unit on a pseudo terminal.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests may

use sphereflow_core::ImuSample;
use sphereflow_sensors::imu::epson::BurstFormat;
use sphereflow_sensors::serial::{ImuKind, SerialImu, SerialSample};
use sphereflow_sensors::sim::{PtyEpson, Script};
use sphereflow_sensors::{Error, Result};
use std::time::{Duration, Instant};

/// Long enough for a machine that is busy with other things.
const PATIENCE: Duration = Duration::from_secs(10);

fn open(device: &PtyEpson, rate_hz: f64) -> SerialImu {
    let kind = ImuKind::Epson {
        format: BurstFormat::STANDARD,
        rate_hz,
    };
    SerialImu::open(device.name(), 460_800, kind).unwrap()
}

fn samples(imu: &mut SerialImu, count: usize) -> Vec<ImuSample> {
    let next = |imu: &mut SerialImu| match imu.next_sample(PATIENCE).unwrap() {
        Some(SerialSample::Imu(sample)) => sample,
        other => panic!("{other:?}"),
    };
    (0..count).map(|_| next(imu)).collect()
}

#[test]
fn epson_on_a_port_is_configured_and_sends_at_both_rates() {
    for rate in [125.0, 1000.0] {
        let device = PtyEpson::start(rate, Script::default()).unwrap();
        let mut imu = open(&device, rate);
        assert_eq!(imu.product(), Some("G366PDG0"));
        let samples = samples(&mut imu, 300);
        for (i, pair) in samples.windows(2).enumerate() {
            assert!(pair[1].stamp > pair[0].stamp, "{i}");
            assert!((pair[0].accel_m_s2.norm() - 9.806_65).abs() < 1e-9);
        }
        let faults = imu.faults();
        assert_eq!(
            (faults.lost, faults.bad_checksums, faults.steps_back),
            (0, 0, 0)
        );
        assert!(imu.clock().jitter_s > 0.0);
    }
}

#[test]
fn epson_with_losses_and_garbage_loses_only_what_was_lost() {
    let script = Script {
        lose_every: 10,
        garbage_every: 7,
        unplug_after: 0,
    };
    let device = PtyEpson::start(500.0, script).unwrap();
    let mut imu = open(&device, 500.0);
    let samples = samples(&mut imu, 270);
    let numbers: Vec<i64> = samples
        .iter()
        .map(|s| (s.gyro_rad_s.z.to_degrees() * 66.0).round() as i64)
        .collect();
    // every number but the tens came, garbage or not
    let expected: Vec<i64> = (1..)
        .filter(|i| i % 10 != 0)
        .map(|i| i % 100)
        .take(270)
        .collect();
    assert_eq!(numbers, expected);
    assert!(
        imu.faults().lost >= 26 && imu.faults().skipped_bytes > 0,
        "{:?}",
        imu.faults()
    );
}

#[test]
fn epson_that_is_unplugged_is_told_within_a_second() {
    let script = Script {
        unplug_after: 50,
        ..Script::default()
    };
    let device = PtyEpson::start(1000.0, script).unwrap();
    let mut imu = open(&device, 1000.0);
    let (begin, mut last) = (Instant::now(), Instant::now());
    let error = loop {
        match imu.next_sample(PATIENCE) {
            Ok(Some(_)) => last = Instant::now(),
            Ok(None) => panic!("neither samples nor an error in {:?}", begin.elapsed()),
            Err(error) => break error,
        }
    };
    assert!(matches!(error, Error::Unplugged { .. }), "{error}");
    assert!(
        last.elapsed() < Duration::from_secs(1),
        "{:?}",
        last.elapsed()
    );
}

#[test]
fn port_that_is_not_there_is_named_with_those_that_are() {
    let result: Result<SerialImu> = SerialImu::open("/dev/no-such-port", 9600, ImuKind::Text);
    let text = result.unwrap_err().to_string();
    assert!(
        text.contains("/dev/no-such-port") && text.contains("found"),
        "{text}"
    );
}
