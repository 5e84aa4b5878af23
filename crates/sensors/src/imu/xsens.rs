//! Xsens MTi units: MTData2 messages (`FA FF 36`), big-endian.

use super::framing::Protocol;
use super::{Decoder, Reading, Step, unwrap_counter};
use nalgebra::Vector3;

/// Goes to configuration, where the device answers instead of measuring.
pub const TO_CONFIGURATION: [u8; 5] = [0xfa, 0xff, 0x30, 0x00, 0xd1];
/// Goes back to measuring.
pub const TO_MEASUREMENT: [u8; 5] = [0xfa, 0xff, 0x10, 0x00, 0xf1];

/// Flux density of one unit of the magnetometer, microtesla: the device divides by the earth's field
/// where the maker calibrated it (Enschede, about 49). Only directions are exact.
pub const FIELD_UT: f64 = 49.0;

const PREAMBLE: [u8; 2] = [0xfa, 0xff];
const DATA: u8 = 0x36;
/// Length that says that two bytes of length follow.
const EXTENDED: u8 = 0xff;
/// Longest message that is believed, bytes; the protocol's own limit is 2048 of payload.
const LONGEST: usize = 2055;

/// Kinds of data; the lower 4 bits of an identifier tell precision and frame.
const COUNTER: u16 = 0x1020;
const TIME_FINE: u16 = 0x1060;
const TEMPERATURE: u16 = 0x0810;
const ACCELERATION: u16 = 0x4020;
const RATE_OF_TURN: u16 = 0x8020;
const MAGNETIC: u16 = 0xc020;

/// Messages of a MTi.
#[derive(Clone, Debug)]
pub struct MtData2 {
    time: Option<i64>,
    counter: Option<i64>,
    before: Option<i64>,
}

/// A decoder of MTData2. Orientations that the device has fused are left out: only what it measured
/// is read.
pub fn mtdata2_decoder() -> Decoder<MtData2> {
    Decoder::with(MtData2 {
        time: None,
        counter: None,
        before: None,
    })
}

impl MtData2 {
    /// `None` where the content is no list of items of their known lengths.
    fn reading(&mut self, mut items: &[u8]) -> Option<Reading> {
        let mut reading = Reading::default();
        self.before = self.counter;
        while !items.is_empty() {
            let (head, rest) = items.split_first_chunk::<3>()?;
            let (data, rest) = rest.split_at_checked(usize::from(head[2]))?;
            items = rest;
            let id = u16::from_be_bytes([head[0], head[1]]);
            match id & 0xfff0 {
                COUNTER => {
                    let shown = u64::from(u16::from_be_bytes(*data.first_chunk()?));
                    self.counter = Some(unwrap_counter(16, self.counter, shown));
                }
                TIME_FINE => {
                    let shown = u64::from(u32::from_be_bytes(*data.first_chunk()?));
                    self.time = Some(unwrap_counter(32, self.time, shown));
                    reading.device_ns = self.time.map(|ticks| ticks.saturating_mul(100_000));
                }
                TEMPERATURE => reading.temperature_c = Some(numbers::<1>(id, data)?[0]),
                ACCELERATION => reading.accel_m_s2 = Some(numbers::<3>(id, data)?.into()),
                RATE_OF_TURN => reading.gyro_rad_s = Some(numbers::<3>(id, data)?.into()),
                MAGNETIC => {
                    reading.mag_ut = Some(Vector3::from(numbers::<3>(id, data)?) * FIELD_UT);
                }
                _ => {}
            }
        }
        reading.is_finite().then_some(reading)
    }
}

/// Numbers in the precision that the identifier says: 32-bit or 64-bit floating point, or fixed point
/// 12.20 and 16.32.
fn numbers<const N: usize>(id: u16, data: &[u8]) -> Option<[f64; N]> {
    let size = [4, 4, 6, 8][usize::from(id & 3)];
    if data.len() != N * size {
        return None;
    }
    let mut out = [0.0; N];
    for (value, b) in out.iter_mut().zip(data.chunks_exact(size)) {
        *value = match (id & 3, b) {
            (0, &[b0, b1, b2, b3]) => f64::from(f32::from_be_bytes([b0, b1, b2, b3])),
            (1, &[b0, b1, b2, b3]) => f64::from(i32::from_be_bytes([b0, b1, b2, b3])) / 1_048_576.0,
            (2, &[f0, f1, f2, f3, i0, i1]) => {
                let fraction = f64::from(u32::from_be_bytes([f0, f1, f2, f3])) / 4_294_967_296.0;
                f64::from(i16::from_be_bytes([i0, i1])) + fraction
            }
            (_, bytes) => f64::from_be_bytes(*bytes.first_chunk()?),
        };
    }
    Some(out)
}

impl Protocol for MtData2 {
    fn step(&mut self, bytes: &[u8]) -> Step {
        if bytes.iter().zip(&PREAMBLE).any(|(a, b)| a != b) {
            return Step::Nothing;
        }
        let (Some(id), Some(short)) = (bytes.get(2), bytes.get(3)) else {
            return Step::Incomplete;
        };
        let (begin, payload) = match (*short, bytes.get(4), bytes.get(5)) {
            (EXTENDED, Some(high), Some(low)) => {
                (6, usize::from(u16::from_be_bytes([*high, *low])))
            }
            (EXTENDED, ..) => return Step::Incomplete,
            (length, ..) => (4, usize::from(length)),
        };
        let length = begin + payload + 1;
        if length > LONGEST {
            return Step::Nothing;
        }
        let Some(message) = bytes.get(..length) else {
            return Step::Incomplete;
        };
        if message[1..]
            .iter()
            .fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
            != 0
        {
            return Step::BadChecksum(1);
        }
        if *id != DATA {
            return Step::Other(length);
        }
        match self.reading(&message[begin..length - 1]) {
            Some(reading) => Step::Message(length, reading),
            None => Step::Malformed(length),
        }
    }

    fn gap(&mut self) -> (u64, bool) {
        match (self.before, self.counter) {
            (Some(before), Some(now)) if now <= before => (0, true),
            (Some(before), Some(now)) => ((now - before - 1) as u64, false),
            _ => (0, false),
        }
    }
}

/// The message of a payload of items: preamble, length, checksum.
pub fn frame(payload: &[u8]) -> Vec<u8> {
    let mut message = vec![PREAMBLE[0], PREAMBLE[1], DATA];
    match u8::try_from(payload.len()) {
        Ok(length) if length != EXTENDED => message.push(length),
        _ => {
            message.push(EXTENDED);
            message.extend((payload.len().min(usize::from(u16::MAX)) as u16).to_be_bytes());
        }
    }
    message.extend(payload);
    let sum = message[1..]
        .iter()
        .fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
    message.push(sum.wrapping_neg());
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_of_the_captured_vector_is_read() {
        let hex = "fa ff 36 26 10 20 02 46 82 10 60 04 01 c4 fc 3e 20 10 10 3f 71 ce 6c be a5 6b cf \
                   3c 61 3b d8 bd 69 1d 25 e0 20 04 00 40 00 03 12";
        let bytes: Vec<u8> = hex
            .split_whitespace()
            .map(|h| u8::from_str_radix(h, 16).unwrap())
            .collect();
        let mut decoder = mtdata2_decoder();
        let mut readings = Vec::new();
        decoder.push(&bytes, |reading| readings.push(reading));
        assert_eq!(readings[0].device_ns, Some(29_686_846 * 100_000));
        assert_eq!(decoder.faults().skipped_bytes, 0);
        assert_eq!(frame(&bytes[4..bytes.len() - 1]), bytes);
    }

    #[test]
    fn commands_have_right_checksums() {
        for command in [TO_CONFIGURATION, TO_MEASUREMENT] {
            let mut decoder = mtdata2_decoder();
            decoder.push(&command, |_| panic!("a command is no reading"));
            assert_eq!(decoder.faults(), crate::MessageFaults::default());
        }
    }

    #[test]
    fn items_of_a_wrong_length_are_malformed() {
        let mut decoder = mtdata2_decoder();
        decoder.push(&frame(&[0x40, 0x20, 3, 1, 2, 3]), |_| panic!("no reading"));
        decoder.push(&frame(&[0x40, 0x20, 12, 1]), |_| panic!("no reading"));
        assert_eq!(decoder.faults().malformed, 2);
    }
}
