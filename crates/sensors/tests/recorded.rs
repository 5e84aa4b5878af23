//! Messages and images that devices sent: read from the folder of `SPHEREFLOW_DATA`.
#![allow(clippy::unwrap_used)] // helpers of tests may unwrap

mod common;

use common::recordings;
use sphereflow_core::statistics::median_mut;
use sphereflow_core::{Plane, Stamp};
use sphereflow_sensors::clock::{ClockFit, Ticks};
use sphereflow_sensors::disparity::DisparityModel;
use sphereflow_sensors::imu::epson::{find_model, read};
use sphereflow_sensors::imu::{Reading, vectornav, xsens};
use sphereflow_sensors::kinect::parse_motor_state;
use std::collections::HashMap;
use std::fs;

/// Decimals that the decoded texts keep.
const PRINTED: f64 = 6e-9;

#[test]
fn xsens_messages_have_the_values_that_the_maker_decoded() {
    let Some(folder) = recordings("xsens-mti") else {
        return;
    };
    let text = fs::read_to_string(folder.join("packets.jsonl")).unwrap();
    let mut compared = 0;
    for line in text.lines() {
        let hex = line.split('"').nth(3).unwrap();
        let bytes: Vec<u8> = hex
            .split_whitespace()
            .map(|h| u8::from_str_radix(h, 16).unwrap())
            .collect();
        let mut readings: Vec<Reading> = Vec::new();
        xsens::mtdata2_decoder().push(&xsens::frame(&bytes), |reading| readings.push(reading));
        let number = |key: &str| -> Option<f64> {
            let rest = line.split(key).nth(1)?.trim_start_matches([':', ' ']);
            let end = rest.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c)))?;
            rest[..end].parse().ok()
        };
        let reading = readings[0];
        for (key, found) in [
            ("accX", reading.accel_m_s2.map(|a| a.x)),
            ("accZ", reading.accel_m_s2.map(|a| a.z)),
            ("gyrY", reading.gyro_rad_s.map(|w| w.y)),
            ("magZ", reading.mag_ut.map(|m| m.z / xsens::FIELD_UT)),
        ] {
            assert_eq!(number(key).is_some(), found.is_some(), "{key}");
            if let (Some(told), Some(found)) = (number(key), found) {
                assert!((told - found).abs() <= PRINTED, "{key}: {told} {found}");
                compared += 1;
            }
        }
    }
    assert!(compared >= 8, "{compared}");
}

#[test]
fn vectornav_messages_have_the_values_of_the_table_beside_them() {
    let Some(folder) = recordings("vectornav-vn310") else {
        return;
    };
    let bytes = fs::read(folder.join("vn310-imu.vnb")).unwrap();
    let table = fs::read_to_string(folder.join("vn310-imu.csv")).unwrap();
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mask = |i: usize| u16::from_le_bytes([bytes[4 * i], bytes[4 * i + 1]]);
    // the container: masks of the groups time, IMU, GNSS, attitude; then stamp and groups
    let masks = [mask(0), mask(1), mask(2), mask(3)];
    let size = 16 + 179; // those of the groups' fields
    let mut decoder = vectornav::binary_decoder();
    let mut readings: Vec<Reading> = Vec::new();
    for message in bytes[24..].chunks_exact(size) {
        let stream = vectornav::frame(0b1_1110, &masks, &message[16..]);
        decoder.push(&stream, |reading| readings.push(reading));
    }
    // the table's last line is cut off
    assert_eq!(readings.len() + 1, lines.clone().count());
    assert_eq!(decoder.faults().skipped_bytes, 0);
    for (line, reading) in lines.zip(&readings) {
        let row: HashMap<&str, &str> = names.iter().copied().zip(line.split(',')).collect();
        let number = |name: &str| row[name].parse::<f64>().unwrap();
        let found = [
            ("Time::TimeStartup [ns]", reading.device_ns.unwrap() as f64),
            ("IMU::Mag::X [Gauss]", reading.mag_ut.unwrap().x / 100.0),
            ("IMU::Accel::Y [m/s^2]", reading.accel_m_s2.unwrap().y),
            ("IMU::AngularRate::Z [rad/s]", reading.gyro_rad_s.unwrap().z),
            ("IMU::Temp [Celsius]", reading.temperature_c.unwrap()),
        ];
        for (name, found) in found {
            let told = number(name);
            // eight digits are printed
            assert!(
                (told - found).abs() <= 1e-7 * told.abs().max(1e-6),
                "{name} {told} {found}"
            );
        }
    }
}

#[test]
fn epson_register_dump_names_its_model_and_reads_one_g() {
    let Some(folder) = recordings("epson-examples") else {
        return;
    };
    let text = fs::read_to_string(folder.join("g366_register_dump.txt")).unwrap();
    let register = |window: u8, address: u8| -> u16 {
        let key = format!("REG[0x{address:02X}, (W{window})] => 0x");
        let at = text.find(&key).unwrap() + key.len();
        u16::from_str_radix(&text[at..at + 4], 16).unwrap()
    };
    let product: String = (0..4)
        .flat_map(|i| register(1, 0x6a + 2 * i).to_le_bytes())
        .map(char::from)
        .collect();
    let model = find_model(&product).unwrap();
    assert_eq!((product.as_str(), model.product), ("G366PDG0", "G366"));
    let wide = |address| {
        f64::from(
            (u32::from(register(0, address)) << 16 | u32::from(register(0, address + 2))) as i32,
        ) / 65536.0
    };
    let accel = [0x1e, 0x22, 0x26].map(|address| wide(address) * model.accel_mg * 1e-3);
    let norm = accel.iter().map(|a| a * a).sum::<f64>().sqrt();
    assert!((norm - 1.0).abs() < 0.01, "{accel:?}"); // at rest
    let celsius = 25.0 + wide(0x0e) * model.temperature_c;
    assert!((20.0..30.0).contains(&celsius), "{celsius}");
    assert_eq!(read(0x4c), [0x4c, 0, 0x0d]);
}

#[test]
fn kinect_accelerometer_of_a_recording_reads_one_g() {
    let Some(folder) = recordings("kinect1-fakenect") else {
        return;
    };
    let bytes = fs::read(folder.join("accelerometer-all-1458x12.bin")).unwrap();
    let mut norms: Vec<f64> = bytes
        .chunks_exact(12)
        .map(|record| {
            let be = |i: usize| [record[i + 1], record[i]];
            let [x, y, z] = [be(0), be(2), be(4)];
            let wire = [
                0, 0, x[0], x[1], y[0], y[1], z[0], z[1], record[6], record[8],
            ];
            let state = parse_motor_state(&wire).unwrap();
            state.accel_m_s2.iter().map(|a| a * a).sum::<f64>().sqrt() / 9.806_65
        })
        .collect();
    assert_eq!(norms.len(), 1458);
    let median = median_mut(&mut norms).unwrap();
    assert!((median - 1.010).abs() < 0.002, "{median}");
}

/// Depth images of the recording: host time, ticks, raw disparities.
fn fakenect(folder: &std::path::Path) -> Vec<(Stamp, u32, Plane<u16>)> {
    let unpacked = tempfile::tempdir().unwrap();
    let mut tar = std::process::Command::new("tar");
    tar.arg("-xJf")
        .arg(folder.join("fakenect-record-120.tar.xz"))
        .arg("-C")
        .arg(unpacked.path());
    assert!(tar.status().unwrap().success());
    let session = unpacked.path().join("fakenect-record");
    let index = fs::read_to_string(session.join("INDEX.txt")).unwrap();
    let depths = index.lines().filter(|line| line.starts_with("d-"));
    depths
        .map(|name| {
            let parts: Vec<&str> = name.trim_end_matches(".pgm").split('-').collect();
            let bytes = fs::read(session.join(name)).unwrap();
            let pixels = bytes[bytes.len() - 2 * 640 * 480..].chunks_exact(2);
            let pixels = pixels.map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
            let plane = Plane::from_vec(640, 480, pixels).unwrap();
            (parts[1].parse().unwrap(), parts[2].parse().unwrap(), plane)
        })
        .collect()
}

#[test]
fn kinect_recording_has_metres_and_the_known_clock() {
    let Some(folder) = recordings("kinect1-fakenect") else {
        return;
    };
    let frames = fakenect(&folder);
    assert_eq!(frames.len(), 120);
    let table = DisparityModel::TYPICAL.table();
    let (mut ticks, mut clock) = (Ticks::new(60e6).unwrap(), ClockFit::new());
    let (mut last, mut dropped) = (None, 0);
    for (arrived, tick, raw) in &frames {
        let depth = table.apply(raw);
        assert!(depth.known_share() > 0.3, "{arrived}");
        let known = depth.metres().data().iter().filter(|z| !z.is_nan());
        assert!(known.into_iter().all(|z| (0.3..10.0).contains(z)));
        let ns = ticks.device_ns(*tick, *arrived).unwrap();
        clock.stamp(ns, *arrived);
        if let Some(last) = last {
            // one frame is 2 002 155 ticks: 33.369 ms
            let frames = (ns - last) as f64 / 33_369_250.0;
            assert!((frames - frames.round()).abs() < 1e-5, "{frames}");
            dropped += frames.round() as i64 - 1;
        }
        last = Some(ns);
    }
    assert_eq!(dropped, 10); // 16 in the whole recording, of which these are the first images
    assert_eq!((ticks.faults().steps_back, clock.state().steps), (0, 0));
}

#[test]
fn kinect_index_of_the_whole_recording_has_sixteen_drops() {
    let Some(folder) = recordings("kinect1-fakenect") else {
        return;
    };
    let index = fs::read_to_string(folder.join("INDEX-full-recording.txt")).unwrap();
    let mut ticks = Ticks::new(60e6).unwrap();
    let depths = index.lines().filter(|line| line.starts_with("d-"));
    let times: Vec<i64> = depths
        .map(|name| {
            let parts: Vec<&str> = name.trim_end_matches(".pgm").split('-').collect();
            ticks
                .device_ns(parts[2].parse().unwrap(), parts[1].parse().unwrap())
                .unwrap()
        })
        .collect();
    let frames = |pair: &[i64]| ((pair[1] - pair[0]) as f64 / 33_369_250.0).round() as i64;
    assert_eq!(times.len(), 346);
    assert_eq!(
        times.windows(2).map(|pair| frames(pair) - 1).sum::<i64>(),
        16
    );
}
