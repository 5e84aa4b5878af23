//! One line of text a reading, for Arduino-class boards.
//!
//! `t_us,ax,ay,az,gx,gy,gz[,mx,my,mz][*hh]` and a line feed: microseconds since the board started (an
//! integer that may wrap after 32 bits), m/s^2, rad/s, microtesla; `hh` is the exclusive or of all
//! characters before the star in hexadecimal. A carriage return before the line feed is allowed;
//! lines that begin with `#` are comments.

use super::framing::Protocol;
use super::{Decoder, Reading, Step, unwrap_counter};
use nalgebra::Vector3;

/// Longest line that is believed, bytes.
const LONGEST: usize = 256;

/// Lines of a board.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    time: Option<i64>,
    before: Option<i64>,
}

/// A decoder of lines. The first line, mostly cut off, is malformed as often as not.
pub fn line_decoder() -> Decoder<Lines> {
    Decoder::with(Lines::default())
}

fn checksum(text: &[u8]) -> u8 {
    text.iter().fold(0, |sum, byte| sum ^ byte)
}

impl Lines {
    /// `None` where the line is no reading.
    fn reading(&mut self, text: &str) -> Option<Reading> {
        let mut fields = text.split(',');
        let time = fields.next()?.trim().parse::<u32>().ok()?;
        let mut values = [0.0; 9];
        let mut count = 0;
        for field in fields {
            let value: f64 = field.trim().parse().ok()?;
            *values.get_mut(count)? = value;
            count += 1;
        }
        if !(count == 6 || count == 9) || values.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let vector = |i: usize| Some(Vector3::new(values[i], values[i + 1], values[i + 2]));
        self.before = self.time;
        let time = unwrap_counter(32, self.time, u64::from(time));
        self.time = Some(time);
        Some(Reading {
            device_ns: Some(time.saturating_mul(1000)),
            accel_m_s2: vector(0),
            gyro_rad_s: vector(3),
            mag_ut: if count == 9 { vector(6) } else { None },
            temperature_c: None,
        })
    }
}

impl Protocol for Lines {
    fn step(&mut self, bytes: &[u8]) -> Step {
        let Some(end) = bytes.iter().take(LONGEST).position(|byte| *byte == b'\n') else {
            return if bytes.len() < LONGEST {
                Step::Incomplete
            } else {
                Step::Nothing
            };
        };
        let length = end + 1;
        let line = bytes[..end].trim_ascii();
        if line.is_empty() || line[0] == b'#' {
            return Step::Other(length);
        }
        let text = match line.iter().rposition(|byte| *byte == b'*') {
            Some(star) => {
                let told = std::str::from_utf8(&line[star + 1..]).ok();
                let told = told.and_then(|told| u8::from_str_radix(told, 16).ok());
                if told != Some(checksum(&line[..star])) {
                    return Step::BadChecksum(length);
                }
                &line[..star]
            }
            None => line,
        };
        match std::str::from_utf8(text)
            .ok()
            .and_then(|text| self.reading(text))
        {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn readings(bytes: &[u8]) -> (Vec<Reading>, crate::MessageFaults) {
        let (mut decoder, mut readings) = (line_decoder(), Vec::new());
        for piece in bytes.chunks(3) {
            decoder.push(piece, |reading| readings.push(reading));
        }
        (readings, decoder.faults())
    }

    #[test]
    fn lines_with_and_without_magnetometer_are_read() {
        let text = b"# board\r\n1000,0,0,9.81,0.1,0.2,0.3\r\n2000,0,0,9.81,0,0,0,20.5,-3,41\n";
        let (readings, faults) = readings(text);
        assert_eq!((readings.len(), faults.malformed), (2, 0));
        assert_eq!(readings[0].gyro_rad_s, Some(Vector3::new(0.1, 0.2, 0.3)));
        assert_eq!(
            (readings[0].mag_ut, readings[1].device_ns),
            (None, Some(2_000_000))
        );
        assert_eq!(readings[1].mag_ut, Some(Vector3::new(20.5, -3.0, 41.0)));
    }

    #[test]
    fn lines_with_a_checksum_are_checked() {
        let line = "5,1,2,3,4,5,6";
        let sum = checksum(line.as_bytes());
        let (good, _) = readings(format!("{line}*{sum:02X}\n").as_bytes());
        assert_eq!(good.len(), 1);
        let (bad, faults) = readings(format!("{line}*{:02x}\n7,1,2,3,4,5,6\n", sum ^ 1).as_bytes());
        assert!(faults.bad_checksums >= 1 && bad.iter().all(|r| r.device_ns != Some(5000)));
    }

    #[test]
    fn lines_that_are_none_are_counted() {
        let text =
            b"1,2\n1,a,2,3,4,5,6\n1,nan,0,0,0,0,0\n-1,0,0,0,0,0,0\n1,1,1,1,1,1,1,1\n\xff\xfe\n";
        let (found, faults) = readings(text);
        assert!(found.is_empty());
        assert_eq!(faults.malformed, 6);
    }

    #[test]
    fn lines_without_end_hold_no_more_than_one() {
        let mut decoder = line_decoder();
        decoder.push(&[b'1'; 100_000], |_| panic!("no line"));
        assert!(decoder.faults().skipped_bytes > 99_000);
    }
}
