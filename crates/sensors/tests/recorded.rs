//! Messages and images that devices sent: read from the folder of `SPHEREFLOW_DATA`.
#![allow(clippy::unwrap_used)] // helpers of tests may unwrap

mod common;

use common::recordings;
use sphereflow_core::statistics::median_mut;
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
