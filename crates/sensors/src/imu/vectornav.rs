//! VectorNav units: binary messages (`FA`), little-endian, with a CRC at their end.

use super::framing::Protocol;
use super::{Decoder, Reading, Step};
use nalgebra::Vector3;

const SYNC: u8 = 0xfa;
/// Longest message that is believed, bytes.
const LONGEST: usize = 600;
/// Microtesla per gauss.
const UT_PER_GAUSS: f64 = 100.0;

/// Bytes of each field of the groups 1 (common), 2 (time), 3 (IMU), 4 (GNSS), 5 (attitude), 6 (INS);
/// 0 is a field of variable length, whose messages are not read.
const SIZES: [&[usize]; 6] = [
    &[8, 8, 8, 12, 16, 12, 24, 12, 12, 24, 20, 28, 2, 4, 8],
    &[8, 8, 8, 2, 8, 8, 8, 4, 4, 1],
    &[2, 12, 12, 12, 4, 4, 16, 12, 12, 12, 12],
    &[8, 8, 2, 1, 1, 24, 24, 12, 12, 12, 4, 4, 2, 28, 0, 0],
    &[2, 12, 16, 36, 12, 12, 12, 12, 12],
    &[2, 24, 24, 12, 12, 12, 12, 12, 12, 4, 4],
];

/// Messages of a VectorNav unit.
#[derive(Clone, Debug, Default)]
pub struct Binary {
    time: Option<i64>,
    before: Option<i64>,
}

/// A decoder of binary messages, whatever groups and fields they hold. Compensated values are read
/// where a message has both; orientations that the device has fused are left out.
pub fn binary_decoder() -> Decoder<Binary> {
    Decoder::with(Binary::default())
}

/// Groups of a message, `(group from 0, fields)`, and where its payload begins.
enum Layout {
    Incomplete,
    Unknown,
    Known {
        fields: Vec<(usize, usize, usize)>,
        length: usize,
    },
}

fn layout(bytes: &[u8]) -> Layout {
    let Some(groups) = bytes.get(1) else {
        return Layout::Incomplete;
    };
    let numbers = (0..8).filter(|group| groups >> group & 1 == 1);
    let mut masks = Vec::with_capacity(8);
    let mut at = 2;
    for group in numbers {
        let Some(sizes) = SIZES.get(group) else {
            return Layout::Unknown;
        };
        let Some(mask) = bytes.get(at..at + 2) else {
            return Layout::Incomplete;
        };
        let mask = u16::from_le_bytes([mask[0], mask[1]]);
        if usize::from(16 - mask.leading_zeros() as u16) > sizes.len() {
            return Layout::Unknown;
        }
        masks.push((group, mask, *sizes));
        at += 2;
    }
    let mut fields = Vec::new();
    for (group, mask, sizes) in masks {
        for (field, size) in sizes.iter().enumerate().filter(|(i, _)| mask >> i & 1 == 1) {
            if *size == 0 {
                return Layout::Unknown;
            }
            fields.push((group, field, at));
            at += size;
        }
    }
    let length = at + 2;
    if fields.is_empty() || length > LONGEST {
        return Layout::Unknown;
    }
    Layout::Known { fields, length }
}

impl Binary {
    fn reading(&mut self, message: &[u8], fields: &[(usize, usize, usize)]) -> Option<Reading> {
        let mut reading = Reading::default();
        self.before = self.time;
        for (group, field, at) in fields {
            let vector = |offset: usize| vector(&message[at + offset..]);
            match (group, field) {
                (0 | 1, 0) => {
                    let ns = u64::from_le_bytes(*message[*at..].first_chunk()?);
                    reading.device_ns = i64::try_from(ns).ok();
                }
                // the order of the cases: a compensated value replaces a raw one
                (0, 5) => reading.gyro_rad_s = Some(vector(0)?),
                (0, 8) => reading.accel_m_s2 = Some(vector(0)?),
                (0, 9) => {
                    reading.accel_m_s2.get_or_insert(vector(0)?);
                    reading.gyro_rad_s.get_or_insert(vector(12)?);
                }
                (0, 10) | (2, 8) => reading.mag_ut = Some(vector(0)? * UT_PER_GAUSS),
                (2, 1) => {
                    reading.mag_ut.get_or_insert(vector(0)? * UT_PER_GAUSS);
                }
                (2, 2) => {
                    reading.accel_m_s2.get_or_insert(vector(0)?);
                }
                (2, 3) => {
                    reading.gyro_rad_s.get_or_insert(vector(0)?);
                }
                (2, 4) => reading.temperature_c = Some(f64::from(float(&message[*at..])?)),
                (2, 9) => reading.accel_m_s2 = Some(vector(0)?),
                (2, 10) => reading.gyro_rad_s = Some(vector(0)?),
                _ => {}
            }
            if (*group, *field) == (0, 10) {
                reading.temperature_c = Some(f64::from(float(&message[at + 12..])?));
            }
        }
        self.time = reading.device_ns.or(self.time);
        reading.is_finite().then_some(reading)
    }
}

fn float(bytes: &[u8]) -> Option<f32> {
    Some(f32::from_le_bytes(*bytes.first_chunk()?))
}

fn vector(bytes: &[u8]) -> Option<Vector3<f64>> {
    Some(Vector3::new(float(bytes)?, float(&bytes[4..])?, float(&bytes[8..])?).map(f64::from))
}

/// CRC-16/XMODEM (0x1021, from 0): that of the bytes after the first one with the two of the CRC is 0.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |mut crc: u16, byte| {
        crc = crc.rotate_left(8) ^ u16::from(*byte);
        crc ^= (crc & 0xff) >> 4;
        crc ^= crc << 12;
        crc ^ (crc & 0xff) << 5
    })
}

impl Protocol for Binary {
    fn step(&mut self, bytes: &[u8]) -> Step {
        if bytes[0] != SYNC {
            return Step::Nothing;
        }
        let (fields, length) = match layout(bytes) {
            Layout::Incomplete => return Step::Incomplete,
            Layout::Unknown => return Step::Nothing,
            Layout::Known { fields, length } => (fields, length),
        };
        let Some(message) = bytes.get(..length) else {
            return Step::Incomplete;
        };
        if crc(&message[1..]) != 0 {
            return Step::BadChecksum(1);
        }
        match self.reading(message, &fields) {
            Some(reading) => Step::Message(length, reading),
            None => Step::Malformed(length),
        }
    }

    fn gap(&mut self) -> (u64, bool) {
        (
            0,
            self.before
                .zip(self.time)
                .is_some_and(|(before, now)| now <= before),
        )
    }
}

/// The message of groups with their fields and a payload: sync byte and CRC.
pub fn frame(groups: u8, fields: &[u16], payload: &[u8]) -> Vec<u8> {
    let mut message = vec![SYNC, groups];
    message.extend(fields.iter().flat_map(|mask| mask.to_le_bytes()));
    message.extend(payload);
    let crc = crc(&message[1..]);
    message.extend(crc.to_be_bytes());
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(time: u64) -> Vec<u8> {
        let numbers = [
            0.1_f32, 0.2, 0.3, 0.0, 0.0, -9.8, 0.25, 0.0, -0.4, 21.0, 100.0,
        ];
        let mut payload = time.to_le_bytes().to_vec();
        payload.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        frame(1, &[0x0521], &payload)
    }

    #[test]
    fn message_of_the_common_group_is_read() {
        let mut readings = Vec::new();
        let mut decoder = binary_decoder();
        for piece in [message(5), message(9)].concat().chunks(7) {
            decoder.push(piece, |reading| readings.push(reading));
        }
        assert_eq!((readings.len(), readings[1].device_ns), (2, Some(9)));
        assert_eq!(readings[0].accel_m_s2.unwrap().z, f64::from(-9.8_f32));
        assert_eq!(readings[0].mag_ut.unwrap().x, 25.0);
        assert_eq!(readings[0].temperature_c, Some(21.0));
    }

    #[test]
    fn message_with_a_changed_bit_is_left_out() {
        for at in 4..message(5).len() {
            let mut bad = message(5);
            bad[at] ^= 0x10;
            let mut decoder = binary_decoder();
            decoder.push(&bad, |_| panic!("byte {at} was changed"));
            assert_eq!(decoder.faults().bad_checksums, 1, "byte {at}");
        }
    }

    #[test]
    fn message_of_unknown_groups_is_passed_over() {
        let bytes = [
            frame(0x80, &[1], &[0; 8]),
            frame(8, &[0x8000], &[0; 8]),
            message(7),
        ]
        .concat();
        let mut readings = Vec::new();
        binary_decoder().push(&bytes, |reading| readings.push(reading));
        assert_eq!(readings.len(), 1);
    }

    #[test]
    fn crc_is_that_of_the_standard() {
        assert_eq!(crc(b"123456789"), 0x31c3); // the check value of CRC-16/XMODEM
    }
}
