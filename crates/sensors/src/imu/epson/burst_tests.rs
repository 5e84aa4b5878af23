//! Burst messages: the constructed vector, wraps, losses, garbage.

use super::*;
use crate::imu::epson::find_model;

const PERIOD: Counter = Counter::Messages {
    period_ns: 8_000_000,
};
/// The constructed message: 25 degrees, gyro (1, -1, 0), accelerometer (0, 0, 8000), count 1.
const MESSAGE: [u8; 24] = [
    0x80, 0xfe, 0x00, 0x0a, 0x4a, 0x00, 0x01, 0xff, 0xff, 0, 0, 0, 0, 0, 0, 0x1f, 0x40, 0, 0, 0, 1,
    0x27, 0x8b, 0x0d,
];

fn decoder(format: BurstFormat) -> Decoder<Burst> {
    burst_decoder(*find_model("G364PDC0").unwrap(), format, PERIOD)
}

fn readings(decoder: &mut Decoder<Burst>, bytes: &[u8]) -> Vec<Reading> {
    let mut readings = Vec::new();
    decoder.push(bytes, |reading| readings.push(reading));
    readings
}

#[test]
fn burst_of_the_constructed_vector_has_its_values() {
    let reading = readings(&mut decoder(BurstFormat::STANDARD), &MESSAGE)[0];
    let gyro = reading.gyro_rad_s.unwrap();
    assert!((gyro - Vector3::new(1.0, -1.0, 0.0) * 0.0075_f64.to_radians()).norm() < 1e-12);
    assert_eq!(
        reading.accel_m_s2.unwrap(),
        Vector3::new(0.0, 0.0, 9.806_65)
    );
    assert_eq!(
        (reading.temperature_c, reading.device_ns),
        (Some(25.0), Some(8_000_000))
    );
}

#[test]
fn burst_encoded_is_the_constructed_vector() {
    let (gyro, accel) = ([1.0, -1.0, 0.0], [0.0, 0.0, 8000.0]);
    assert_eq!(
        BurstFormat::STANDARD.encode(2634.0, gyro, accel, 1),
        MESSAGE
    );
    let wide = BurstFormat::WIDE.encode(2634.0, [0.5, -0.25, 0.0], accel, 1);
    assert_eq!(wide.len(), 38);
    let reading = readings(&mut decoder(BurstFormat::WIDE), &wide)[0];
    let gyro = reading.gyro_rad_s.unwrap() / 0.0075_f64.to_radians();
    assert!((gyro - Vector3::new(0.5, -0.25, 0.0)).norm() < 1e-9);
}

#[test]
fn burst_clock_goes_on_over_the_counters_wrap_and_counts_losses() {
    let mut decoder = decoder(BurstFormat::STANDARD);
    let mut times = Vec::new();
    for count in [65_534, 65_535, 0, 1, 4, 3] {
        let bytes = BurstFormat::STANDARD.encode(0.0, [0.0; 3], [0.0; 3], count);
        times.extend(
            readings(&mut decoder, &bytes)
                .iter()
                .map(|r| r.device_ns.unwrap() / 8_000_000),
        );
    }
    assert_eq!(times, [65_534, 65_535, 65_536, 65_537, 65_540, 65_539]);
    assert_eq!((decoder.faults().lost, decoder.faults().steps_back), (2, 1));
}

#[test]
fn burst_after_garbage_is_found_within_the_next_message() {
    let garbage: Vec<u8> = [0x80, 0x0d, 0x80, 0xfe, 0x80, 7, 0x0d].repeat(5);
    for cut in 0..MESSAGE.len() {
        let mut decoder = decoder(BurstFormat::STANDARD);
        let stream = [&MESSAGE[cut..], &garbage, &MESSAGE, &MESSAGE].concat();
        let found: usize = stream
            .chunks(5)
            .map(|piece| readings(&mut decoder, piece).len())
            .sum();
        assert!(found >= 2, "cut {cut}: {found}");
        let faults = decoder.faults();
        let read = 24 * faults.messages + faults.skipped_bytes;
        assert_eq!(
            read,
            stream.len() as u64,
            "cut {cut}: every byte is counted"
        );
    }
}

#[test]
fn burst_with_a_wrong_checksum_is_counted_and_left_out() {
    let mut bad = MESSAGE;
    bad[5] ^= 1;
    let mut decoder = decoder(BurstFormat::STANDARD);
    assert!(readings(&mut decoder, &bad).is_empty());
    assert_eq!(decoder.faults().bad_checksums, 1);
}
