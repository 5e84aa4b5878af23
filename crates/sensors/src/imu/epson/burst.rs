//! Burst messages: which fields they hold, and their values.

use super::Model;
use super::registers::DELIMITER;
use crate::imu::framing::Protocol;
use crate::imu::{Decoder, Reading, Step, unwrap_counter};
use nalgebra::Vector3;

/// First byte of a burst message.
const HEADER: u8 = 0x80;
/// Standard gravity, m/s^2.
const G: f64 = 9.806_65;

/// Bits of BURST_CTRL1, in the order of the fields.
const FLAGS: u16 = 15;
const TEMPERATURE: u16 = 14;
const GYRO: u16 = 13;
const ACCEL: u16 = 12;
const DELTA_ANGLE: u16 = 11;
const DELTA_VELOCITY: u16 = 10;
const QUATERNION: u16 = 9;
const ATTITUDE: u16 = 8;
const GPIO: u16 = 2;
const COUNT: u16 = 1;
const CHECKSUM: u16 = 0;

/// What a message holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BurstFormat {
    /// Register BURST_CTRL1: which fields.
    pub fields: u16,
    /// Register BURST_CTRL2: which of them have 32 bits.
    pub wide: u16,
}

impl BurstFormat {
    /// Flags, temperature, gyro, accelerometer, pins, counter and checksum, 16 bits each.
    pub const STANDARD: Self = Self {
        fields: 0xf007,
        wide: 0,
    };
    /// The same with 32 bits for temperature, gyro and accelerometer.
    pub const WIDE: Self = Self {
        fields: 0xf007,
        wide: 0x7000,
    };

    fn has(&self, bit: u16) -> bool {
        self.fields >> bit & 1 == 1
    }

    /// Bytes of one value of a field.
    fn value_bytes(&self, bit: u16) -> usize {
        if self.wide >> bit & 1 == 1 { 4 } else { 2 }
    }

    fn field_bytes(&self, bit: u16) -> usize {
        let values = match bit {
            GYRO | ACCEL | DELTA_ANGLE | DELTA_VELOCITY | ATTITUDE => 3,
            QUATERNION => 4,
            _ => 1,
        };
        let wide = matches!(bit, TEMPERATURE..=14 | ATTITUDE..=GYRO);
        values * if wide { self.value_bytes(bit) } else { 2 }
    }

    /// Where a field begins; `None` where it is not sent.
    fn offset(&self, bit: u16) -> Option<usize> {
        let before = ORDER.iter().take_while(|field| **field != bit);
        let bytes = before
            .filter(|field| self.has(**field))
            .map(|field| self.field_bytes(*field));
        self.has(bit).then(|| 1 + bytes.sum::<usize>())
    }

    /// Length of a message, bytes.
    pub fn length(&self) -> usize {
        let sent = ORDER.iter().filter(|field| self.has(**field));
        2 + sent.map(|field| self.field_bytes(*field)).sum::<usize>()
    }

    /// A field's numbers, in units of a 16-bit count.
    fn values<const N: usize>(&self, message: &[u8], bit: u16) -> Option<[f64; N]> {
        let (begin, size) = (self.offset(bit)?, self.value_bytes(bit));
        let bytes = message.get(begin..begin + N * size)?;
        let mut values = [0.0; N];
        for (value, b) in values.iter_mut().zip(bytes.chunks_exact(size)) {
            *value = match *b {
                [b0, b1] => f64::from(i16::from_be_bytes([b0, b1])),
                [b0, b1, b2, b3] => f64::from(i32::from_be_bytes([b0, b1, b2, b3])) / 65536.0,
                _ => return None,
            };
        }
        Some(values)
    }

    /// A message with these values, as a device sends it: flags, temperature, gyro, accelerometer in
    /// units of a 16-bit count, and the counter. Other fields are zero.
    pub fn encode(&self, temperature: f64, gyro: [f64; 3], accel: [f64; 3], count: u16) -> Vec<u8> {
        let mut message = vec![0; self.length()];
        message[0] = HEADER;
        let fields = [
            (TEMPERATURE, &[temperature][..]),
            (GYRO, &gyro),
            (ACCEL, &accel),
        ];
        for (bit, values) in fields {
            let Some(mut at) = self.offset(bit) else {
                continue;
            };
            for value in values {
                let wide = ((value * 65536.0).round() as i32).to_be_bytes();
                let narrow = (value.round() as i16).to_be_bytes();
                let bytes = if self.value_bytes(bit) == 4 {
                    &wide[..]
                } else {
                    &narrow[..]
                };
                message[at..at + bytes.len()].copy_from_slice(bytes);
                at += bytes.len();
            }
        }
        if let Some(at) = self.offset(FLAGS) {
            message[at..at + 2].copy_from_slice(&[0xfe, 0x00]);
        }
        if let Some(at) = self.offset(COUNT) {
            message[at..at + 2].copy_from_slice(&count.to_be_bytes());
        }
        if let Some(at) = self.offset(CHECKSUM) {
            let sum = checksum(&message[1..at]);
            message[at..at + 2].copy_from_slice(&sum.to_be_bytes());
        }
        if let Some(last) = message.last_mut() {
            *last = DELIMITER;
        }
        message
    }
}

const ORDER: [u16; 11] = [
    FLAGS,
    TEMPERATURE,
    GYRO,
    ACCEL,
    DELTA_ANGLE,
    DELTA_VELOCITY,
    QUATERNION,
    ATTITUDE,
    GPIO,
    COUNT,
    CHECKSUM,
];

/// Sum of all 16-bit words between header and checksum.
fn checksum(bytes: &[u8]) -> u16 {
    let words = bytes
        .chunks_exact(2)
        .map(|b| u16::from_be_bytes([b[0], b[1]]));
    words.fold(0, u16::wrapping_add)
}

/// What the counter in a message counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Counter {
    /// Messages, which come this far apart (nanoseconds).
    Messages {
        /// Time from one message to the next.
        period_ns: i64,
    },
    /// Ticks of this length (nanoseconds), since the last pulse at the reset pin.
    Ticks {
        /// Length of a tick: 21 333 1/3 of the free-running counter at 46 875 Hz.
        tick_ns: f64,
    },
}

/// Burst messages of one model in one format.
#[derive(Clone, Debug)]
pub struct Burst {
    model: Model,
    format: BurstFormat,
    counter: Counter,
    count: Option<i64>,
    before: Option<i64>,
}

/// A decoder of burst messages.
pub fn burst_decoder(model: Model, format: BurstFormat, counter: Counter) -> Decoder<Burst> {
    Decoder::with(Burst {
        model,
        format,
        counter,
        count: None,
        before: None,
    })
}

impl Burst {
    fn reading(&mut self, message: &[u8]) -> Reading {
        let (format, model) = (self.format, self.model);
        self.before = self.count;
        if let Some([count]) = format
            .offset(COUNT)
            .and_then(|at| message[at..].first_chunk::<2>())
            .map(|b| [u16::from_be_bytes(*b)])
        {
            self.count = Some(unwrap_counter(16, self.count, u64::from(count)));
        }
        let tick_ns = match self.counter {
            Counter::Messages { period_ns } => period_ns as f64,
            Counter::Ticks { tick_ns } => tick_ns,
        };
        let vector = |bit, scale: f64| {
            format
                .values::<3>(message, bit)
                .map(|v| Vector3::from(v) * scale)
        };
        let temperature = format.values::<1>(message, TEMPERATURE);
        Reading {
            device_ns: self
                .count
                .map(|count| (count as f64 * tick_ns).round() as i64),
            gyro_rad_s: vector(GYRO, model.gyro_deg_s.to_radians()),
            accel_m_s2: vector(ACCEL, model.accel_mg * 1e-3 * G),
            mag_ut: None,
            temperature_c: temperature
                .map(|[t]| 25.0 + (t - model.counts_at_25_c) * model.temperature_c),
        }
    }
}

impl Protocol for Burst {
    fn step(&mut self, bytes: &[u8]) -> Step {
        let length = self.format.length();
        if bytes[0] != HEADER {
            return Step::Nothing;
        }
        let Some(message) = bytes.get(..length) else {
            return Step::Incomplete;
        };
        if message[length - 1] != DELIMITER {
            return Step::Nothing;
        }
        if let Some(at) = self.format.offset(CHECKSUM)
            && checksum(&message[1..at]).to_be_bytes() != message[at..at + 2]
        {
            return Step::BadChecksum(1);
        }
        Step::Message(length, self.reading(message))
    }

    fn gap(&mut self) -> (u64, bool) {
        match (self.before, self.count, self.counter) {
            (Some(before), Some(now), _) if now <= before => (0, true),
            (Some(before), Some(now), Counter::Messages { .. }) => {
                ((now - before - 1) as u64, false)
            }
            _ => (0, false),
        }
    }
}

#[cfg(test)]
#[path = "burst_tests.rs"]
mod tests;
